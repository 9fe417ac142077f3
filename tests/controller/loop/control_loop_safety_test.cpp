#include "tests/controller/loop/harness.hpp"

#include "controller/safety/command_limiter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace breakshot::control::test {
namespace {

using Kind = LoopEvent::Kind;
using safety::Action;
using safety::Cause;
using std::chrono::milliseconds;

/// Smallest distance of a set-point to the trajectory's polyline, taking all joints as one vector, rad.
double distance_to_path(const motion::Trajectory& trajectory, const JointVector& q) {
  double best = std::numeric_limits<double>::infinity();
  const auto at = [&](std::size_t k) { return JointVector{JointVector::Map(trajectory.points[k].q.data(), kJoints)}; };
  for (std::size_t k = 0; k + 1 < trajectory.size; ++k) {
    const JointVector a = at(k);
    const JointVector along = at(k + 1) - a;
    const double length2 = along.squaredNorm();
    const double x = length2 > 0.0 ? std::clamp((q - a).dot(along) / length2, 0.0, 1.0) : 0.0;
    best = std::min(best, (q - a - x * along).norm());
  }
  return best;
}

class LoopSafety : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(stand.get_ready());
    trajectory = make_trajectory(stand.status().setpoint.q, all(0.5), 1);
    stand.start(*trajectory);
    stand.run(300);
    ASSERT_TRUE(stand.status().moving);
    stand.clear();
  }

  /// Ticks with `upset` until the set-point rests; every command must follow from the one before.
  int ticks_to_rest(const Stand::Upset& upset = {}) {
    int ticks = 0;
    for (; ticks < 1000; ++ticks) {
      const JointCommand before = stand.last;
      stand.tick(upset);
      if (stand.last.q.size() == 0) continue;
      expect_smooth(before, stand.last);
      if (stand.last.qd.isZero(0.0) && !stand.status().moving) break;
    }
    return ticks;
  }

  void expect_smooth(const JointCommand& before, const JointCommand& after) {
    if (before.q.size() == 0) return;
    safety::Setpoint a, b;
    std::copy_n(before.q.data(), kJoints, a.q.begin());
    std::copy_n(before.qd.data(), kJoints, a.qd.begin());
    std::copy_n(after.q.data(), kJoints, b.q.begin());
    std::copy_n(after.qd.data(), kJoints, b.qd.begin());
    const auto violation = safety::check_command(stand.config.limits, a, b, to_seconds(after.due - before.due));
    EXPECT_FALSE(violation) << to_string(violation.kind) << " of joint " << violation.joint << ": " << violation.value << ", allowed "
                            << violation.limit;
  }

  /// The stroke is over because of `cause`; nothing moves again before a recovery and a new start, and then without a jump.
  void expect_stopped_for_good(Cause cause) {
    const auto* stopped = stand.find(Kind::kStopped);
    ASSERT_NE(stopped, nullptr);
    EXPECT_EQ(stopped->stroke_id, 1U);
    EXPECT_TRUE(stopped->causes.has(cause)) << to_string(stopped->causes.worst());
    stand.run(50);
    EXPECT_TRUE(stand.status().causes.has(cause));
    EXPECT_FALSE(stand.status().ready());

    const JointVector rest = stand.drives.state().q;
    auto again = make_trajectory(stand.status().setpoint.q, all(0.2), 2);
    stand.clear();
    stand.start(*again);
    stand.run(50);
    ASSERT_NE(stand.find(Kind::kNotStarted), nullptr);
    EXPECT_EQ(stand.find(Kind::kNotStarted)->refusal, LoopEvent::Refusal::kNotReady);
    EXPECT_TRUE(stand.drives.state().q.isApprox(rest, 1e-9)) << "nothing moves without a recovery";

    stand.clear();
    stand.request(LoopRequest::Kind::kRecover);
    stand.tick();
    ASSERT_NE(stand.find(Kind::kRecovered), nullptr);
    ASSERT_TRUE(stand.get_ready());
    stand.run(50);
    EXPECT_TRUE(stand.drives.state().q.isApprox(rest, 1e-9)) << "nothing moves without a fresh request";
    EXPECT_LT((stand.last.q - rest).cwiseAbs().maxCoeff(), stand.config.give_way_tolerance) << "the set-point starts where the arm is";

    again = make_trajectory(stand.status().setpoint.q, all(0.2), 3);
    stand.start(*again);
    EXPECT_TRUE(stand.run_until(Kind::kDone));
    EXPECT_EQ(stand.find(Kind::kStopped), nullptr);
  }

  Stand stand;
  std::unique_ptr<motion::Trajectory> trajectory;
};

