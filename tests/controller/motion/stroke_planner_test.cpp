// What every stroke keeps, over random requests to the shipped arm: nothing here knows how a stroke is planned.

#include "tests/controller/motion/shipped_arm.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

namespace breakshot::motion {
namespace {

using support::audit;
using support::random_hit;
using support::random_push;
using support::StrokeAudit;
using ::testing::HasSubstr;

class Strokes : public ShippedArm {
 protected:
  void expect_ends_where_asked(const StrokeRequest& request, const StrokeTimes& times) const {
    const JointVector end = last();
    if (request.park_after) {
      EXPECT_EQ(end, settings_.park);
      return;
    }
    const Vector3 p_WT = planner_.kinematics().tip_in_world(end).translation();
    EXPECT_GE(p_WT.z(), settings_.safe_height() - 1e-3);
    const double reach = request.length + times.low_after + 0.15;
    EXPECT_LE((p_WT.head<2>() - request.p_WS).norm(), reach);
  }

  /// A refusal tells why, and of what is too fast a speed that is not.
  void expect_useful(const Refusal& refusal, StrokeRequest request, const JointVector& q_start) {
    EXPECT_NE(refusal.reason, RefusalReason::kNone);
    EXPECT_FALSE(refusal.text.empty());
    EXPECT_LE(refusal.text.size(), 255U);
    if (refusal.reason != RefusalReason::kTooFast) {
      EXPECT_EQ(refusal.attainable, 0.0);
      return;
    }
    EXPECT_GT(refusal.attainable, 0.0);
    EXPECT_LT(refusal.attainable, request.speed);
    for (const double share : {1.0, 0.99}) {
      request.speed = share * refusal.attainable;
      EXPECT_TRUE(planner_.plan(request, q_start, *out_)) << share << " of what was called attainable is refused";
    }
  }

  JointVector last() const {
    const auto& point = out_->points[out_->size - 1];
    return Eigen::Map<const Eigen::VectorXd>{point.q.data(), out_->joints};
  }

