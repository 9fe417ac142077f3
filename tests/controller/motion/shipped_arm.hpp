#pragma once

#include "common/config/cell_config.hpp"
#include "common/random.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/motion/motion_config.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "tests/support/stroke_audit.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace breakshot::motion {

/// The arm and the settings of config/cell.yaml, and what every stroke of it keeps.
class ShippedArm : public testing::Test {
 protected:
  /// Limits that hold for strokes of every kind.
  void expect_within_limits(const support::StrokeAudit& found, const StrokeTimes& times, const Trajectory& trajectory) const {
    EXPECT_LE(found.range, 1e-6);
    EXPECT_LE(found.speed, 1.001);
    EXPECT_LE(found.acceleration, 1.001);
    EXPECT_LE(found.jerk, 1.01);
    EXPECT_LE(found.join, 1e-4);
    EXPECT_TRUE(found.phases_in_order);
    EXPECT_TRUE(found.at_rest_at_ends);
    EXPECT_GE(found.lowest_link, settings_.link_clearance - 1e-4);
    EXPECT_EQ(times.total, static_cast<std::int64_t>(trajectory.size - 1) * settings_.tick);
  }

  /// ... and for those that meet discs.
  void expect_exact(const support::StrokeAudit& found, const StrokeTimes& times, const Trajectory& trajectory) const {
    EXPECT_LE(found.position_error, 0.3e-3);
    EXPECT_LE(found.direction_error, 0.3 * std::numbers::pi / 180.0);
    EXPECT_LE(found.speed_error, 0.01);
    EXPECT_LE(found.height_error, 0.1e-3);
    EXPECT_LE(found.line_deviation, 0.2e-3);
    EXPECT_GE(found.lowest_tip, settings_.tip_height - 0.1e-3);
    EXPECT_LE(found.run_in_height, settings_.run_in_band + 0.1e-3);
    EXPECT_LE(found.corridor_breach, 0.5e-3);
    EXPECT_LE(found.low_outside_dip, 0.2 * settings_.clearance);
    EXPECT_EQ(times.contact, static_cast<std::int64_t>(trajectory.contact_tick) * settings_.tick);
  }

  const ConfigDocument document_ = load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml");
  const CellConfig cell_ = load_cell_config(document_);
  const MotionSettings settings_ = load_motion_settings(document_.root().child("controller").child("motion"), cell_);
  StrokePlanner planner_{load_cell_arm(cell_), cell_.arm.X_WB, settings_};
  SplitMix64 random_{7};
};

}  // namespace breakshot::motion
