#include "planner/task/task_runner.hpp"

#include "tests/planner/task/task_cell.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace breakshot::task {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::TaskCell;
using Verb = TaskRequest::Verb;

TEST(TaskRunner, SingulatesAndReportsEveryStroke) {
  TaskCell cell{test::formation("E"), "paper"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_to_end());
  const TaskStatus& status = cell.runner.status();
  ASSERT_EQ(status.phase, TaskPhase::kSingulated) << status.text;
  EXPECT_EQ(status.request_seq, 1U);
  EXPECT_EQ(status.discs_seen, 6U);
  EXPECT_EQ(status.discs_singulated, 6U);
  EXPECT_GE(status.smallest_gap, 0.015);
  EXPECT_GE(status.hits, 1U);  // how many it takes is for the strategies' own tests
  EXPECT_EQ(cell.plans.size(), status.hits + status.pushes);
  ASSERT_EQ(cell.outcomes.size(), cell.plans.size());
  for (std::size_t k = 0; k < cell.plans.size(); ++k) {
    EXPECT_EQ(cell.outcomes[k].plan_seq, cell.plans[k].seq);
    EXPECT_EQ(cell.outcomes[k].stroke_id, cell.plans[k].stroke.id);
    EXPECT_EQ(cell.outcomes[k].stroke_phase, StrokePhase::kDone);
    EXPECT_FALSE(cell.plans[k].why.empty());
    EXPECT_EQ(cell.plans[k].predicted_p_WD.size(), 6U);
  }
  EXPECT_EQ(cell.outcomes.back().achieved_gap, status.smallest_gap);

  // Phase times add up to the whole, and each stroke's to its part.
  EXPECT_EQ(status.times.total(), status.ended - status.started);
  PhaseTimes sum;
  for (const auto& outcome : cell.outcomes) {
    sum.look += outcome.times.look;
    sum.move += outcome.times.move;
    sum.settle += outcome.times.settle;
  }
  EXPECT_GT(sum.move, milliseconds{400} * static_cast<int>(cell.outcomes.size()));
  EXPECT_EQ(sum.move, status.times.move);
  EXPECT_EQ(sum.settle, status.times.settle);
}

TEST(TaskRunner, ActsOnlyOnScenesExposedAfterTheArmWasAway) {
  TaskCell cell{test::formation("C"), "paper"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
  // 66 ms of latency and two scenes 30 ms apart lie between the end of a stroke and the next decision.
  for (const auto& outcome : cell.outcomes) EXPECT_GE(outcome.times.look + outcome.times.settle, milliseconds{90});
}

TEST(TaskRunner, EveryFormationComesToAnEndUnderEveryStrategy) {
  for (const char* strategy : {"paper", "random_hybrid", "random_push"}) {
    for (const char* name : {"A", "B", "C", "D", "E", "F", "fig11", "fig12", "fig13"}) {
      TaskCell cell{test::formation(name), strategy};
      cell.runner.on_request(TaskCell::order(), cell.now);
      ASSERT_TRUE(cell.play_to_end()) << strategy << " " << name;
      EXPECT_EQ(cell.outcomes.size(), cell.plans.size());
      std::set<std::uint64_t> ids;
      for (const auto& stroke : cell.run) EXPECT_TRUE(ids.insert(stroke.id).second) << "an id was used twice";
    }
  }
}

TEST(TaskRunner, SendsAgainWhatGotLostUnderTheSameId) {
  TaskCell cell{test::formation("A"), "paper"};
  cell.deaf_to = 2;
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
  ASSERT_GE(cell.received.size(), 3U);
  EXPECT_EQ(cell.received[0].id, cell.received[2].id);
}

TEST(TaskRunner, GivesUpOnADeadControllerInEveryPhase) {
  for (const int after_ms : {0, 300, 600, 1200, 1700}) {
    TaskCell cell{test::formation("C"), "paper"};
    cell.runner.on_request(TaskCell::order(), cell.now);
    cell.play_for(milliseconds{after_ms});
    cell.controller_dead = true;
    ASSERT_TRUE(cell.play_to_end(seconds{10})) << after_ms;
    EXPECT_EQ(cell.runner.status().failure, TaskFailure::kControllerFault) << after_ms << ": " << cell.runner.status().text;
  }
}

TEST(TaskRunner, TriesTheNextOptionWhenTheControllerRefuses) {
  TaskCell cell{test::formation("A"), "paper"};
  StrokeStatus refusal;
  refusal.reason = RefusalReason::kUnreachable;
  refusal.text = "wrist beyond reach";
  cell.refusals = {refusal};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
  ASSERT_EQ(cell.outcomes.size(), 2U);
  EXPECT_EQ(cell.outcomes[0].reason, RefusalReason::kUnreachable);
  EXPECT_EQ(cell.runner.status().pushes, 1U);  // a refused stroke is no stroke
  EXPECT_LT(cell.plans[1].stroke.direction_W.x(), 0.0);

  cell.refusals.assign(100, refusal);
  TaskCell none{test::formation("A"), "paper"};
  none.refusals.assign(100, refusal);
  none.runner.on_request(TaskCell::order(), none.now);
  ASSERT_TRUE(none.play_to_end());
  EXPECT_EQ(none.runner.status().failure, TaskFailure::kNoFeasibleStroke);
  EXPECT_NE(none.runner.status().text.find("wrist beyond reach"), std::string::npos) << none.runner.status().text;
}

TEST(TaskRunner, HitsSlowerWhereTheArmIsSlower) {
  TaskCell cell{test::formation("E"), "paper"};
  StrokeStatus refusal;
  refusal.reason = RefusalReason::kTooFast;
  refusal.attainable = 0.5;
  cell.refusals = {refusal};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_to_end());
  ASSERT_GE(cell.plans.size(), 2U);
  EXPECT_EQ(cell.plans[1].stroke.kind, StrokeKind::kHit);
  EXPECT_EQ(cell.plans[1].stroke.p_WS, cell.plans[0].stroke.p_WS);
  EXPECT_LE(cell.plans[1].stroke.speed, 0.49);
}

