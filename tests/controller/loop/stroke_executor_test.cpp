#include "tests/controller/loop/executor_stand.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace breakshot::control::test {
namespace {

TEST_F(Executor, RunsAHitAndTellsEveryPhase) {
  submit(hit(1));
  const auto done = finish(1);
  ASSERT_EQ(done.phase, StrokePhase::kDone) << done.text;
  EXPECT_NEAR(done.contact_speed, 0.4, 0.004) << "ideal drives: the speed that was asked for, within 1 %";
  EXPECT_GT(done.planned_total, done.planned_contact);
  EXPECT_GT(done.planned_contact, Duration::zero());

  std::vector<StrokePhase> phases;
  for (const auto& status : history) {
    EXPECT_EQ(status.id, 1U);
    if (phases.empty() || phases.back() != status.phase) phases.push_back(status.phase);
  }
  using enum StrokePhase;
  EXPECT_EQ(phases, (std::vector{kAccepted, kTransit, kRunIn, kFollowThrough, kRetreat, kParking, kDone}));
  EXPECT_LT((stand.drives.state().q - park_pose()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_F(Executor, RunsStrokesOneAfterTheOther) {
  for (std::uint64_t id = 1; id <= 6; ++id) {
    StrokeRequest request = id % 2 == 0 ? push(id) : hit(id);
    request.park_after = id == 6;
    submit(request);
    const auto done = finish(id);
    EXPECT_EQ(done.phase, StrokePhase::kDone) << done.text;
  }
  EXPECT_EQ(stand.channels.events.dropped(), 0U);
  EXPECT_EQ(stand.channels.returns.dropped(), 0U);
}

TEST_F(Executor, RefusesWithThePlannersReasonAndStaysReady) {
  StrokeRequest fast = hit(1);
  fast.speed = 1.9;
  fast.p_WS = {0.25, 0.25};
  submit(fast);
  const auto refused = finish(1);
  EXPECT_EQ(refused.phase, StrokePhase::kRefused);
  EXPECT_NE(refused.reason, RefusalReason::kNone);
  EXPECT_FALSE(refused.text.empty());
  StrokeRequest nan = hit(2);
  nan.speed = std::nan("");
  submit(nan);
  EXPECT_EQ(finish(2).reason, RefusalReason::kBadRequest);
  submit(hit(3));
  EXPECT_EQ(finish(3).phase, StrokePhase::kDone);
}

TEST_F(Executor, TheSameRequestAgainIsTheSameStroke) {
  submit(hit(1));
  submit(hit(1));
  run_until_phase(StrokePhase::kRunIn);
  submit(hit(1));
  EXPECT_EQ(finish(1).phase, StrokePhase::kDone);
  EXPECT_EQ(finals(1), 1U);
  submit(hit(1));
  tick();
  EXPECT_EQ(finals(1), 2U) << "its final status once more";
  EXPECT_FALSE(stand.status().moving);
  // A planner that restarted counts from 1 again: another request under the same id is another stroke.
  history.clear();
  submit(push(1));
  EXPECT_EQ(finish(1).phase, StrokePhase::kDone);
  EXPECT_GT(history.size(), 3U);
}

TEST_F(Executor, CancelStopsTheStrokeAndOnlyAParkRequestGoesOn) {
  submit(hit(1));
  run_until_phase(StrokePhase::kTransit);
  for (int i = 0; i < 100; ++i) tick();
  executor.cancel("test", stand.now());
  const auto stopped = finish(1);
  EXPECT_EQ(stopped.phase, StrokePhase::kStopped);
  EXPECT_NE(stopped.text.find("a stop was asked for"), std::string::npos) << stopped.text;
  submit(hit(2));
  EXPECT_EQ(finish(2).reason, RefusalReason::kStopped);
  submit(park(3));
  EXPECT_EQ(finish(3).phase, StrokePhase::kDone);
  submit(hit(4));
  EXPECT_EQ(finish(4).phase, StrokePhase::kDone);
}

TEST_F(Executor, AParkRequestStopsTheStrokeUnderWayAndParks) {
  submit(hit(1));
  run_until_phase(StrokePhase::kTransit);
  submit(park(2));
  EXPECT_EQ(finish(2).phase, StrokePhase::kDone);
  EXPECT_EQ(finish(1).phase, StrokePhase::kStopped);
  EXPECT_LT((stand.drives.state().q - park_pose()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_F(Executor, LostStatesStopItUntilARecovery) {
  submit(hit(1));
  run_until_phase(StrokePhase::kTransit);
  for (int i = 0; i < 600; ++i) tick({.lose_state = true});
  const auto stopped = finish(1);
  EXPECT_EQ(stopped.phase, StrokePhase::kStopped);
  EXPECT_NE(stopped.text.find("no fresh joint state"), std::string::npos) << stopped.text;

  submit(hit(2));
  tick({.lose_state = true});
  const auto refused = finish(2, 1);
  EXPECT_EQ(refused.reason, RefusalReason::kStopped);
  EXPECT_NE(refused.text.find("no fresh joint state"), std::string::npos) << refused.text;

  submit(recover(3));
  tick({.lose_state = true});
  const auto still = finish(3, 1);
  EXPECT_EQ(still.phase, StrokePhase::kRefused);
  EXPECT_EQ(still.reason, RefusalReason::kNotReady);
  EXPECT_NE(still.text.find("in the way: no fresh joint state"), std::string::npos) << still.text;

  for (int i = 0; i < 500; ++i) tick();
  expect_stopped(10, "no fresh joint state");
  expect_goes_on(20, "no fresh joint state");
}

TEST_F(Executor, ARecoverySaysWhatStandsInTheWay) {
  executor.report_foreign_commander();
  for (int i = 0; i < 100; ++i) tick();
  submit(recover(1));
  for (int i = 0; i < 2500 && finals(1) == 0; ++i) {
    executor.report_foreign_commander();  // it goes on sending
    tick();
  }
  const auto refused = finish(1);
  EXPECT_EQ(refused.phase, StrokePhase::kRefused);
  EXPECT_NE(refused.text.find("in the way: another controller"), std::string::npos) << refused.text;
  expect_stopped(10, "another controller");
  for (int i = 0; i < 1100; ++i) tick();
  expect_goes_on(20, "another controller");
}

TEST_F(Executor, ARecoveryWithNothingStoppedIsDoneAndDoesNothing) {
  submit(recover(1));
  const auto done = finish(1);
  EXPECT_EQ(done.phase, StrokePhase::kDone);
  EXPECT_EQ(done.text, "nothing was stopped");
  submit(hit(2));
  run_until_phase(StrokePhase::kTransit);
  submit(recover(3));
  EXPECT_EQ(finish(3).reason, RefusalReason::kBusy);
  EXPECT_EQ(finish(2).phase, StrokePhase::kDone);
}

TEST_F(Executor, DrivesThatRestartTwiceNeedOneRecovery) {
  submit(hit(1));
  run_until_phase(StrokePhase::kTransit);
  for (int restart = 0; restart < 2; ++restart) {
    stand.restart_drives();
    for (int i = 0; i < 600; ++i) tick();
    EXPECT_LT((stand.last.q - stand.drives.state().q).cwiseAbs().maxCoeff(), 1e-9);
  }
  EXPECT_EQ(finish(1).phase, StrokePhase::kStopped);
  expect_stopped(10, "the drives restarted");
  expect_goes_on(20, "the drives restarted");
}

// A machine that starts five programs at once may hold the loop up before it has ever been ready: that is not for an operator to end.
TEST_F(Executor, WhatStopsTheLoopBeforeItWasEverReadyEndsByItself) {
  Stand fresh{ur5e_config()};
  fresh.drives.place(park_pose());
  StrokeExecutor starting{planner, fresh.channels};
  ASSERT_TRUE(fresh.get_ready());  // but nobody has seen it
  fresh.tick({.lose_state = true, .freeze = 60});
  fresh.run(5);
  ASSERT_TRUE(fresh.status().stopped());
  for (int i = 0; i < 500 && !fresh.status().ready(); ++i) {
    fresh.tick();
    starting.poll(fresh.now());
  }
  EXPECT_TRUE(fresh.status().ready());
  starting.poll(fresh.now());
  fresh.tick({.lose_state = true, .freeze = 60});
  for (int i = 0; i < 1000; ++i) {
    fresh.tick();
    starting.poll(fresh.now());
  }
  EXPECT_TRUE(fresh.status().stopped()) << "from then on it is";
}

TEST_F(Executor, StatesThatAreLateAtTheHandOverOnlyDelayTheStroke) {
  for (int i = 0; i < 4; ++i) tick({.lose_state = true});
  submit(hit(1));
  executor.poll(stand.now());  // plans and hands over; with the next tick the states are too late to start
  for (int i = 0; i < 10; ++i) tick({.lose_state = true});
  EXPECT_FALSE(stand.status().moving);
  EXPECT_EQ(finish(1).phase, StrokePhase::kDone);
  EXPECT_EQ(finals(1), 1U);
}

TEST_F(Executor, AfterCloseItStopsAndRefuses) {
  submit(hit(1));
  run_until_phase(StrokePhase::kTransit);
  executor.close("the controller ends", stand.now());
  EXPECT_EQ(finish(1).phase, StrokePhase::kStopped);
  submit(hit(2));
  const auto refused = finish(2);
  EXPECT_EQ(refused.reason, RefusalReason::kNotReady);
  EXPECT_EQ(refused.text, "the controller ends");
}

TEST_F(Executor, AFollowingErrorIsToldWithItsFigures) {
  submit(hit(1));
  run_until_phase(StrokePhase::kTransit);
  for (int i = 0; i < 100; ++i) tick();
  stand.drives.block(0);
  const auto stopped = finish(1);
  EXPECT_EQ(stopped.phase, StrokePhase::kStopped);
  EXPECT_NE(stopped.text.find("joint 1 is off by"), std::string::npos) << stopped.text;
  stand.drives.unblock();
  for (int i = 0; i < 500; ++i) tick();
  expect_stopped(10, "the arm is not where it was told to be");
  expect_goes_on(20, "the arm is not where it was told to be");
}

}  // namespace
}  // namespace breakshot::control::test