TEST_F(LoopSafety, AStopThatIsAskedForStaysOnThePath) {
  stand.request(LoopRequest::Kind::kStop);
  for (int i = 0; i < 300; ++i) {
    const JointCommand before = stand.last;
    stand.tick();
    expect_smooth(before, stand.last);
    EXPECT_LT(distance_to_path(*trajectory, stand.last.q), 1e-6);
  }
  EXPECT_FALSE(stand.status().moving);
  EXPECT_TRUE(stand.status().at_rest);
  expect_stopped_for_good(Cause::kStopRequested);
}

TEST_F(LoopSafety, AStopWithNothingRunningHoldsAndWaits) {
  ASSERT_TRUE(stand.run_until(Kind::kDone));
  stand.request(LoopRequest::Kind::kStop);
  stand.run(10);
  EXPECT_EQ(stand.status().action, Action::kControlledStop);
  EXPECT_FALSE(stand.status().ready());
  stand.request(LoopRequest::Kind::kRecover);
  EXPECT_TRUE(stand.get_ready());
}

TEST_F(LoopSafety, NineteenLostStatesAreBridged) {
  for (int i = 0; i < 19; ++i) {
    stand.tick({.lose_state = true});
    EXPECT_EQ(stand.status().action, i < 4 ? Action::kRun : Action::kHold);
  }
  EXPECT_TRUE(stand.run_until(Kind::kDone));
  EXPECT_EQ(stand.find(Kind::kStopped), nullptr);
}

// From any tick of a stroke: without states it slows down along its path, smoothly, and once they are back it goes on to its end at its own speed.
TEST_F(LoopSafety, WithoutStatesItSlowsDownAlongThePathAndGoesOnWithThem) {
  for (int at = 1; at < 780; at += 13) {
    for (const int lost : {6, 12, 19}) {
      Stand fresh;
      ASSERT_TRUE(fresh.get_ready());
      const auto motion = make_trajectory(fresh.status().setpoint.q, all(1.2), 1);
      fresh.clear();
      fresh.start(*motion);
      fresh.run(at);
      const auto tick = [&](bool lose) {
        const JointCommand before = fresh.last;
        fresh.tick({.lose_state = lose});
        expect_smooth(before, fresh.last);
        EXPECT_LT(distance_to_path(*motion, fresh.last.q), 1e-6);
      };
      for (int i = 0; i < lost; ++i) tick(true);
      // The set-point of this very tick, had nothing been lost.
      const double planned = motion->points[std::min<std::size_t>(static_cast<std::size_t>(at + lost) - 1, motion->size - 1)].q[0];
      EXPECT_LE(fresh.last.q[0], planned + 1e-9) << "from tick " << at;
      int more = 0;
      while (fresh.find(Kind::kDone) == nullptr && more < 1000) {
        tick(false);
        ++more;
      }
      EXPECT_LT(at + lost + more, 800 + 60) << "from tick " << at << ", " << lost << " lost: it loses some ticks of time, no more";
      EXPECT_EQ(fresh.find(Kind::kStopped), nullptr);
      EXPECT_LT(std::abs(fresh.last.q[0] - motion->points[799].q[0]), 1e-9);
    }
  }
}

TEST_F(LoopSafety, ASlowedStrokeBrakesAndPicksUpItsSpeedAgain) {
  for (int i = 0; i < 19; ++i) stand.tick({.lose_state = true});
  const double slowed = stand.last.qd[0];
  EXPECT_LT(slowed, 0.99 * trajectory->points[319].qd[0]) << "it has begun to brake";
  stand.run(60);
  EXPECT_GT(stand.last.qd[0], slowed) << "and is on its way back to its speed";
}

