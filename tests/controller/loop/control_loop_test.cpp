#include "tests/controller/loop/harness.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace breakshot::control::test {
namespace {

using Kind = LoopEvent::Kind;
using std::chrono::milliseconds;

TEST(ControlLoop, SendsNothingBeforeItKnowsWhereTheArmIs) {
  Stand stand;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(stand.tick({.lose_state = true}).q.size(), 0);
  EXPECT_FALSE(stand.status().ready());
  EXPECT_EQ(stand.status().action, safety::Action::kHold);
  // The session has to confirm itself, and the states have to stay fresh.
  int silent = 0;
  while (stand.tick().q.size() == 0) ASSERT_LE(++silent, 20);
  EXPECT_EQ(silent, stand.config.confirm_session + stand.config.freshness.recover_samples - 2);
}

TEST(ControlLoop, InLockstepAnswersEveryState) {
  Stand stand{lockstep(test_config())};
  EXPECT_EQ(stand.tick().q, stand.drives.state().q) << "the very first one, too";
  for (int i = 0; i < 100; ++i) {
    const bool spoilt = i > 30;
    JointState state = stand.drives.state();
    if (spoilt) state.q[1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(stand.tick({.instead = state}).q.size(), kJoints) << "a world that waits for us must not wait for ever";
  }
  EXPECT_EQ(stand.status().action, safety::Action::kControlledStop);
  stand.restart_drives();
  EXPECT_EQ(stand.tick().q.size(), kJoints);
}

TEST(ControlLoop, HoldsWhereItFoundTheArm) {
  Stand stand;
  const JointVector q = stand.drives.state().q;
  ASSERT_TRUE(stand.get_ready());
  for (int i = 0; i < 1000; ++i) {
    const auto command = stand.tick();
    EXPECT_EQ(command.q, q);
    EXPECT_EQ(command.qd, JointVector::Zero(kJoints));
    EXPECT_EQ(command.due, stand.now() + stand.config.lead);
    EXPECT_EQ(command.session, stand.config.session);
    EXPECT_EQ(command.state_seq, stand.drives.state().seq);
  }
  EXPECT_TRUE(stand.status().at_rest);
  EXPECT_FALSE(stand.drives.state().braked);
}

TEST(ControlLoop, NumbersItsCommandsOneByOne) {
  Stand stand;
  ASSERT_TRUE(stand.get_ready());
  std::uint64_t seq = stand.last.seq;
  for (int i = 0; i < 50; ++i) EXPECT_EQ(stand.tick().seq, ++seq);
}

TEST(ControlLoop, RunsATrajectoryPointByPointAndTellsOfIt) {
  Stand stand;
  ASSERT_TRUE(stand.get_ready());
  const auto trajectory = make_trajectory(stand.status().setpoint.q, all(0.3), 5);
  stand.clear();
  stand.start(*trajectory);
  for (std::size_t k = 0; k < trajectory->size; ++k) {
    const auto command = stand.tick();
    for (int j = 0; j < kJoints; ++j) {
      const auto i = static_cast<std::size_t>(j);
      ASSERT_EQ(command.q[j], trajectory->points[k].q[i]);
      ASSERT_EQ(command.qd[j], trajectory->points[k].qd[i]);
      ASSERT_EQ(command.qdd[j], trajectory->points[k].qdd[i]);
    }
    EXPECT_EQ(stand.status().stroke_id, 5U);
    EXPECT_FALSE(stand.status().ready());
  }
  ASSERT_TRUE(stand.run_until(Kind::kDone, 20));

  std::vector<StrokePhase> phases;
  for (const auto& event : stand.events()) {
    EXPECT_EQ(event.stroke_id, 5U);
    if (event.kind == Kind::kPhase) phases.push_back(event.phase);
  }
  using enum StrokePhase;
  EXPECT_EQ(phases, (std::vector{kTransit, kRunIn, kFollowThrough, kRetreat, kParking}));

  const motion::Trajectory* returned = nullptr;
  ASSERT_TRUE(stand.channels.returns.pop(returned));
  EXPECT_EQ(returned, trajectory.get());
  EXPECT_TRUE(stand.status().ready());
  EXPECT_EQ(stand.status().stroke_id, 0U);
}

TEST(ControlLoop, MeasuresTheArmWhereItPassesTheContact) {
  Stand stand;
  ASSERT_TRUE(stand.get_ready());
  const auto trajectory = make_trajectory(stand.status().setpoint.q, all(0.4), 1);
  stand.start(*trajectory);
  ASSERT_TRUE(stand.run_until(Kind::kContact));
  const LoopEvent contact = *stand.find(Kind::kContact);
  const auto& point = trajectory->points[trajectory->contact_tick];
  for (std::size_t j = 0; j < kJoints; ++j) {
    EXPECT_NEAR(contact.q[j], point.q[j], 1e-9);
    EXPECT_NEAR(contact.qd[j], point.qd[j], 1e-9);
  }
}

TEST(ControlLoop, TimeAndNotTheCountOfTicksMovesATrajectory) {
  Stand stand;
  ASSERT_TRUE(stand.get_ready());
  const auto trajectory = make_trajectory(stand.status().setpoint.q, all(0.3), 1);
  stand.start(*trajectory);
  std::mt19937 random{1};
  stand.tick();
  for (std::size_t k = 0; k + 20 < trajectory->size;) {
    const int skip = random() % 10 == 0 ? static_cast<int>(random() % 18) : 0;
    k += 1 + static_cast<std::size_t>(skip);
    const auto command = stand.tick({.skip = skip});
    EXPECT_EQ(command.q[2], trajectory->points[k].q[2]);
  }
  EXPECT_EQ(stand.status().action, safety::Action::kRun) << "a frozen host is no reason to stop";
  EXPECT_TRUE(stand.run_until(Kind::kDone));
  EXPECT_EQ(stand.find(Kind::kStopped), nullptr);
}

TEST(ControlLoop, RepeatsItsCommandWhenTimeStandsStill) {
  Stand stand;
  ASSERT_TRUE(stand.get_ready());
  const auto trajectory = make_trajectory(stand.status().setpoint.q, all(0.3), 1);
  stand.start(*trajectory);
  stand.run(100);
  const auto again = stand.loop.tick(nullptr, stand.now());
  EXPECT_EQ(again.seq, stand.last.seq);
  EXPECT_EQ(again.q, stand.last.q);
}

TEST(ControlLoop, TakesOneTrajectoryAtATime) {
  Stand stand;
  ASSERT_TRUE(stand.get_ready());
  const auto first = make_trajectory(stand.status().setpoint.q, all(0.3), 1);
  const auto second = make_trajectory(stand.status().setpoint.q, all(0.3), 2);
  const auto third = make_trajectory(stand.status().setpoint.q, all(0.3), 3);
  stand.start(*first);
  stand.start(*second);  // in the same tick
  stand.tick();
  stand.start(*third);  // while the first runs
  stand.tick();
  int refused = 0;
  for (const auto& event : stand.events()) {
    if (event.kind != Kind::kNotStarted) continue;
    ++refused;
    EXPECT_EQ(event.refusal, LoopEvent::Refusal::kBusy);
    EXPECT_NE(event.stroke_id, 1U);
  }
  EXPECT_EQ(refused, 2);
  ASSERT_TRUE(stand.run_until(Kind::kDone));
  EXPECT_EQ(stand.find(Kind::kDone)->stroke_id, 1U);
}

TEST(ControlLoop, RefusesATrajectoryThatDoesNotFit) {
  Stand stand;
  ASSERT_TRUE(stand.get_ready());
  const auto at = stand.status().setpoint.q;
  const auto refusal_of = [&](const motion::Trajectory& trajectory) {
    stand.clear();
    const JointVector before = stand.last.q;
    stand.start(trajectory);
    EXPECT_EQ(stand.tick().q, before);
    const auto* event = stand.find(Kind::kNotStarted);
    const motion::Trajectory* returned = nullptr;
    EXPECT_TRUE(stand.channels.returns.pop(returned));
    EXPECT_EQ(returned, &trajectory);
    return event == nullptr ? LoopEvent::Refusal::kNone : event->refusal;
  };
  using Refusal = LoopEvent::Refusal;
  auto trajectory = make_trajectory(at, all(0.3), 9);
  trajectory->size = 0;
  EXPECT_EQ(refusal_of(*trajectory), Refusal::kBadBuffer);
  trajectory->size = motion::Trajectory::kCapacity + 1;
  EXPECT_EQ(refusal_of(*trajectory), Refusal::kBadBuffer);
  trajectory->size = 800;
  trajectory->joints = 7;
  EXPECT_EQ(refusal_of(*trajectory), Refusal::kBadBuffer);
  trajectory->joints = kJoints;
  trajectory->tick = milliseconds{2};
  EXPECT_EQ(refusal_of(*trajectory), Refusal::kBadBuffer);
  trajectory->tick = kTick;
  trajectory->points[0].q[3] += 1e-3;
  EXPECT_EQ(refusal_of(*trajectory), Refusal::kElsewhere);
  trajectory->points[0].q[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal_of(*trajectory), Refusal::kElsewhere);
  EXPECT_TRUE(stand.status().ready()) << "a refusal changes nothing";
}

TEST(ControlLoop, ATrajectoryTakesOverWhereItIsToldAndNowhereElse) {
  Stand stand;
  ASSERT_TRUE(stand.get_ready());
  const auto first = make_trajectory(stand.status().setpoint.q, all(0.3), 1);
  const auto second = make_joined(*first, 500, all(-0.2), 2);
  const auto refusal_of = [&](const motion::Trajectory& trajectory, LoopRequest::Join at) {
    stand.clear();
    stand.join(trajectory, at);
    stand.tick();
    const auto* event = stand.find(Kind::kNotStarted);
    return event == nullptr ? LoopEvent::Refusal::kNone : event->refusal;
  };
  using Refusal = LoopEvent::Refusal;
  EXPECT_EQ(refusal_of(*second, {1, 500}), Refusal::kMissed) << "nothing runs";
  stand.start(*first);
  stand.tick();
  const std::uint64_t number = stand.started;
  EXPECT_EQ(stand.status().joinable, number);
  EXPECT_EQ(refusal_of(*second, {number + 1, 500}), Refusal::kMissed) << "another one runs";
  EXPECT_EQ(refusal_of(*second, {number, 800}), Refusal::kMissed) << "past its end";
  EXPECT_EQ(refusal_of(*second, {number, std::numeric_limits<std::uint64_t>::max()}), Refusal::kMissed);
  EXPECT_EQ(refusal_of(*second, {number, 501}), Refusal::kElsewhere);
  EXPECT_EQ(refusal_of(*second, {number, static_cast<std::uint64_t>(stand.status().cursor - 1)}), Refusal::kMissed) << "it is past that";
  auto other = make_joined(*first, 500, all(0.1), 3);
  other->points[0].qd[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal_of(*other, {number, 500}), Refusal::kElsewhere);
  other->joints = 5;
  EXPECT_EQ(refusal_of(*other, {number, 500}), Refusal::kBadBuffer);
  other = make_joined(*first, 500, all(0.1), 3);
  EXPECT_EQ(refusal_of(*second, {number, 500}), Refusal::kNone);
  EXPECT_EQ(refusal_of(*other, {number, 500}), Refusal::kBusy) << "one waits already";
  const motion::Trajectory* returned = nullptr;
  while (stand.channels.returns.pop(returned)) EXPECT_NE(returned, first.get());

  stand.clear();
  while (stand.status().cursor < 499) stand.tick();
  EXPECT_EQ(stand.find(Kind::kDone), nullptr);
  stand.tick();
  ASSERT_NE(stand.find(Kind::kDone), nullptr);
  EXPECT_TRUE(stand.find(Kind::kDone)->joined);
  EXPECT_EQ(stand.find(Kind::kDone)->stroke_id, 1U);
  EXPECT_EQ(stand.status().stroke_id, 2U);
  EXPECT_EQ(stand.status().cursor, 0);
  ASSERT_TRUE(stand.channels.returns.pop(returned));
  EXPECT_EQ(returned, first.get());
  stand.clear();
  ASSERT_TRUE(stand.run_until(Kind::kDone));
  EXPECT_FALSE(stand.find(Kind::kDone)->joined);
  ASSERT_NE(stand.find(Kind::kContact), nullptr);
  EXPECT_EQ(stand.find(Kind::kContact)->stroke_id, 2U);
}

}  // namespace
}  // namespace breakshot::control::test
