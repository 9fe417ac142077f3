// What the simulated arm makes of planned strokes, through the real control loop: nothing here looks at set-points.

#include "common/config/cell_config.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/controller_config.hpp"
#include "controller/flight/drive_lag.hpp"
#include "controller/motion/join.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "sim_bridge/sim_bridge_config.hpp"
#include "tests/support/stroke_audit.hpp"
#include "tests/support/stroke_rig.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <optional>
#include <vector>

namespace breakshot::motion {
namespace {

using support::AchievedStroke;

constexpr double kDegree = std::numbers::pi / 180.0;

class AchievedStrokes : public testing::Test {
 protected:
  support::StrokeRigSettings rig_settings() const {
    support::StrokeRigSettings settings;
    settings.arm = arm_;
    settings.sim = sim_bridge::load_sim_bridge_config(document_, cell_).sim;
    settings.loop = controller_.loop;
    settings.loop.limits = control::joint_limits(arm_, controller_.loop.stop);
    settings.tip_height = controller_.motion.tip_height;
    return settings;
  }

  /// Plans from the park pose; false when the arm cannot.
  bool plan(const StrokeRequest& request) { return static_cast<bool>(planner_.plan(request, controller_.motion.park, *trajectory_)); }

  /// @param nearer  how much nearer than they are thought to be the discs stand, m
  std::vector<SimDisc> discs(const StrokeRequest& request, double nearer = 0.0) const {
    auto discs = support::discs_before(request, {}, controller_.motion.striker_radius);
    for (SimDisc& disc : discs) disc.p_WD -= nearer * request.direction_W;
    return discs;
  }