// A stop from a slowed stroke, or from one that picks up its speed again, rests within 300 ms as any other does.
TEST_F(LoopSafety, EveryTickOfASlowedStrokeCanBeStoppedFromWithin300Milliseconds) {
  for (int at = 0; at < 780; at += 11) {
    for (const int back : {0, 3, 20}) {
      Stand fresh;
      ASSERT_TRUE(fresh.get_ready());
      const auto motion = make_trajectory(fresh.status().setpoint.q, all(1.2), 1);
      fresh.start(*motion);
      fresh.run(at + 1);
      for (int i = 0; i < 15; ++i) fresh.tick({.lose_state = true});
      fresh.run(back);
      fresh.request(LoopRequest::Kind::kStop);
      int ticks = 0;
      do {
        const JointCommand before = fresh.last;
        fresh.tick();
        expect_smooth(before, fresh.last);
        ++ticks;
      } while (fresh.status().moving && ticks < 1000);
      EXPECT_LE(ticks, 300) << "from tick " << at;
      EXPECT_LT(distance_to_path(*motion, fresh.last.q), 1e-6);
    }
  }
}

TEST_F(LoopSafety, TwentyLostStatesAreAControlledStopOnThePath) {
  JointCommand rest;
  for (int i = 0; i < 300; ++i) {
    const JointCommand before = stand.last;
    stand.tick({.lose_state = true});
    if (stand.last.q.size() == 0) continue;
    rest = stand.last;
    expect_smooth(before, stand.last);
    EXPECT_LT(distance_to_path(*trajectory, stand.last.q), 1e-6);
  }
  EXPECT_TRUE(rest.qd.isZero(0.0));
  EXPECT_EQ(stand.last.q.size(), 0) << "once at rest, it says no more to drives that say nothing";
  EXPECT_EQ(stand.status().action, Action::kControlledStop);
  EXPECT_FALSE(stand.status().moving);

  stand.request(LoopRequest::Kind::kRecover);
  stand.tick({.lose_state = true});
  EXPECT_NE(stand.find(Kind::kNotRecovered), nullptr) << "not without fresh states";
  stand.run(20);
  expect_stopped_for_good(Cause::kStateStale);
}

TEST_F(LoopSafety, StatesThatAreNoneCountAsLost) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::function<void(JointState&)>> spoilers{
      [&](JointState& s) { s.q[2] = nan; },
      [](JointState& s) { s.qd[0] = 100.0; },
      [](JointState& s) { s.q[5] = -4.0; },
      [](JointState& s) { s.seq -= 100; },
      [](JointState& s) { s.stamp -= milliseconds{50}; },
      [](JointState& s) { s.stamp += milliseconds{50}; },
  };
  for (const auto& spoil : spoilers) {
    Stand fresh;
    ASSERT_TRUE(fresh.get_ready());
    const auto motion = make_trajectory(fresh.status().setpoint.q, all(0.5), 1);
    fresh.start(*motion);
    fresh.run(300);
    for (int i = 0; i < 300; ++i) {
      JointState bad = fresh.drives.state();
      bad.seq += 1;
      bad.stamp += kTick;
      spoil(bad);
      fresh.tick({.instead = bad});
    }
    EXPECT_EQ(fresh.status().action, Action::kControlledStop);
    EXPECT_TRUE(fresh.status().causes.has(Cause::kStateStale));
    EXPECT_FALSE(fresh.status().moving);
  }
}

TEST_F(LoopSafety, TheSameStateAgainAndAgainCountsAsLost) {
  const JointState frozen = stand.drives.state();
  for (int i = 0; i < 300; ++i) stand.tick({.instead = frozen});
  EXPECT_EQ(stand.status().action, Action::kControlledStop);
  EXPECT_TRUE(stand.status().causes.has(Cause::kStateStale));
  EXPECT_GT(stand.status().states[static_cast<std::size_t>(safety::StateFlaw::kDuplicate)] +
                stand.status().states[static_cast<std::size_t>(safety::StateFlaw::kLate)],
            290U);
  stand.run(20);
  expect_stopped_for_good(Cause::kStateStale);
}