TEST(TaskRunner, WaitsForAControllerThatIsBusyOrNotReady) {
  for (const RefusalReason reason : {RefusalReason::kBusy, RefusalReason::kNotReady}) {
    StrokeStatus refusal;
    refusal.reason = reason;
    TaskCell cell{test::formation("A"), "paper"};
    cell.refusals.assign(5, refusal);
    cell.runner.on_request(TaskCell::order(), cell.now);
    ASSERT_TRUE(cell.play_to_end());
    EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
    EXPECT_EQ(cell.runner.status().pushes, 1U);

    TaskCell never{test::formation("A"), "paper"};
    never.refusals.assign(1000, refusal);
    never.runner.on_request(TaskCell::order(), never.now);
    ASSERT_TRUE(never.play_to_end(seconds{10}));
    EXPECT_EQ(never.runner.status().failure, TaskFailure::kControllerFault) << never.runner.status().text;
  }
}

TEST(TaskRunner, AStoppedStrokeEndsTheOrderAndNothingMovesBeforeARecoveryAndAFreshOrder) {
  TaskCell cell{test::formation("C"), "paper"};
  cell.stops = 1;
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().failure, TaskFailure::kControllerFault);
  EXPECT_NE(cell.runner.status().text.find("following error"), std::string::npos) << cell.runner.status().text;
  EXPECT_EQ(cell.outcomes.back().stroke_phase, StrokePhase::kStopped);
  EXPECT_EQ(cell.outcomes.size(), cell.plans.size());
  const auto received = cell.received.size();

  auto next = TaskCell::order(2);
  next.order_id[0] = 43;
  cell.runner.on_request(next, cell.now);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().failure, TaskFailure::kControllerFault) << "a fresh order alone does not do";
  EXPECT_EQ(cell.received.size(), received + 1) << "asked once, not until somebody recovers";

  cell.send(Verb::kRecover, 3);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kRecovered);
  EXPECT_EQ(cell.runner.status().request_seq, 3U);
  EXPECT_EQ(cell.runner.status().text, "ended: following error");
  const auto run = cell.run.size();
  cell.play_for(seconds{5});
  EXPECT_EQ(cell.run.size(), run) << "a recovery alone does not do";

  auto third = TaskCell::order(4);
  third.order_id[0] = 44;
  cell.runner.on_request(third, cell.now);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated) << cell.runner.status().text;
}

TEST(TaskRunner, TellsWhyTheControllerDoesNotRecover) {
  TaskCell cell{test::formation("C"), "paper"};
  cell.stopped = cell.unrecoverable = true;
  cell.send(Verb::kRecover, 1);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kFailed);
  EXPECT_EQ(cell.runner.status().text, "following error");

  TaskCell dead{test::formation("C"), "paper"};
  dead.controller_dead = true;
  dead.send(Verb::kRecover, 1);
  ASSERT_TRUE(dead.play_to_end(seconds{10}));
  EXPECT_EQ(dead.runner.status().phase, TaskPhase::kFailed);
}