  const ConfigDocument document_ = load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml");
  const CellConfig cell_ = load_cell_config(document_);
  const control::ControllerConfig controller_ = control::load_controller_config(document_, cell_);
  const ArmDescription arm_ = load_cell_arm(cell_);
  StrokePlanner planner_{arm_, cell_.arm.X_WB, controller_.motion};
  std::unique_ptr<Trajectory> trajectory_ = std::make_unique<Trajectory>();
  SplitMix64 random_{11};
};

class AchievedHits : public AchievedStrokes, public testing::WithParamInterface<double> {};
INSTANTIATE_TEST_SUITE_P(Speeds, AchievedHits, testing::Values(0.3, 0.6, 1.0),
                         [](const auto& instance) { return std::to_string(std::lround(100 * instance.param)) + "cmPerSecond"; });

TEST_P(AchievedHits, MeetTheContactPointOnTheTick) {
  const support::StrokeRig rig{rig_settings()};
  int run = 0;
  while (run < 8) {
    const StrokeRequest hit = support::random_hit(random_, cell_.workspace, GetParam());
    if (!plan(hit)) continue;
    ++run;
    SCOPED_TRACE(testing::Message() << "at " << hit.p_WS.transpose() << " along " << hit.direction_W.transpose());
    const AchievedStroke alone = rig.run(hit, *trajectory_, {});
    EXPECT_EQ(alone.stopped, "");
    EXPECT_FALSE(alone.touch);
    EXPECT_LE(alone.position_error, 0.3e-3);
    EXPECT_LE(alone.direction_error, 0.3 * kDegree);
    EXPECT_LE(alone.speed_error, 0.01);
    EXPECT_LE(alone.height_error, 0.1e-3);
    EXPECT_GT(alone.tracking_error, 0.0) << "this is to be the arm, not its set-points";

    const AchievedStroke struck = rig.run(hit, *trajectory_, discs(hit));
    EXPECT_EQ(struck.stopped, "");
    ASSERT_TRUE(struck.touch);
    EXPECT_LE(struck.touch->position_error, 0.3e-3);
    EXPECT_LE(struck.touch->direction_error, 0.3 * kDegree);
    EXPECT_LE(struck.touch->speed_error, 0.01);
    EXPECT_LE(std::abs(struck.touch->late), 0.25e-3) << "a sub-step of the simulated arm";
  }
}

TEST_P(AchievedHits, AreMeasuredAsFastAsTheyWereBeforeTheDiscSlowedThem) {
  for (const int phase_us : {0, 300, 700}) {
    support::StrokeRigSettings settings = rig_settings();
    settings.phase = std::chrono::microseconds{phase_us};
    const support::StrokeRig rig{settings};
    for (const double nearer : {-0.4e-3, 0.0, 0.4e-3, 0.8e-3}) {
      StrokeRequest hit;
      do hit = support::random_hit(random_, cell_.workspace, GetParam());
      while (!plan(hit));
      const AchievedStroke found = rig.run(hit, *trajectory_, discs(hit, nearer));
      SCOPED_TRACE(testing::Message() << "disc " << 1e3 * nearer << " mm nearer than thought, states " << phase_us << " us old");
      ASSERT_TRUE(found.touch);
      ASSERT_TRUE(found.measured_speed);
      // What it would have had at the contact point, which the arm makes the asked speed (above): nearer or farther, a hit may be speeding up or
      // slowing down.
      EXPECT_NEAR(*found.measured_speed, GetParam(), 0.005 * GetParam());
      EXPECT_NEAR(*found.measured_speed, found.touch->speed, 0.02 * found.touch->speed);
    }
  }
}

TEST_F(AchievedStrokes, PushesStayOnTheirLine) {
  const support::StrokeRig rig{rig_settings()};
  int run = 0;
  while (run < 8) {
    const StrokeRequest push = support::random_push(random_, cell_.workspace);
    if (!plan(push)) continue;
    ++run;
    SCOPED_TRACE(testing::Message() << "at " << push.p_WS.transpose() << " along " << push.direction_W.transpose());
    const AchievedStroke alone = rig.run(push, *trajectory_, {});
    EXPECT_LE(alone.line_deviation, 0.2e-3);
    EXPECT_LE(alone.speed_error, 0.01);
    const AchievedStroke parting = rig.run(push, *trajectory_, discs(push));
    EXPECT_TRUE(parting.touch);
    EXPECT_LE(parting.line_deviation, 0.2e-3) << "with two discs that it parts";
  }
}

// The second of two strokes, each of which runs out of the first in motion: by the loop that goes over from one trajectory to the other.
TEST_F(AchievedStrokes, OutOfAnotherOneTheyAreAsExact) {
  const support::StrokeRig rig{rig_settings()};
  const auto next = std::make_unique<Trajectory>();
  int run = 0;
  while (run < 16) {
    const StrokeRequest first = support::random_hit(random_, cell_.workspace, 0.5);
    const bool hits = run % 2 == 0;
    const StrokeRequest second = hits ? support::random_hit(random_, cell_.workspace, 0.6) : support::random_push(random_, cell_.workspace);
    if (!plan(first)) continue;
    const support::Before before{*trajectory_, first_join(*trajectory_)};
    if (!planner_.plan(second, state_at(*trajectory_, before.tick), *next)) continue;
    ++run;
    SCOPED_TRACE(testing::Message() << to_string(second.kind) << " at " << second.p_WS.transpose() << " along "
                                    << second.direction_W.transpose());
    const AchievedStroke alone = rig.run(second, *next, {}, nullptr, &before);
    EXPECT_EQ(alone.stopped, "");
    EXPECT_LE(alone.position_error, 0.3e-3);
    EXPECT_LE(alone.direction_error, 0.3 * kDegree);
    EXPECT_LE(alone.speed_error, 0.01);
    EXPECT_LE(alone.height_error, 0.1e-3);
    EXPECT_LE(alone.line_deviation, 0.2e-3);
    EXPECT_GT(alone.tracking_error, 0.0) << "this is to be the arm, not its set-points";
    EXPECT_LE(alone.peak_torque_share, 1.0);
    ASSERT_TRUE(alone.measured_speed || !hits);
    if (hits) {
      EXPECT_NEAR(*alone.measured_speed, second.speed, 0.01 * second.speed);
    }
  }
}

// A delay that is not what the controller was told is no matter of the path, only of the time: it shows at the contact tick and nowhere else.
TEST_F(AchievedStrokes, AWrongDelayIsSeenAtTheContactTick) {
  support::StrokeRigSettings settings = rig_settings();
  settings.sim.drives.lag += std::chrono::milliseconds{3};
  const support::StrokeRig rig{settings};
  StrokeRequest hit;
  do hit = support::random_hit(random_, cell_.workspace, 0.6);
  while (!plan(hit));
  const AchievedStroke found = rig.run(hit, *trajectory_, {});
  EXPECT_NEAR(found.position_error, 0.6 * 3e-3, 0.2e-3);
  EXPECT_LE(found.direction_error, 0.3 * kDegree);
}

TEST_F(AchievedStrokes, TheDelayIsFoundFromWhatWasCommandedAndMeasured) {
  for (const int lag_us : {0, 2000, 3300, 8000}) {
    support::StrokeRigSettings settings = rig_settings();
    settings.sim.drives.lag = std::chrono::microseconds{lag_us};
    settings.phase = std::chrono::microseconds{400};
    StrokeRequest hit;
    do hit = support::random_hit(random_, cell_.workspace, 0.6);
    while (!plan(hit));
    std::vector<control::TickRecord> ticks;
    support::StrokeRig{settings}.run(hit, *trajectory_, {}, &ticks);
    const auto found = control::flight::find_drive_lag(ticks, controller_.loop.drive_lag);
    ASSERT_TRUE(found) << found.error();
    EXPECT_NEAR(to_seconds(found->lag), 1e-6 * lag_us, 0.05e-3);
    EXPECT_LE(found->residual, found->residual_configured);
    EXPECT_LE(found->residual, 50e-6);
    ASSERT_EQ(found->joint_lag.size(), 6U);
    EXPECT_NEAR(to_seconds(found->joint_lag[0]), 1e-6 * lag_us, 0.3e-3);
  }
}

TEST_F(AchievedStrokes, AnArmAtRestTellsNoDelay) {
  std::vector<control::TickRecord> ticks(1000);
  const auto found = control::flight::find_drive_lag(ticks, controller_.loop.drive_lag);
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().find("0 joint states"), std::string::npos) << found.error();
}

}  // namespace
}  // namespace breakshot::motion