TEST_F(LoopSafety, AFreezeOfDrivesAndLoopForEighteenPeriodsIsNoReasonToStop) {
  stand.tick({.lose_state = true, .freeze = 18});
  EXPECT_EQ(stand.status().action, Action::kRun);
  EXPECT_TRUE(stand.run_until(Kind::kDone));
  EXPECT_EQ(stand.find(Kind::kStopped), nullptr);
}

TEST_F(LoopSafety, AfterALongerFreezeItSendsNothingUntilItKnowsWhereTheDrivesLeftTheArm) {
  stand.tick({.lose_state = true, .freeze = 24});
  EXPECT_EQ(stand.last.q.size(), 0) << "a command now would tear the arm to where it was to be";
  stand.tick({.lose_state = true});
  EXPECT_EQ(stand.last.q.size(), 0);
  EXPECT_TRUE(stand.drives.state().braked);
  stand.tick();
  ASSERT_EQ(stand.last.q.size(), kJoints);
  EXPECT_LT((stand.last.q - stand.drives.state().q).cwiseAbs().maxCoeff(), 0.01);
  ticks_to_rest();
  expect_stopped_for_good(Cause::kCommandGap);
}

TEST_F(LoopSafety, DrivesThatBrakedByThemselvesAreNotToldToCatchUp) {
  // The commands get lost on the way; the loop cannot know until the drives say so.
  for (int i = 0; i < 40 && stand.find(Kind::kStopped) == nullptr; ++i) stand.tick({.lose_command = true});
  EXPECT_LT((stand.last.q - stand.drives.state().q).cwiseAbs().maxCoeff(), 0.01);
  ticks_to_rest();
  stand.run(50);
  expect_stopped_for_good(Cause::kDrivesBraked);
}

TEST_F(LoopSafety, DrivesThatRestartAreTakenWhereTheyAre) {
  stand.restart_drives();
  for (int i = 1; i < 5; ++i) {
    stand.tick();
    EXPECT_EQ(stand.last.q.size(), 0) << "nothing is said to drives that are not known";
  }
  stand.tick();
  EXPECT_LT((stand.last.q - stand.drives.state().q).cwiseAbs().maxCoeff(), 1e-9);
  ticks_to_rest();
  expect_stopped_for_good(Cause::kDrivesRestarted);
}

TEST_F(LoopSafety, OneStateThatOnlyClaimsARestartChangesNothing) {
  JointState stranger = stand.drives.state();
  stranger.session = 99;
  stranger.q.setZero();
  stand.tick({.instead = stranger});
  EXPECT_EQ(stand.last.q.size(), 0);
  EXPECT_TRUE(stand.run_until(Kind::kDone));
  EXPECT_EQ(stand.find(Kind::kStopped), nullptr);
}

TEST_F(LoopSafety, AnArmThatIsNotWhereItShouldBeIsAProtectiveStop) {
  stand.drives.block(3);
  ASSERT_TRUE(stand.run_until(Kind::kSafety, 200));
  const LoopEvent event = *stand.find(Kind::kSafety);
  EXPECT_EQ(event.following.joint, 3);
  EXPECT_LT(event.following.error, -stand.config.following.floor);
  EXPECT_EQ(stand.status().action, Action::kProtectiveStop);
  for (int i = 0; i < 2000; ++i) {
    const JointCommand before = stand.last;
    stand.tick();
    expect_smooth(before, stand.last);
  }
  EXPECT_LT((stand.last.q - stand.drives.state().q).cwiseAbs().maxCoeff(), stand.config.give_way_tolerance) << "it does not press on";
  stand.drives.unblock();
  expect_stopped_for_good(Cause::kFollowingError);
}

TEST_F(LoopSafety, AnArmThatRunsAwayFromItsSetPointIsNotChased) {
  stand.drives.slip(2, 0.2);
  ASSERT_TRUE(stand.run_until(Kind::kSafety, 200));
  stand.run(3000);
  const JointVector rest = stand.drives.state().q;
  stand.request(LoopRequest::Kind::kRecover);
  stand.run(1000);
  EXPECT_EQ(stand.drives.state().q, rest);
  EXPECT_EQ(stand.status().action, Action::kProtectiveStop) << "and does not recover as long as the two do not agree";
}