TEST(TaskRunner, DoesNotRecoverWhileAnOrderRuns) {
  TaskCell cell{test::formation("A"), "paper"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_until(TaskPhase::kMoving));
  cell.send(Verb::kRecover, 2);
  EXPECT_EQ(cell.runner.status().request_seq, 2U);
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kMoving);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
}

TEST(TaskRunner, CancelsInEveryPhaseWithTheArmParked) {
  for (int after_ms = 10; after_ms < 4000; after_ms += 130) {
    TaskCell cell{test::formation("E"), "paper"};
    cell.runner.on_request(TaskCell::order(), cell.now);
    cell.play_for(milliseconds{after_ms});
    if (is_final(cell.runner.status().phase)) break;
    cell.send(Verb::kCancel, 2);
    EXPECT_EQ(cell.runner.status().request_seq, 2U);
    const auto plans = cell.plans.size();
    ASSERT_TRUE(cell.play_to_end(seconds{5})) << after_ms;
    EXPECT_EQ(cell.runner.status().phase, TaskPhase::kCancelled) << after_ms;
    EXPECT_EQ(cell.plans.size(), plans) << "a new stroke after the cancel at " << after_ms << " ms";
    ASSERT_FALSE(cell.run.empty());
    EXPECT_TRUE(cell.run.back().kind == StrokeKind::kPark || cell.run.back().park_after);
  }
}

TEST(TaskRunner, PausesBetweenStrokesAndGoesOn) {
  TaskCell cell{test::formation("E"), "paper"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_until(TaskPhase::kMoving));
  cell.send(Verb::kPause, 2);
  ASSERT_TRUE(cell.play_until(TaskPhase::kPaused));
  const auto strokes = cell.run.size();
  cell.play_for(seconds{300});  // longer than the timeout
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kPaused);
  EXPECT_EQ(cell.run.size(), strokes);
  cell.send(Verb::kResume, 3);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
  EXPECT_LT(cell.runner.status().times.total(), seconds{100});
  EXPECT_EQ(cell.outcomes.size(), cell.plans.size());
}

TEST(TaskRunner, CancelsWhilePaused) {
  TaskCell cell{test::formation("A"), "paper"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_until(TaskPhase::kLooking));
  cell.play_for(milliseconds{200});
  cell.send(Verb::kPause, 2);
  ASSERT_TRUE(cell.play_until(TaskPhase::kPaused));
  cell.send(Verb::kCancel, 3);
  ASSERT_TRUE(cell.play_to_end(seconds{2}));
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kCancelled);
}

TEST(TaskRunner, HoldsWhileSomethingForeignIsOnTheTable) {
  const ForeignObject tool{ForeignObject::Kind::kHeight, {0.05, -0.10}, 0.060, 0.015};
  TaskCell stays{test::formation("C"), "paper"};
  stays.foreign = {tool};
  stays.runner.on_request(TaskCell::order(), stays.now);
  stays.play_for(seconds{2});
  EXPECT_TRUE(stays.runner.running());
  EXPECT_NE(stays.runner.status().text.find("held: something that stands up from the table at (0.050, -0.100) m"), std::string::npos)
      << stays.runner.status().text;
  ASSERT_TRUE(stays.play_to_end(seconds{10}));
  EXPECT_EQ(stays.runner.status().failure, TaskFailure::kForeignObject);
  EXPECT_NE(stays.runner.status().text.find("15 mm high"), std::string::npos) << stays.runner.status().text;
  EXPECT_EQ(stays.runner.status().hits + stays.runner.status().pushes, 0U);

  // Taken away in time: the task goes on.
  TaskCell goes{test::formation("C"), "paper"};
  goes.foreign = {tool};
  goes.runner.on_request(TaskCell::order(), goes.now);
  goes.play_for(seconds{2});
  EXPECT_EQ(goes.runner.status().hits + goes.runner.status().pushes, 0U);
  goes.foreign.clear();
  ASSERT_TRUE(goes.play_to_end(seconds{60}));
  EXPECT_EQ(goes.runner.status().phase, TaskPhase::kSingulated) << goes.runner.status().text;
}

