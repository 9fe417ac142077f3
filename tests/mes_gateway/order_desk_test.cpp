#include "mes_gateway/order_desk.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace breakshot::mes {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A desk with a ready cell, a factory that talks to it and a planner that answers.
class Desk : public ::testing::Test {
 protected:
  Desk() {
    limits.workspace = {{-0.3, -0.3}, {0.3, 0.3}};
    desk.emplace(limits, 1000);
    desk->on_cell_ready(true, "");
    now.cell = time_from_ns(1'000'000'000);
    now.utc_ns = 1'700'000'000'000'000'000;
  }

  Command command(Verb verb) {
    Command c;
    c.header.robot_id = 1;
    c.header.session = 1;
    c.header.seq = ++seq;
    c.header.stamp_utc_ns = now.utc_ns;
    c.command_id = random_id();
    c.order_id = order;
    c.verb = verb;
    return c;
  }
  Ack send(const Command& c) { return desk->on_command(c, now).value(); }
  Ack send(Verb verb) { return send(command(verb)); }

  void advance(Duration by) {
    now.cell += by;
    now.utc_ns += by.count();
    desk->tick(now);
  }
  /// The planner says how the order's task stands; it acknowledges the newest request.
  void planner_says(TaskPhase phase, TaskFailure failure = TaskFailure::kNone, const std::string& text = "") {
    if (const auto request = desk->take_request(now)) taken = *request;
    TaskStatus status;
    status.order_id = taken.order_id;
    status.order_rev = taken.order_rev;
    status.request_seq = taken.seq;
    status.phase = phase;
    status.failure = failure;
    status.text = text;
    status.discs_seen = 6;
    status.discs_singulated = phase == TaskPhase::kSingulated ? 6 : 2;
    desk->on_task_status(status, now);
  }

  OrderLimits limits;
  std::optional<OrderDesk> desk;
  Now now;
  Id order = random_id();
  std::uint64_t seq = 0;
  TaskRequest taken;
};

TEST_F(Desk, RunsAnOrderToItsEnd) {
  EXPECT_TRUE(desk->accepting());
  EXPECT_EQ(send(Verb::kStoreAndStart).verdict, Verdict::kAccepted);
  EXPECT_EQ(desk->state(), PackState::kStarting);
  planner_says(TaskPhase::kLooking);
  EXPECT_EQ(taken.verb, TaskRequest::Verb::kStart);
  EXPECT_EQ(taken.order_id, order);
  EXPECT_EQ(taken.min_gap, limits.default_gap);
  EXPECT_EQ(desk->state(), PackState::kExecute);
  EXPECT_EQ(desk->job()->phase, JobPhase::kRunning);
  EXPECT_NEAR(desk->job()->progress, 2.0 / 6.0, 1e-12);
  planner_says(TaskPhase::kSingulated);
  EXPECT_EQ(desk->state(), PackState::kComplete);
  EXPECT_EQ(desk->job()->phase, JobPhase::kEnded);
  EXPECT_EQ(desk->job()->progress, 1.0);
  EXPECT_GT(desk->job()->ended_utc_ns, 0);
  EXPECT_TRUE(desk->accepting());
}

TEST_F(Desk, AnswersTheSameCommandTwiceAndActsOnce) {
  const Command c = command(Verb::kStoreAndStart);
  EXPECT_EQ(send(c).verdict, Verdict::kAccepted);
  planner_says(TaskPhase::kSingulated);
  ASSERT_EQ(taken.order_id, order);
  Command again = c;
  again.header.seq = ++seq;
  EXPECT_EQ(send(again).verdict, Verdict::kDuplicate);
  EXPECT_EQ(desk->job()->phase, JobPhase::kEnded);
  EXPECT_FALSE(desk->take_request(now)) << "a duplicate starts nothing";
  Command other = c;
  other.spec.min_gap = 0.02;
  EXPECT_EQ(send(other).reason, Reason::kSameRevDiffers);
}

TEST_F(Desk, RefusesAbsurdOrdersWithTheReason) {
  const auto reason = [&](auto&& spoil) {
    Command c = command(Verb::kStoreAndStart);
    spoil(c);
    const Ack ack = send(c);
    EXPECT_EQ(ack.verdict, Verdict::kRejected);
    EXPECT_FALSE(ack.text.empty());
    return ack.reason;
  };
  EXPECT_EQ(reason([](Command& c) { c.spec.min_gap = std::nan(""); }), Reason::kMalformed);
  EXPECT_EQ(reason([](Command& c) { c.spec.min_gap = -0.01; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.spec.min_gap = 5.0; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.spec.speed_scale = 0.0; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.spec.speed_scale = 1e9; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.spec.region = {{-3.0, -3.0}, {3.0, 3.0}}; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.spec.region = {{0.1, 0.1}, {-0.1, -0.1}}; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.spec.timeout_ms = 4'000'000'000U; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.spec.max_hits = 1'000'000; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.spec.expect_discs = 1'000'000; }), Reason::kOutOfLimits);
  EXPECT_EQ(reason([](Command& c) { c.order_id = {}; }), Reason::kMalformed);
  EXPECT_EQ(reason([](Command& c) { c.verb = static_cast<Verb>(99); }), Reason::kMalformed);
  EXPECT_EQ(reason([](Command& c) { c.header.major = 2; }), Reason::kVersion);
  EXPECT_EQ(reason([](Command& c) { c.header.seq = 1; }), Reason::kStale);
  EXPECT_EQ(reason([&](Command& c) {
              c.valid_for_ms = 100;
              c.header.stamp_utc_ns = now.utc_ns - 200'000'000;
            }),
            Reason::kStale);
  EXPECT_FALSE(desk->job());
  EXPECT_FALSE(desk->take_request(now));
}

TEST_F(Desk, RefusesWhileTheCellIsNotReady) {
  desk->on_cell_ready(false, "perception: no camera frames on cell/color for 2 s");
  const Ack ack = send(Verb::kStoreAndStart);
  EXPECT_EQ(ack.reason, Reason::kNotReady);
  EXPECT_NE(ack.text.find("camera"), std::string::npos);
}

TEST_F(Desk, AStoppedCellTakesNoOrderBeforeAClear) {
  desk->on_stop("protective stop: the drives restarted");
  advance(milliseconds{10});
  EXPECT_EQ(desk->state(), PackState::kAborted);
  EXPECT_FALSE(desk->accepting());
  const Ack refused = send(Verb::kStoreAndStart);
  EXPECT_EQ(refused.reason, Reason::kSafetyStop);
  EXPECT_NE(refused.text.find("the drives restarted"), std::string::npos) << refused.text;
  EXPECT_NE(refused.text.find("./breakshot recover"), std::string::npos) << refused.text;
  EXPECT_EQ(send(Verb::kReset).reason, Reason::kSafetyStop);
  EXPECT_FALSE(desk->take_request(now));

  const Command clear = command(Verb::kClear);
  EXPECT_FALSE(desk->on_command(clear, now)) << "answered when it is over";
  EXPECT_EQ(desk->state(), PackState::kClearing);
  EXPECT_EQ(send(Verb::kClear).reason, Reason::kBadState);
  EXPECT_EQ(send(Verb::kStoreAndStart).reason, Reason::kBadState);
  planner_says(TaskPhase::kRecovering);
  EXPECT_EQ(taken.verb, TaskRequest::Verb::kRecover);
  EXPECT_FALSE(desk->take_answer());
  const std::string ended = "ended: the drives restarted, and more than fits beside a string's own bytes";
  planner_says(TaskPhase::kRecovered, TaskFailure::kNone, ended);
  advance(milliseconds{50});
  EXPECT_FALSE(desk->take_answer()) << "the controller's health still says that it is stopped";
  desk->on_stop("");
  advance(milliseconds{50});
  const auto answer = desk->take_answer();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->verdict, Verdict::kAccepted);
  EXPECT_EQ(answer->text, ended) << "a text that went with what it was part of (found by a sanitizer's build)";
  EXPECT_EQ(answer->command_id, clear.command_id);
  EXPECT_EQ(desk->state(), PackState::kStopped);
  EXPECT_FALSE(desk->take_answer());
  EXPECT_EQ(send(clear).verdict, Verdict::kDuplicate);
  EXPECT_TRUE(desk->accepting());
  EXPECT_EQ(send(Verb::kReset).verdict, Verdict::kAccepted);
  EXPECT_EQ(desk->state(), PackState::kIdle);
  EXPECT_EQ(send(Verb::kStoreAndStart).verdict, Verdict::kAccepted);
}

TEST_F(Desk, AClearThatCannotBeDoneSaysWhy) {
  desk->on_stop("controlled stop: another controller sends commands to these drives");
  advance(milliseconds{10});
  EXPECT_FALSE(desk->on_command(command(Verb::kClear), now));
  planner_says(TaskPhase::kFailed, TaskFailure::kControllerFault);
  const auto refused = desk->take_answer();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->verdict, Verdict::kRejected);
  EXPECT_EQ(refused->reason, Reason::kSafetyStop);
  EXPECT_EQ(desk->state(), PackState::kAborted);

  EXPECT_FALSE(desk->on_command(command(Verb::kClear), now));
  for (int i = 0; i < 11 && desk->state() == PackState::kClearing; ++i) advance(milliseconds{500});
  const auto silent = desk->take_answer();
  ASSERT_TRUE(silent) << "a planner that says nothing is not waited for for ever";
  EXPECT_EQ(silent->reason, Reason::kNotReady);
}

TEST_F(Desk, AClearDoesNotEndAnOrder) {
  send(Verb::kStoreAndStart);
  planner_says(TaskPhase::kMoving);
  EXPECT_EQ(send(Verb::kClear).reason, Reason::kBadState);
  EXPECT_EQ(send(Verb::kReset).reason, Reason::kBadState);
  EXPECT_EQ(desk->job()->phase, JobPhase::kRunning);
}

TEST_F(Desk, AStopEndsTheOrderThatRuns) {
  send(Verb::kStoreAndStart);
  planner_says(TaskPhase::kLooking);
  desk->on_stop("protective stop: the drives restarted");
  advance(milliseconds{10});
  EXPECT_EQ(desk->job()->phase, JobPhase::kRunning) << "the planner may know more";
  advance(milliseconds{600});
  EXPECT_EQ(desk->job()->phase, JobPhase::kAborted);
  EXPECT_EQ(desk->job()->result, Reason::kSafetyStop);
  EXPECT_NE(desk->job()->text.find("the drives restarted"), std::string::npos);
  EXPECT_EQ(desk->state(), PackState::kAborted);
  const auto request = desk->take_request(now);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->verb, TaskRequest::Verb::kCancel) << "its next stroke must not wait for the recovery";
  taken = *request;
  // A recovery that comes before the planner has taken the cancel waits for its turn.
  EXPECT_FALSE(desk->on_command(command(Verb::kClear), now));
  planner_says(TaskPhase::kFailed, TaskFailure::kControllerFault);
  EXPECT_FALSE(desk->take_answer());
  advance(milliseconds{10});
  planner_says(TaskPhase::kRecovered);
  EXPECT_EQ(taken.verb, TaskRequest::Verb::kRecover);
}

TEST_F(Desk, TakesOneOrderAtATime) {
  send(Verb::kStoreAndStart);
  Command second = command(Verb::kStoreAndStart);
  second.order_id = random_id();
  EXPECT_EQ(send(second).reason, Reason::kOtherOrderActive);
  planner_says(TaskPhase::kSingulated);
  second.command_id = random_id();
  second.header.seq = ++seq;
  EXPECT_EQ(send(second).verdict, Verdict::kAccepted);
}

TEST_F(Desk, DoesNotRunAClosedOrderAgain) {
  send(Verb::kStoreAndStart);
  planner_says(TaskPhase::kSingulated);
  EXPECT_EQ(send(Verb::kStoreAndStart).reason, Reason::kOrderClosed);
}

TEST_F(Desk, ObeysStopClassVerbsAtAnyAge) {
  send(Verb::kStoreAndStart);
  planner_says(TaskPhase::kMoving);
  Command stop = command(Verb::kStop);
  stop.header.session = 0;
  stop.header.seq = 0;
  stop.valid_for_ms = 1;
  stop.header.stamp_utc_ns = 0;
  EXPECT_EQ(send(stop).verdict, Verdict::kAccepted);
  EXPECT_EQ(desk->state(), PackState::kStopping);
  planner_says(TaskPhase::kCancelled);
  EXPECT_EQ(taken.verb, TaskRequest::Verb::kCancel);
  EXPECT_EQ(desk->state(), PackState::kStopped);
  EXPECT_EQ(desk->job()->phase, JobPhase::kAborted);
}

TEST_F(Desk, CancelsOnlyTheOrderThatItNames) {
  send(Verb::kStoreAndStart);
  planner_says(TaskPhase::kMoving);
  Command other = command(Verb::kCancel);
  other.order_id = random_id();
  EXPECT_EQ(send(other).reason, Reason::kUnknownOrder);
  EXPECT_EQ(desk->job()->phase, JobPhase::kRunning);
  EXPECT_EQ(send(Verb::kCancel).verdict, Verdict::kAccepted);
}

TEST_F(Desk, PausesAndResumes) {
  send(Verb::kStoreAndStart);
  planner_says(TaskPhase::kMoving);
  EXPECT_EQ(send(Verb::kResume).reason, Reason::kBadState);
  send(Verb::kPause);
  planner_says(TaskPhase::kPaused);
  EXPECT_EQ(desk->state(), PackState::kHeld);
  EXPECT_EQ(desk->job()->phase, JobPhase::kInterrupted);
  send(Verb::kResume);
  planner_says(TaskPhase::kLooking);
  EXPECT_EQ(desk->state(), PackState::kExecute);
  EXPECT_EQ(desk->job()->phase, JobPhase::kRunning);
}

TEST_F(Desk, ResendsUntilThePlannerAnswersAndThenGivesUp) {
  send(Verb::kStoreAndStart);
  const auto first = desk->take_request(now);
  ASSERT_TRUE(first);
  EXPECT_FALSE(desk->take_request(now));
  advance(milliseconds{300});
  const auto second = desk->take_request(now);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->seq, first->seq);
  advance(seconds{10});
  EXPECT_EQ(desk->job()->phase, JobPhase::kAborted);
  EXPECT_EQ(desk->job()->result, Reason::kInternal);
  EXPECT_FALSE(desk->take_request(now));
}

TEST_F(Desk, AbortsAnOrderThatARestartedPlannerForgot) {
  send(Verb::kStoreAndStart);
  planner_says(TaskPhase::kMoving);
  desk->on_task_status(TaskStatus{}, now);
  EXPECT_EQ(desk->job()->phase, JobPhase::kAborted);
  EXPECT_FALSE(desk->take_request(now)) << "nothing resumes by itself";
}

TEST_F(Desk, TellsWhyAnOrderFailed) {
  send(Verb::kStoreAndStart);
  planner_says(TaskPhase::kFailed, TaskFailure::kDiscLost);
  EXPECT_EQ(desk->job()->phase, JobPhase::kAborted);
  EXPECT_NE(desk->job()->text.find("disc lost"), std::string::npos);
}

TEST_F(Desk, IgnoresCommandsForOtherRobots) {
  Command c = command(Verb::kStoreAndStart);
  c.header.robot_id = 2;
  EXPECT_FALSE(desk->on_command(c, now));
}

}  // namespace
}  // namespace breakshot::mes
