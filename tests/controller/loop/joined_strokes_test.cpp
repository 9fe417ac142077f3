#include "tests/controller/loop/executor_stand.hpp"

#include "controller/motion/trajectory_check.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

// A stroke that is known while another one runs follows it without a rest, or from rest when it is too late for that, or not at all after a stop.

namespace breakshot::control::test {
namespace {

class JoinedStrokes : public Executor {
 protected:
  static StrokeRequest push_elsewhere(std::uint64_t id) {
    StrokeRequest request = push(id);
    request.p_WS = {-0.05, 0.15};
    request.direction_W = {0.0, 1.0};
    return request;
  }

  /// tick(), and keeps what was commanded.
  void step(const Stand::Upset& upset = {}) {
    tick(upset);
    auto& point = sent_->points[sent_->size++];
    point = {};
    std::copy_n(stand.last.q.data(), kJoints, point.q.begin());
    std::copy_n(stand.last.qd.data(), kJoints, point.qd.begin());
    std::copy_n(stand.last.qdd.data(), kJoints, point.qdd.begin());
  }
  bool has_ended(std::uint64_t id) const { return finals(id) > 0; }
  int run_to_end(std::uint64_t id) {
    int ticks = 0;
    for (; !has_ended(id) && ticks < 8000; ++ticks) step();
    EXPECT_TRUE(has_ended(id)) << "stroke " << id;
    return ticks;
  }
  StrokeStatus final_of(std::uint64_t id) { return finish(id, 1); }
  bool told(std::uint64_t id, StrokePhase phase) const {
    return std::any_of(history.begin(), history.end(),
                       [&](const StrokeStatus& status) { return status.id == id && status.phase == phase; });
  }
  double largest_speed_share() const { return (stand.last.qd.array().abs() / planner.kinematics().max_speed().array()).maxCoeff(); }
  void expect_limits_kept() const {
    const auto& arm = planner.kinematics();
    const motion::JointLimits limits{arm.lower(), arm.upper(), arm.max_speed(), planner.settings().max_acceleration,
                                     planner.settings().max_jerk};
    const auto use = motion::measure(*sent_, 0, sent_->size, limits, planner.clearance());
    EXPECT_LE(use.speed, 1.001);
    EXPECT_LE(use.acceleration, 1.001);
    EXPECT_LE(use.jerk, 1.01);
    EXPECT_LE(use.out_of_range, 1e-6);
    EXPECT_LE(use.inconsistency, 1e-3);
    EXPECT_GE(use.lowest_tip, planner.settings().tip_height - 1e-4);
    EXPECT_GE(use.lowest_link, planner.settings().link_clearance - 1e-4);
  }
  /// Starts a hit and lets it be known what push is to follow, and ticks until the loop holds both. They are first_ and second_.
  void start_pair() {
    sent_->size = 0;
    first_ = second_ + 1;
    second_ = first_ + 1;
    submit(hit(first_));
    run_until_phase(StrokePhase::kTransit);
    submit(push_elsewhere(second_));
    step();
    ASSERT_TRUE(told(second_, StrokePhase::kAccepted)) << "planned ahead";
  }
  /// Ticks from the start of the pair to the one with which the second takes over.
  int ticks_to_join() {
    start_pair();
    const int ticks = run_to_end(first_);
    run_to_end(second_);
    return ticks;
  }
  void recover_and_park() {
    const std::uint64_t recovery = ++second_;
    submit(recover(recovery));
    ASSERT_EQ(finish(recovery).phase, StrokePhase::kDone);
    submit(park(++second_));
    ASSERT_EQ(finish(second_).phase, StrokePhase::kDone);
  }
  void expect_nothing_lost() {
    EXPECT_EQ(stand.channels.events.dropped(), 0U);
    EXPECT_EQ(stand.channels.returns.dropped(), 0U);
    EXPECT_TRUE(executor.idle());
  }