TEST(TaskRunner, GivesUpWithoutUsableScenes) {
  TaskCell dark{test::formation("C"), "paper"};
  dark.runner.on_request(TaskCell::order(), dark.now);
  ASSERT_TRUE(dark.play_until(TaskPhase::kMoving));
  dark.quality = SceneQuality::kDark;
  ASSERT_TRUE(dark.play_to_end(seconds{10}));
  EXPECT_EQ(dark.runner.status().failure, TaskFailure::kNoScene);
  EXPECT_NE(dark.runner.status().text.find("dark"), std::string::npos) << dark.runner.status().text;

  TaskCell none{test::formation("C"), "paper"};
  none.camera_dead = true;
  none.runner.on_request(TaskCell::order(), none.now);
  ASSERT_TRUE(none.play_to_end(seconds{10}));
  EXPECT_EQ(none.runner.status().failure, TaskFailure::kNoScene);

  TaskCell restless{test::formation("C"), "paper"};
  restless.noise_speed = 0.05;
  restless.runner.on_request(TaskCell::order(), restless.now);
  ASSERT_TRUE(restless.play_to_end(seconds{20}));
  EXPECT_EQ(restless.runner.status().failure, TaskFailure::kNoScene);
  EXPECT_EQ(restless.runner.status().hits, 0U);
}

TEST(TaskRunner, CountsDiscsAndForgivesAFrameThatMissesOne) {
  TaskCell blink{test::formation("C"), "paper"};
  blink.runner.on_request(TaskCell::order(), blink.now);
  ASSERT_TRUE(blink.play_until(TaskPhase::kMoving));
  blink.hidden = 1;
  blink.hidden_scenes = 30;  // through the stroke and into the first scenes after it
  ASSERT_TRUE(blink.play_to_end());
  EXPECT_EQ(blink.runner.status().phase, TaskPhase::kSingulated) << blink.runner.status().text;

  TaskCell gone{test::formation("C"), "paper"};
  gone.runner.on_request(TaskCell::order(), gone.now);
  ASSERT_TRUE(gone.play_until(TaskPhase::kMoving));
  gone.hidden = 1;
  ASSERT_TRUE(gone.play_to_end());
  EXPECT_EQ(gone.runner.status().failure, TaskFailure::kDiscLost);
  EXPECT_EQ(gone.runner.status().discs_lost, 1U);

  TaskCell wrong{test::formation("C"), "paper"};
  auto order = TaskCell::order();
  order.expect_discs = 5;
  wrong.runner.on_request(order, wrong.now);
  ASSERT_TRUE(wrong.play_to_end());
  EXPECT_EQ(wrong.runner.status().failure, TaskFailure::kWrongDiscCount);
  EXPECT_EQ(wrong.runner.status().text, "found 4 discs; expected 5");

  TaskCell empty{{}, "paper"};
  empty.runner.on_request(TaskCell::order(), empty.now);
  ASSERT_TRUE(empty.play_to_end());
  EXPECT_EQ(empty.runner.status().failure, TaskFailure::kWrongDiscCount);
}

TEST(TaskRunner, IsPatientWithOthersByTheSlowerOfTwoClocks) {
  // In lockstep on a busy machine: the cell clock leaps while nobody gets to answer.
  TaskCell cell{test::formation("A"), "paper"};
  cell.controller_dead = true;
  cell.runner.on_request(TaskCell::order(), cell.now);
  const auto leap = [&](Duration real) {
    cell.now += seconds{2};
    cell.runner.on_tick(cell.now, real);
    cell.runner.take_actions();
  };
  for (int i = 0; i < 20; ++i) leap(milliseconds{10});
  EXPECT_TRUE(cell.runner.running()) << cell.runner.status().text;
  for (int i = 0; i < 4; ++i) leap(seconds{1});
  EXPECT_EQ(cell.runner.status().failure, TaskFailure::kControllerFault) << cell.runner.status().text;
}

TEST(TaskRunner, GivesUpWhenADiscRestsOutsideThatTheStrategyDoesNotBringBack) {
  auto discs = test::formation("A");
  discs.push_back(test::disc_at(0.31, 0.0));
  TaskCell cell{discs, "paper"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().failure, TaskFailure::kDiscLost);
  EXPECT_EQ(cell.runner.status().discs_lost, 1U);
  EXPECT_EQ(cell.runner.status().text.find("disc 3 at (0.31"), 0U) << cell.runner.status().text;
  EXPECT_NE(cell.runner.status().text.find(" m rests outside the region; "), std::string::npos) << cell.runner.status().text;
}