  std::unique_ptr<Trajectory> out_ = std::make_unique<Trajectory>();
};

class Hits : public Strokes, public testing::WithParamInterface<double> {};
INSTANTIATE_TEST_SUITE_P(Speeds, Hits, testing::Values(0.3, 0.6, 1.0),
                         [](const auto& instance) { return std::to_string(std::lround(100 * instance.param)) + "cmPerSecond"; });

TEST_P(Hits, MeetTheDiscAsAskedAndNeverTwice) {
  constexpr int kRequests = 100;
  int accepted = 0;
  JointVector q = settings_.park;
  for (int i = 0; i < kRequests; ++i) {
    StrokeRequest request = random_hit(random_, cell_.workspace, GetParam());
    request.park_after = random_.uniform() < 0.5;
    SCOPED_TRACE(testing::Message() << "hit " << i << " at " << request.p_WS.transpose() << " along " << request.direction_W.transpose());
    const auto times = planner_.plan(request, q, *out_);
    if (!times) {
      expect_useful(times.error(), request, q);
      continue;
    }
    ++accepted;
    EXPECT_LE(request.speed, planner_.speed_bound(request.p_WS, request.direction_W));
    const StrokeAudit found = audit(planner_, request, *times, *out_);
    expect_within_limits(found, *times, *out_);
    expect_exact(found, *times, *out_);
    EXPECT_GT(found.struck_disc_gap, 0.0);
    expect_ends_where_asked(request, *times);
    q = last();  // the next one begins where this one ends
  }
  EXPECT_GE(accepted, kRequests / 2);
}

TEST_F(Strokes, PushesAreStraightAtTheAskedSpeedAndAsLongAsAsked) {
  constexpr int kRequests = 100;
  int accepted = 0;
  JointVector q = settings_.park;
  for (int i = 0; i < kRequests; ++i) {
    StrokeRequest request = random_push(random_, cell_.workspace);
    request.park_after = random_.uniform() < 0.5;
    SCOPED_TRACE(testing::Message() << "push " << i << " of " << request.length << " m at " << request.p_WS.transpose() << " along "
                                    << request.direction_W.transpose() << ", " << request.speed << " m/s");
    const auto times = planner_.plan(request, q, *out_);
    if (!times) {
      expect_useful(times.error(), request, q);
      continue;
    }
    ++accepted;
    const StrokeAudit found = audit(planner_, request, *times, *out_);
    expect_within_limits(found, *times, *out_);
    expect_exact(found, *times, *out_);
    EXPECT_LE(found.end_error, 0.2e-3);
    expect_ends_where_asked(request, *times);
    q = last();
  }
  EXPECT_GE(accepted, kRequests / 2);
}

TEST_F(Strokes, FromAmongTheDiscsItRisesStraightUpFirst) {
  kinematics::InverseKinematics ik{planner_.kinematics()};
  const double safe = settings_.safe_height();
  for (int i = 0; i < 20; ++i) {
    const StrokeRequest somewhere = random_hit(random_, cell_.workspace, 0.5);
    Pose X_WT{Eigen::Translation3d{somewhere.p_WS.x(), somewhere.p_WS.y(), settings_.tip_height}};
    X_WT.rotate(Eigen::AngleAxisd{std::numbers::pi, Vector3::UnitX()});
    const auto low = ik.solve(X_WT, settings_.park);
    ASSERT_FALSE(low.empty());

    StrokeRequest park;
    const auto times = planner_.plan(park, low.q[0], *out_);
    ASSERT_TRUE(times) << times.error().text;
    const StrokeAudit found = audit(planner_, park, *times, *out_);
    expect_within_limits(found, *times, *out_);
    EXPECT_GE(found.lowest_tip, settings_.tip_height - 1e-4);
    EXPECT_EQ(last(), settings_.park);
    bool risen = false;
    for (std::size_t k = 0; k < out_->size; ++k) {
      const JointVector q = Eigen::Map<const Eigen::VectorXd>{out_->points[k].q.data(), out_->joints};
      const Vector3 p_WT = planner_.kinematics().tip_in_world(q).translation();
      risen = risen || p_WT.z() >= safe - 1e-3;
      if (risen) {
        EXPECT_GE(p_WT.z(), safe - 2e-3);
      } else {
        EXPECT_LE((p_WT.head<2>() - somewhere.p_WS).norm(), 0.3e-3);
      }
    }
  }
}

TEST_F(Strokes, TheSameRequestGivesTheSameTrajectory) {
  const StrokeRequest request = random_hit(random_, {{-0.1, -0.1}, {0.1, 0.1}}, 0.4);
  ASSERT_TRUE(planner_.plan(request, settings_.park, *out_));
  const auto first = std::make_unique<Trajectory>(*out_);
  (void)planner_.plan(random_push(random_, cell_.workspace), settings_.park, *out_);  // leaves nothing behind
  ASSERT_TRUE(planner_.plan(request, settings_.park, *out_));
  ASSERT_EQ(out_->size, first->size);
  for (std::size_t k = 0; k < first->size; ++k) ASSERT_EQ(out_->points[k].q, first->points[k].q);
}

TEST_F(Strokes, RefusesWhatMakesNoSenseAndSaysWhy) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  StrokeRequest good = random_hit(random_, {{-0.1, -0.1}, {0.1, 0.1}}, 0.3);
  ASSERT_TRUE(planner_.plan(good, settings_.park, *out_));
  const auto refused = [&](auto&& change, RefusalReason reason, const char* words) {
    StrokeRequest request = good;
    change(request);
    const auto result = planner_.plan(request, settings_.park, *out_);
    ASSERT_FALSE(result) << words;
    EXPECT_EQ(result.error().reason, reason) << result.error().text;
    EXPECT_THAT(result.error().text, HasSubstr(words));
  };
  refused([&](StrokeRequest& r) { r.p_WS.x() = nan; }, RefusalReason::kBadRequest, "p_WS");
  refused([&](StrokeRequest& r) { r.direction_W = {0.0, 0.0}; }, RefusalReason::kBadRequest, "direction_W");
  refused([&](StrokeRequest& r) { r.direction_W = {nan, 1.0}; }, RefusalReason::kBadRequest, "direction_W");
  refused([&](StrokeRequest& r) { r.speed = 50.0; }, RefusalReason::kBadRequest, "speed");
  refused([&](StrokeRequest& r) { r.speed = -0.3; }, RefusalReason::kBadRequest, "speed");
  refused([&](StrokeRequest& r) { r.run_in = nan; }, RefusalReason::kBadRequest, "run_in");
  refused([&](StrokeRequest& r) { r.kind = static_cast<StrokeKind>(77); }, RefusalReason::kBadRequest, "kind");
  refused([&](StrokeRequest& r) { r.kind = StrokeKind::kPush, r.length = 0.0; }, RefusalReason::kBadRequest, "length");
  refused([&](StrokeRequest& r) { r.p_WS = {3.0, 0.0}; }, RefusalReason::kOutOfBounds, "3.000");
  refused([&](StrokeRequest& r) { r.speed = settings_.max_hit_speed; }, RefusalReason::kTooFast, "attainable");

  JointVector outside = settings_.park;
  outside[0] = 10.0;
  EXPECT_EQ(planner_.plan(good, outside, *out_).error().reason, RefusalReason::kJointLimit);
  EXPECT_EQ(planner_.plan(good, JointVector::Zero(3), *out_).error().reason, RefusalReason::kBadRequest);
}

}  // namespace
}  // namespace breakshot::motion
