// Strokes that go on from another one in motion: as exact as those from rest, within every limit across the join, never at rest between the two, and
// sooner done than one after the other.

#include "controller/motion/join.hpp"
#include "tests/controller/motion/shipped_arm.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>

namespace breakshot::motion {
namespace {

using support::audit;
using support::random_hit;
using support::random_push;
using support::StrokeAudit;

class ContinuousStrokes : public ShippedArm {
 protected:
  StrokeRequest random_stroke(StrokeKind kind) {
    StrokeRequest request =
        kind == StrokeKind::kHit ? random_hit(random_, cell_.workspace, random_.uniform(0.3, 1.0)) : random_push(random_, cell_.workspace);
    request.park_after = random_.uniform() < 0.5;
    return request;
  }

  /// Least over the ticks [from, to) of `trajectory` of the largest share of its speed that a joint has.
  double slowest(const Trajectory& trajectory, std::size_t from, std::size_t to) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = from; k < to; ++k) {
      least = std::min(least, (state_at(trajectory, k).qd.array().abs() / planner_.kinematics().max_speed().array()).maxCoeff());
    }
    return least;
  }

  std::unique_ptr<Trajectory> first_ = std::make_unique<Trajectory>();
  std::unique_ptr<Trajectory> rested_ = std::make_unique<Trajectory>();
  std::unique_ptr<Trajectory> joined_ = std::make_unique<Trajectory>();
};

struct Pair {
  StrokeKind first, second;
};

class Pairs : public ContinuousStrokes, public testing::WithParamInterface<Pair> {};
INSTANTIATE_TEST_SUITE_P(Kinds, Pairs,
                         testing::Values(Pair{StrokeKind::kHit, StrokeKind::kPush}, Pair{StrokeKind::kHit, StrokeKind::kHit},
                                         Pair{StrokeKind::kPush, StrokeKind::kHit}, Pair{StrokeKind::kPush, StrokeKind::kPush}),
                         [](const auto& instance) {
                           return std::string{to_string(instance.param.first)} + "_" + to_string(instance.param.second);
                         });

TEST_P(Pairs, AreOneMotionAndAsExactAsAlone) {
  constexpr int kPairs = 60;
  int possible = 0;
  int joined = 0;
  double over_separate = 0.0;
  double least_speed = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kPairs; ++i) {
    const StrokeRequest one = random_stroke(GetParam().first);
    const StrokeRequest two = random_stroke(GetParam().second);
    SCOPED_TRACE(testing::Message() << "pair " << i << ": at " << one.p_WS.transpose() << " along " << one.direction_W.transpose()
                                    << ", then at " << two.p_WS.transpose() << " along " << two.direction_W.transpose());
    const auto alone = planner_.plan(one, settings_.park, *first_);
    if (!alone) continue;
    const auto from_rest = planner_.plan(two, state_at(*first_, first_->size - 1).q, *rested_);
    if (!from_rest) continue;
    ++possible;
    const std::size_t join = first_join(*first_);
    ASSERT_GT(join, first_->contact_tick);
    const auto times = planner_.plan(two, state_at(*first_, join), *joined_);
    if (!times) {
      EXPECT_EQ(times.error().reason, RefusalReason::kJointLimit) << times.error().text;
      continue;
    }
    ++joined;

    const support::Before before{*first_, join};
    const StrokeAudit found = audit(planner_, two, *times, *joined_, &before);
    expect_within_limits(found, *times, *joined_);
    expect_exact(found, *times, *joined_);

    // A push itself sets off, and ends, at rest on its line: what counts is from the disc tops to the disc tops.
    std::size_t high = first_->contact_tick;
    while (first_->points[high].phase < StrokePhase::kRetreat) ++high;
    std::size_t low = joined_->contact_tick;
    while (planner_.clearance().heights(state_at(*joined_, low).q).tip < settings_.disc_height) --low;
    const double speed = std::min(slowest(*first_, high, join), slowest(*joined_, 0, low));
    EXPECT_GT(speed, 0.02) << "the arm all but rests between the two";
    least_speed = std::min(least_speed, speed);

    const double total = to_seconds(static_cast<std::int64_t>(join) * settings_.tick + times->total);
    const double separate = to_seconds(alone->total + from_rest->total);
    EXPECT_LT(total, separate);
    over_separate += total / separate;
  }
  EXPECT_GE(possible, kPairs / 2);
  EXPECT_GE(joined, possible * 95 / 100);
  EXPECT_LT(over_separate / joined, 0.95);
  std::printf("%d of %d pairs joined; time over that of the two apart: %.3f; slowest in between: %.3f of a joint's speed\n", joined,
              possible, over_separate / joined, least_speed);
}

TEST_F(ContinuousStrokes, FromAMotionAmongTheDiscsThereIsNone) {
  const StrokeRequest hit = random_stroke(StrokeKind::kHit);
  ASSERT_TRUE(planner_.plan(hit, settings_.park, *first_));
  const auto refused = planner_.plan(hit, state_at(*first_, first_->contact_tick + 5), *joined_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, RefusalReason::kJointLimit);
  EXPECT_EQ(refused.error().attainable, 0.0);
}

TEST_F(ContinuousStrokes, WhatIsWrongOrOutOfReachIsSaidFromAnyMotion) {
  const StrokeRequest hit = random_stroke(StrokeKind::kHit);
  ASSERT_TRUE(planner_.plan(hit, settings_.park, *first_));
  const MotionState start = state_at(*first_, first_join(*first_));
  StrokeRequest wrong = hit;
  wrong.direction_W *= 2.0;
  EXPECT_EQ(planner_.plan(wrong, start, *joined_).error().reason, RefusalReason::kBadRequest);
  MotionState nan = start;
  nan.qdd[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(planner_.plan(hit, nan, *joined_).error().reason, RefusalReason::kBadRequest);
  MotionState fast = start;
  fast.qd[0] = 2.0 * planner_.kinematics().max_speed()[0];
  EXPECT_FALSE(planner_.plan(hit, fast, *joined_));
}

}  // namespace
}  // namespace breakshot::motion