TEST(TaskRunner, IsNotDoneBeforeADiscOutsideHasBeenBroughtBack) {
  // All apart, and one of them outside.
  TaskCell cell{{test::disc_at(0.0, 0.0), test::disc_at(0.1, 0.1), test::disc_at(0.05, -0.32)}, "robust"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated) << cell.runner.status().text;
  EXPECT_GE(cell.runner.status().hits + cell.runner.status().pushes, 1U);
  EXPECT_EQ(cell.runner.status().discs_lost, 0U);
}

TEST(TaskRunner, KeepsTheOrdersLimits) {
  auto order = TaskCell::order();
  order.max_pushes = 1;
  TaskCell strokes{test::formation("C"), "paper"};
  strokes.runner.on_request(order, strokes.now);
  ASSERT_TRUE(strokes.play_to_end());
  EXPECT_EQ(strokes.runner.status().failure, TaskFailure::kStrokeLimit) << strokes.runner.status().text;
  EXPECT_EQ(strokes.runner.status().pushes, 1U);

  order = TaskCell::order();
  order.timeout = milliseconds{1500};
  TaskCell late{test::formation("E"), "random_push"};
  late.runner.on_request(order, late.now);
  ASSERT_TRUE(late.play_to_end());
  EXPECT_EQ(late.runner.status().failure, TaskFailure::kTimeout);
  EXPECT_EQ(late.run.back().park_after, true);
  EXPECT_LT(late.runner.status().times.total(), seconds{4});  // at most the stroke under way
}

TEST(TaskRunner, RefusesAbsurdOrders) {
  const auto refused = [](auto change) {
    TaskRequest order = TaskCell::order();
    change(order);
    TaskCell cell{test::formation("A"), "paper"};
    cell.runner.on_request(order, cell.now);
    EXPECT_EQ(cell.runner.status().failure, TaskFailure::kBadRequest);
    EXPECT_FALSE(cell.runner.status().text.empty());
    EXPECT_EQ(cell.runner.status().request_seq, 1U);
  };
  refused([](TaskRequest& o) { o.min_gap = -1.0; });
  refused([](TaskRequest& o) { o.min_gap = std::nan(""); });
  refused([](TaskRequest& o) { o.region.max = o.region.min; });
  refused([](TaskRequest& o) { o.speed_scale = 0.0; });
  refused([](TaskRequest& o) { o.timeout = Duration::zero(); });
}

TEST(TaskRunner, TakesOneOrderAtATimeAndTheNextAfterIt) {
  TaskCell cell{test::formation("A"), "paper"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  cell.play_for(milliseconds{50});
  auto next = TaskCell::order(2);
  next.order_id[0] = 43;
  cell.runner.on_request(next, cell.now);
  EXPECT_EQ(cell.runner.status().request_seq, 1U);  // not acknowledged: it is sent again
  EXPECT_EQ(cell.runner.status().order_id[0], 42);
  cell.runner.on_request(TaskCell::order(), cell.now);  // a repetition changes nothing
  ASSERT_TRUE(cell.play_to_end());
  const auto strokes = cell.run.size();
  cell.runner.on_request(TaskCell::order(), cell.now);
  EXPECT_TRUE(is_final(cell.runner.status().phase));
  cell.runner.on_request(next, cell.now);
  EXPECT_EQ(cell.runner.status().order_id[0], 43);
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
  EXPECT_EQ(cell.run.size(), strokes) << "the arm is parked and the table done: nothing is to be moved";
}

TEST(TaskRunner, GivesUpWhenTheCellClockStandsStill) {
  TaskCell cell{test::formation("C"), "paper"};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_until(TaskPhase::kMoving));
  cell.runner.on_clock_stopped(cell.now);
  EXPECT_EQ(cell.runner.status().failure, TaskFailure::kControllerFault);
}

TEST(TaskRunner, IgnoresLateDecisionsAndForeignStrokes) {
  TaskRunner runner{{.park_first = false}, "paper"};
  Time now{seconds{1}};
  runner.on_request(TaskCell::order(), now);
  strategy::Decision decision;
  decision.kind = strategy::Decision::Kind::kNoStroke;
  runner.on_decision(77, decision, {}, now);
  StrokeStatus status;
  status.id = 5;
  status.phase = StrokePhase::kDone;
  runner.on_stroke_status(status, now);
  EXPECT_EQ(runner.status().phase, TaskPhase::kLooking);
  EXPECT_TRUE(runner.running());
}

}  // namespace
}  // namespace breakshot::task