  std::uint64_t first_ = 0, second_ = 0;
  std::unique_ptr<motion::Trajectory> sent_ = [] {
    auto empty = std::make_unique<motion::Trajectory>();
    empty->joints = kJoints;
    empty->tick = kTick;
    return empty;
  }();
};

TEST_F(JoinedStrokes, AHitAndThePushAfterItAreOneMotion) {
  start_pair();
  double slowest = 1.0;
  int ticks = 0;
  for (; !has_ended(2) && ticks < 8000; ++ticks) {
    step();
    // A push itself begins and ends at rest on its line: what counts is from the disc tops to the disc tops.
    const bool high = planner.clearance().heights(stand.last.q).tip >= planner.settings().disc_height;
    if (told(1, StrokePhase::kRetreat) && !told(2, StrokePhase::kRunIn) && high) slowest = std::min(slowest, largest_speed_share());
  }
  EXPECT_GT(slowest, 0.05) << "of a joint's speed";
  expect_limits_kept();

  const auto first = final_of(1);
  EXPECT_EQ(first.phase, StrokePhase::kDone) << first.text;
  EXPECT_NE(first.text.find("went on to stroke 2"), std::string::npos) << first.text;
  EXPECT_NEAR(first.contact_speed, 0.4, 0.004);
  const auto second = final_of(2);
  EXPECT_EQ(second.phase, StrokePhase::kDone) << second.text;
  EXPECT_LT((stand.drives.state().q - park_pose()).cwiseAbs().maxCoeff(), 1e-6) << "park_after of the second holds";
  std::vector<std::pair<std::uint64_t, StrokePhase>> phases;
  for (const auto& status : history) {
    const std::pair now{status.id, status.phase};
    if (phases.empty() || phases.back() != now) phases.push_back(now);
  }
  using enum StrokePhase;
  const decltype(phases) expected{{1, kAccepted}, {1, kTransit}, {2, kAccepted}, {1, kRunIn},   {1, kFollowThrough}, {1, kRetreat},
                                  {1, kDone},     {2, kTransit}, {2, kRunIn},    {2, kRetreat}, {2, kParking},       {2, kDone}};
  std::erase_if(phases, [](const auto& each) { return each.first == 2 && each.second == kFollowThrough; });
  EXPECT_EQ(phases, expected);
  EXPECT_EQ(executor.newest()->id, 2U);

  history.clear();
  submit(hit(3));
  int apart = run_to_end(3);
  submit(push_elsewhere(4));
  apart += run_to_end(4);
  EXPECT_LT(ticks, 0.95 * apart);
  std::printf("%d ms as one motion, %d ms apart\n", ticks, apart);
  expect_nothing_lost();
}

TEST_F(JoinedStrokes, AsManyAsAreKnownInTimeRunWithoutARest) {
  constexpr std::uint64_t kStrokes = 8;
  submit(hit(1));
  for (std::uint64_t id = 2; id <= kStrokes; ++id) {
    while (!told(id - 1, StrokePhase::kRunIn)) step();
    submit(id % 2 == 0 ? push_elsewhere(id) : hit(id));
  }
  run_to_end(kStrokes);
  for (std::uint64_t id = 1; id <= kStrokes; ++id) {
    const auto done = final_of(id);
    EXPECT_EQ(done.phase, StrokePhase::kDone) << done.text;
    EXPECT_EQ(done.text.find("went on") != std::string::npos, id != kStrokes) << done.text;
    EXPECT_EQ(finals(id), 1U);
    if (id % 2 == 1) {
      EXPECT_NEAR(done.contact_speed, 0.4, 0.004);
    }
  }
  expect_limits_kept();
  expect_nothing_lost();
}

TEST_F(JoinedStrokes, OneMayFollowAndWhatElseComesIsBusy) {
  start_pair();
  submit(hit(3));
  submit(recover(4));
  step();
  for (const std::uint64_t id : {3U, 4U}) {
    EXPECT_EQ(final_of(id).reason, RefusalReason::kBusy);
    EXPECT_NE(final_of(id).text.find("stroke 2 is to follow"), std::string::npos);
  }
  const auto answers = [&] { return std::count_if(history.begin(), history.end(), [](const auto& each) { return each.id == 2; }); };
  const auto before = answers();
  submit(push_elsewhere(2));  // once more: answered, and nothing else
  step();
  EXPECT_EQ(answers(), before + 1);
  ASSERT_NE(executor.following(), nullptr) << "for the periodic status";
  EXPECT_EQ(executor.following()->id, 2U);
  EXPECT_EQ(executor.newest()->id, 1U);
  run_to_end(2);
  EXPECT_EQ(finals(1), 1U);
  EXPECT_EQ(finals(2), 1U);
  history.clear();

  submit(park(5));
  for (int i = 0; i < 3; ++i) step();
  submit(hit(6));
  EXPECT_EQ(finish(6).reason, RefusalReason::kBusy) << "a park request is for the park pose";
  EXPECT_EQ(finish(5).phase, StrokePhase::kDone);
  submit(hit(7));
  step();
  submit(push_elsewhere(7));
  EXPECT_EQ(finish(7).reason, RefusalReason::kBusy) << "nobody could tell their status apart";
}

TEST_F(JoinedStrokes, WhatIsWrongIsRefusedAtOnce) {
  submit(hit(1));
  run_until_phase(StrokePhase::kTransit);
  StrokeRequest wrong = push(2);
  wrong.length = -1.0;
  submit(wrong);
  step();
  EXPECT_EQ(final_of(2).reason, RefusalReason::kBadRequest);
  EXPECT_FALSE(has_ended(1));
  StrokeRequest too_fast = hit(3);
  too_fast.p_WS = {0.25, 0.25};
  too_fast.speed = 1.9;
  submit(too_fast);
  run_to_end(3);
  EXPECT_EQ(final_of(1).phase, StrokePhase::kDone);
  EXPECT_EQ(final_of(3).phase, StrokePhase::kRefused);
  EXPECT_EQ(final_of(3).reason, RefusalReason::kTooFast) << "with what is attainable, which is found from rest";
  EXPECT_GT(final_of(3).attainable, 0.0);
  expect_nothing_lost();
}

TEST_F(JoinedStrokes, TooLateForAJoinItStartsFromRest) {
  submit(hit(1));
  run_until_phase(StrokePhase::kParking);
  while (stand.status().setpoint.qd != safety::JointArray{}) {
    if (largest_speed_share() < 0.02 && !has_ended(1)) submit(push_elsewhere(2));
    step();
  }
  ASSERT_TRUE(told(2, StrokePhase::kAccepted)) << "an answer at once";
  const auto answer = std::find_if(history.begin(), history.end(), [](const auto& each) { return each.id == 2; });
  EXPECT_EQ(answer->text, "waits for stroke 1");
  EXPECT_EQ(answer->planned_total, Duration::zero());
  run_to_end(2);
  EXPECT_EQ(final_of(1).phase, StrokePhase::kDone);
  EXPECT_EQ(final_of(1).text, "");
  EXPECT_EQ(final_of(2).phase, StrokePhase::kDone);
  EXPECT_EQ(finals(2), 1U);
  expect_limits_kept();
  expect_nothing_lost();
}

TEST_F(JoinedStrokes, OnTheWayToTheParkPoseThereIsStillAJoin) {
  submit(hit(1));
  run_until_phase(StrokePhase::kParking);
  submit(push_elsewhere(2));
  run_to_end(2);
  EXPECT_NE(final_of(1).text.find("went on"), std::string::npos);
  EXPECT_EQ(final_of(2).phase, StrokePhase::kDone);
  expect_limits_kept();
}

// Planning that takes longer than was thought: the place of the join has gone by before the loop hears of it.
TEST_F(JoinedStrokes, APlanThatComesTooLateIsMadeAgain) {
  submit(hit(1));
  run_until_phase(StrokePhase::kParking);
  submit(push_elsewhere(2));
  executor.poll(stand.now());
  // Nobody hands the request on for 150 ms: as if planning had taken so long.
  LoopRequest held;
  ASSERT_TRUE(stand.channels.requests.pop(held));
  ASSERT_NE(held.join.number, 0U);
  for (int i = 0; i < 150; ++i) stand.tick();
  stand.channels.requests.push(held);
  run_to_end(2);
  EXPECT_EQ(final_of(1).phase, StrokePhase::kDone);
  EXPECT_EQ(final_of(2).phase, StrokePhase::kDone);
  EXPECT_EQ(
      std::count_if(history.begin(), history.end(), [](const auto& each) { return each.id == 2 && each.phase == StrokePhase::kAccepted; }),
      2);
  expect_nothing_lost();
}

TEST_F(JoinedStrokes, AStopAroundTheJoinEndsBoth) {
  const int join = ticks_to_join();
  for (int at = join - 60; at <= join + 60; at += at > join - 3 && at < join + 3 ? 1 : 9) {
    SCOPED_TRACE(testing::Message() << at - join << " ticks from the join");
    recover_and_park();
    start_pair();
    for (int i = 0; i < at; ++i) step();
    executor.cancel("test", stand.now());
    int ticks = 0;
    for (; !stand.status().stopped() || stand.status().moving; ++ticks) {
      ASSERT_LT(ticks, 310) << "at rest within 300 ms";
      step();
    }
    for (int i = 0; i < 20; ++i) step();
    const bool went_on = final_of(first_).phase == StrokePhase::kDone;
    EXPECT_EQ(went_on, at > join - 1);
    if (went_on) {
      EXPECT_EQ(final_of(second_).phase, StrokePhase::kStopped);
    } else {
      EXPECT_EQ(final_of(first_).phase, StrokePhase::kStopped);
      EXPECT_EQ(final_of(second_).phase, StrokePhase::kRefused);
      EXPECT_EQ(final_of(second_).reason, RefusalReason::kStopped);
    }
    EXPECT_EQ(finals(first_) + finals(second_), 2U);
    submit(hit(++second_));
    EXPECT_EQ(finish(second_).reason, RefusalReason::kStopped);
    expect_nothing_lost();
  }
}

TEST_F(JoinedStrokes, AParkRequestEndsBothAndParks) {
  start_pair();
  submit(park(3));
  EXPECT_EQ(finish(3).phase, StrokePhase::kDone);
  EXPECT_EQ(final_of(1).phase, StrokePhase::kStopped);
  EXPECT_EQ(final_of(2).phase, StrokePhase::kRefused);
  EXPECT_EQ(final_of(2).reason, RefusalReason::kStopped);
  EXPECT_LT((stand.drives.state().q - park_pose()).cwiseAbs().maxCoeff(), 1e-6);
  submit(hit(4));
  EXPECT_EQ(finish(4).phase, StrokePhase::kDone);
}

// An arm that is slowed down, because nobody knows where it is, is not where the join was planned for: the second stroke starts from rest.
TEST_F(JoinedStrokes, LateStatesAroundTheJoinDelayTheSecond) {
  const int join = ticks_to_join();
  for (int at = join - 20; at <= join + 10; at += 3) {
    SCOPED_TRACE(testing::Message() << at - join << " ticks from the join");
    start_pair();
    for (int i = 0; i < at; ++i) step();
    for (int i = 0; i < 8; ++i) step({.lose_state = true});
    run_to_end(second_);
    EXPECT_EQ(final_of(first_).phase, StrokePhase::kDone) << final_of(first_).text;
    EXPECT_EQ(final_of(second_).phase, StrokePhase::kDone) << final_of(second_).text;
    EXPECT_EQ(finals(second_), 1U);
    expect_nothing_lost();
  }
}

TEST_F(JoinedStrokes, TicksThatAreSkippedAcrossTheJoinLeaveTheArmWhereItWouldHaveBeen) {
  const int join = ticks_to_join();
  start_pair();
  for (int i = 0; i < join + 100; ++i) step();
  const auto whole = std::make_unique<motion::Trajectory>(*sent_);
  run_to_end(second_);
  for (int before = 0; before <= 8; ++before) {
    SCOPED_TRACE(testing::Message() << before << " of 8 skipped ticks before the join");
    start_pair();
    const std::size_t begun = sent_->size;
    for (int i = 0; i < join - before - 1; ++i) step();
    step({.skip = 8});
    for (int i = 0; i < 20; ++i) {
      const auto& now = sent_->points[sent_->size - 1];
      const auto& then = whole->points[begun + static_cast<std::size_t>(join - before + 8 + i) - 1];
      for (std::size_t j = 0; j < kJoints; ++j) ASSERT_NEAR(now.q[j], then.q[j], 1e-9);
      step();
    }
    run_to_end(second_);
    EXPECT_EQ(final_of(first_).phase, StrokePhase::kDone);
    EXPECT_EQ(final_of(second_).phase, StrokePhase::kDone);
    EXPECT_NE(final_of(first_).text.find("went on"), std::string::npos);
  }
}

TEST_F(JoinedStrokes, LostStatesStopBoth) {
  start_pair();
  for (int i = 0; i < 600; ++i) step({.lose_state = true});
  EXPECT_EQ(final_of(1).phase, StrokePhase::kStopped);
  EXPECT_EQ(final_of(2).phase, StrokePhase::kRefused);
  EXPECT_EQ(final_of(2).reason, RefusalReason::kStopped);
  for (int i = 0; i < 500; ++i) step();
  expect_stopped(10, "no fresh joint state");
  expect_goes_on(20, "no fresh joint state");
}

TEST_F(JoinedStrokes, AfterCloseBothEnd) {
  start_pair();
  executor.close("the controller ends", stand.now());
  EXPECT_EQ(finish(1).phase, StrokePhase::kStopped);
  EXPECT_EQ(finish(2).phase, StrokePhase::kRefused);
  EXPECT_TRUE(executor.idle());
}

}  // namespace
}  // namespace breakshot::control::test