TEST_F(LoopSafety, AnotherCommanderIsAControlledStop) {
  stand.request(LoopRequest::Kind::kForeignCommander);
  ticks_to_rest();
  EXPECT_EQ(stand.status().action, Action::kControlledStop);
  stand.request(LoopRequest::Kind::kRecover);
  stand.tick();
  EXPECT_NE(stand.find(Kind::kNotRecovered), nullptr) << "it was seen less than a second ago";
  stand.run(1000);
  expect_stopped_for_good(Cause::kForeignCommander);
}

TEST_F(LoopSafety, DrivesOfAnotherArmAreAFault) {
  JointState other = stand.drives.state();
  other.q = other.qd = other.tau = JointVector::Zero(7);
  for (int i = 0; i < 19; ++i) stand.tick({.instead = other});
  EXPECT_NE(stand.status().action, Action::kFault);
  stand.tick({.instead = other});
  EXPECT_EQ(stand.status().action, Action::kFault);
  stand.run(100);
  stand.request(LoopRequest::Kind::kRecover);
  stand.run(100);
  EXPECT_EQ(stand.status().action, Action::kFault) << "only a restart ends it";
  EXPECT_TRUE(stand.status().in_the_way.has(Cause::kWrongDrives));
}

// A point of the trajectory goes bad after the planner's checks, anywhere and in any way: the commands stay smooth.
TEST_F(LoopSafety, ABadPointBecomesAProtectiveStopAndNeverAJump) {
  std::mt19937 random{1};
  for (int round = 0; round < 200; ++round) {
    Stand fresh;
    ASSERT_TRUE(fresh.get_ready());
    auto bad = make_trajectory(fresh.status().setpoint.q, all(0.5), 4);
    const std::size_t at = 10 + random() % 700;
    const std::size_t j = random() % kJoints;
    const double kinds[] = {std::numeric_limits<double>::quiet_NaN(), 1e300, bad->points[at].q[j] + 0.01};
    bad->points[at].q[j] = kinds[random() % 3];
    fresh.clear();
    fresh.start(*bad);
    bool stopped = false;
    for (int i = 0; i < 1200; ++i) {
      const JointCommand before = fresh.last;
      fresh.tick();
      expect_smooth(before, fresh.last);
      ASSERT_TRUE(fresh.last.q.allFinite());
      stopped = stopped || fresh.find(Kind::kStopped) != nullptr;
    }
    EXPECT_TRUE(stopped);
    ASSERT_NE(fresh.find(Kind::kSafety), nullptr);
    EXPECT_EQ(fresh.find(Kind::kSafety)->violation.joint, static_cast<int>(j));
    EXPECT_TRUE(fresh.status().causes.has(Cause::kCommandLimit));
    EXPECT_TRUE(fresh.status().at_rest);
  }
}

TEST_F(LoopSafety, ASlowerClockIsTakenForAGap) {
  const JointState state = stand.drives.state();
  const auto command = stand.loop.tick(&state, stand.now() - std::chrono::seconds{5});
  EXPECT_EQ(command.q.size(), 0);
  EXPECT_TRUE(stand.status().causes.has(Cause::kCommandGap));
}

// From any tick of a stroke, a stop brings the set-point to rest within 300 ms (issue 3) and on the path.
TEST_F(LoopSafety, EveryTickCanBeStoppedFromWithin300Milliseconds) {
  for (int at = 0; at < 800; at += 7) {
    Stand fresh;
    ASSERT_TRUE(fresh.get_ready());
    const auto motion = make_trajectory(fresh.status().setpoint.q, all(1.2), 1);
    fresh.start(*motion);
    fresh.run(at + 1);
    fresh.request(LoopRequest::Kind::kStop);
    int ticks = 0;
    do {
      fresh.tick();
      ++ticks;
    } while (fresh.status().moving && ticks < 1000);
    EXPECT_LE(ticks, 300) << "from tick " << at;
    EXPECT_LT(distance_to_path(*motion, fresh.last.q), 1e-6);
  }
}

}  // namespace
}  // namespace breakshot::control::test
