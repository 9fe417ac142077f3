#include "controller/safety/fail_safe.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace breakshot::safety {
namespace {

constexpr std::uint16_t kAll = (1U << kCauses) - 1;

CauseSet set_of(unsigned bits) { return CauseSet{static_cast<std::uint16_t>(bits)}; }

bool has_rule(CauseSet set, Clear clear) {
  for (std::size_t i = 0; i < kCauses; ++i) {
    if (set.has(static_cast<Cause>(i)) && kRules[i].clear == clear) return true;
  }
  return false;
}

/// Reaches a state in which exactly `latched` is active: causes that end by themselves must be present for that.
FailSafe machine_with(CauseSet latched) {
  FailSafe machine;
  machine.update(latched);
  return machine;
}

// Every state the machine can be in, with every set of conditions: 2^11 x 2^11 updates.
TEST(FailSafe, UpdateLatchesWhatNeedsARecoveryAndDropsTheRest) {
  for (unsigned before = 0; before <= kAll; ++before) {
    FailSafe start = machine_with(set_of(before));
    ASSERT_EQ(start.active(), set_of(before));
    for (unsigned present = 0; present <= kAll; ++present) {
      FailSafe machine = start;
      const CauseSet fresh = machine.update(set_of(present));
      ASSERT_EQ(fresh, set_of(present & ~before));
      for (std::size_t i = 0; i < kCauses; ++i) {
        const auto cause = static_cast<Cause>(i);
        const bool stays = set_of(before).has(cause) && kRules[i].clear != Clear::kWhenGone;
        ASSERT_EQ(machine.active().has(cause), set_of(present).has(cause) || stays) << to_string(cause);
      }
    }
  }
}

TEST(FailSafe, TheActionFurthestDownWins) {
  for (unsigned active = 0; active <= kAll; ++active) {
    Action expected = Action::kRun;
    for (std::size_t i = 0; i < kCauses; ++i) {
      if (set_of(active).has(static_cast<Cause>(i))) expected = std::max(expected, kRules[i].action);
    }
    const FailSafe machine = machine_with(set_of(active));
    ASSERT_EQ(machine.action(), expected);
    if (active != 0) {
      ASSERT_EQ(kRules[static_cast<std::size_t>(set_of(active).worst())].action, expected);
    }
  }
}

// Every state, every set of conditions that still hold, at rest or not: recovery is done exactly when it may be, and leaves nothing that would
// need one; when it may not, nothing changes.
TEST(FailSafe, RecoversOnlyAtRestWithNoConditionLeftAndNeverFromAFault) {
  for (unsigned before = 0; before <= kAll; ++before) {
    for (unsigned present = 0; present <= kAll; ++present) {
      FailSafe start = machine_with(set_of(before));
      start.update(set_of(present));
      const bool may = !has_rule(set_of(present), Clear::kRecovery) && !has_rule(start.active(), Clear::kNever);
      ASSERT_EQ(start.recoverable(), may);
      for (std::size_t i = 0; i < kCauses; ++i) {
        const auto cause = static_cast<Cause>(i);
        const bool bars = (kRules[i].clear == Clear::kNever && start.active().has(cause)) ||
                          (kRules[i].clear == Clear::kRecovery && set_of(present).has(cause));
        ASSERT_EQ(start.in_the_way().has(cause), bars) << to_string(cause);
      }
      for (const bool at_rest : {false, true}) {
        FailSafe machine = start;
        ASSERT_EQ(machine.recover(at_rest), may && at_rest);
        if (may && at_rest) {
          ASSERT_FALSE(has_rule(machine.active(), Clear::kRecovery));
          ASSERT_LE(machine.action(), Action::kHold);
        } else {
          ASSERT_EQ(machine.active(), start.active());
        }
      }
    }
  }
}

// What the design promises, cause by cause; a change of the table must be a decision.
TEST(FailSafe, ThePolicyIsTheOneThatIsDocumented) {
  const auto rule = [](Cause cause) { return kRules[static_cast<std::size_t>(cause)]; };
  EXPECT_EQ(rule(Cause::kStatePredicted).action, Action::kHold);
  EXPECT_EQ(rule(Cause::kStateStale).action, Action::kControlledStop);
  EXPECT_EQ(rule(Cause::kStopRequested).action, Action::kControlledStop);
  EXPECT_EQ(rule(Cause::kFollowingError).action, Action::kProtectiveStop);
  EXPECT_EQ(rule(Cause::kCommandLimit).action, Action::kProtectiveStop);
  EXPECT_EQ(rule(Cause::kWrongDrives).action, Action::kFault);
  for (const Rule& each : kRules) {
    // Whatever stops the arm waits for somebody's decision; only what merely holds ends by itself.
    EXPECT_EQ(each.action <= Action::kHold, each.clear == Clear::kWhenGone);
    EXPECT_EQ(each.action == Action::kFault, each.clear == Clear::kNever);
  }
}

TEST(FailSafe, EveryCauseHasWords) {
  for (std::size_t i = 0; i < kCauses; ++i) EXPECT_STRNE(to_string(static_cast<Cause>(i)), "invalid");
  EXPECT_STREQ(to_string(static_cast<Cause>(kCauses)), "invalid");
  for (int i = 0; i <= 4; ++i) EXPECT_STRNE(to_string(static_cast<Action>(i)), "invalid");
}

}  // namespace
}  // namespace breakshot::safety
