#pragma once

#include "tests/controller/loop/harness.hpp"
#include "tests/support/arms.hpp"

#include "controller/loop/stroke_executor.hpp"
#include "controller/motion/stroke_planner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <string>
#include <vector>

// An executor with the loop and ideal drives below it, and what its tests ask of it.

namespace breakshot::control::test {

inline JointVector park_pose() {
  // cell.arm.park_deg of config/cell.yaml
  return (JointVector{6} << 40.0, -108.0, -93.0, -51.0, 97.0, -90.0).finished() * (std::numbers::pi / 180.0);
}

inline motion::MotionSettings motion_settings() {
  motion::MotionSettings settings;
  settings.park = park_pose();
  return settings;
}

inline Pose base_pose() {
  Pose X_WB = Pose::Identity();
  X_WB.translation() = Vector3{-0.5, 0.0, 0.0};
  return X_WB;
}

inline LoopConfig ur5e_config() {
  LoopConfig config = test_config();
  const auto arm = support::ur5e();
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    config.limits.lower[j] = arm.joints[j].lower;
    config.limits.upper[j] = arm.joints[j].upper;
    config.limits.max_speed[j] = arm.joints[j].max_speed;
  }
  return config;
}

class Executor : public ::testing::Test {
 protected:
  Executor() { stand.drives.place(park_pose()); }
  void SetUp() override {
    ASSERT_TRUE(stand.get_ready());
    executor.poll(stand.now());
  }

  static StrokeRequest hit(std::uint64_t id) {
    StrokeRequest request;
    request.id = id;
    request.kind = StrokeKind::kHit;
    request.p_WS = {0.05, 0.02};
    request.direction_W = {1.0, 0.0};
    request.speed = 0.4;
    request.run_in = 0.04;
    return request;
  }
  static StrokeRequest push(std::uint64_t id) {
    StrokeRequest request = hit(id);
    request.kind = StrokeKind::kPush;
    request.speed = 0.1;
    request.length = 0.08;
    return request;
  }
  static StrokeRequest park(std::uint64_t id) {
    StrokeRequest request;
    request.id = id;
    return request;
  }
  static StrokeRequest recover(std::uint64_t id) {
    StrokeRequest request;
    request.id = id;
    request.kind = StrokeKind::kRecover;
    return request;
  }
  /// The stop that the arm is in lasts: neither a stroke nor a park request moves anything, and each says why and what to do.
  void expect_stopped(std::uint64_t id, const std::string& cause) {
    const JointVector rest = stand.drives.state().q;
    for (const StrokeRequest& request : {hit(id), push(id + 1), park(id + 2)}) {
      submit(request);
      const auto refused = finish(request.id);
      EXPECT_EQ(refused.phase, StrokePhase::kRefused);
      EXPECT_EQ(refused.reason, RefusalReason::kStopped);
      EXPECT_NE(refused.text.find(cause), std::string::npos) << refused.text;
      EXPECT_NE(refused.text.find("./breakshot recover"), std::string::npos) << refused.text;
      for (int i = 0; i < 300; ++i) tick();
    }
    EXPECT_EQ(stand.drives.state().q, rest) << "nothing moves";
  }
  /// A recovery moves nothing and makes no jump; the stroke after it runs.
  void expect_goes_on(std::uint64_t id, const std::string& cause) {
    const JointVector rest = stand.drives.state().q;
    submit(recover(id));
    const auto recovered = finish(id);
    EXPECT_EQ(recovered.phase, StrokePhase::kDone) << recovered.text;
    EXPECT_EQ(recovered.text.rfind("ended: ", 0), 0U) << recovered.text;
    EXPECT_NE(recovered.text.find(cause), std::string::npos) << recovered.text;
    for (int i = 0; i < 300; ++i) tick();
    EXPECT_EQ(stand.drives.state().q, rest) << "nothing moves without a fresh request";
    EXPECT_LT((stand.last.q - rest).cwiseAbs().maxCoeff(), stand.config.give_way_tolerance);
    submit(hit(id + 1));
    EXPECT_EQ(finish(id + 1).phase, StrokePhase::kDone);
  }

  void submit(const StrokeRequest& request) { executor.submit(request, stand.now()); }
  /// A tick of everything, as the in-process cell does it.
  void tick(const Stand::Upset& upset = {}) {
    stand.tick(upset);
    executor.poll(stand.now());
    StrokeStatus status;
    while (executor.next(status)) history.push_back(status);
  }
  /// Ticks until stroke `id` ends; its final status.
  StrokeStatus finish(std::uint64_t id, int limit = 20'000) {
    for (int i = 0; i < limit; ++i) {
      for (const auto& status : history) {
        if (status.id == id && is_final(status.phase)) return status;
      }
      tick();
    }
    ADD_FAILURE() << "stroke " << id << " never ended";
    return {};
  }
  void run_until_phase(StrokePhase phase) {
    for (int i = 0; i < 10'000 && (history.empty() || history.back().phase != phase); ++i) tick();
    ASSERT_EQ(history.back().phase, phase);
  }
  std::size_t finals(std::uint64_t id) const {
    return static_cast<std::size_t>(std::count_if(history.begin(), history.end(),
                                                  [&](const StrokeStatus& status) { return status.id == id && is_final(status.phase); }));
  }

  Stand stand{ur5e_config()};
  motion::StrokePlanner planner{support::ur5e(), base_pose(), motion_settings()};
  StrokeExecutor executor{planner, stand.channels};
  std::vector<StrokeStatus> history;
};

}  // namespace breakshot::control::test
