#pragma once

#include "common/stroke.hpp"
#include "common/urdf/arm_description.hpp"
#include "controller/kinematics/arm_kinematics.hpp"
#include "controller/loop/flight_tap.hpp"
#include "controller/loop/loop_config.hpp"
#include "controller/motion/trajectory.hpp"
#include "sim_bridge/world/sim_world.hpp"
#include "tests/support/before.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace breakshot::support {

/// What the simulated arm made of a stroke: the simulator's truth, not what the controller measured (but for the last figures).
struct AchievedStroke {
  std::string stopped;  ///< why the loop gave the stroke up; empty: it ran to its end
  // A hit, at the instant at which the controller reckons the contact: always a tick. No disc needed.
  double position_error = 0.0;  ///< of the rod's axis from StrokeRequest::p_WS, m
  double direction_error =
      0.0;                    ///< of its velocity from StrokeRequest::direction_W, table plane, rad; a push: largest on its line's cruise
  double speed_error = 0.0;   ///< relative; a push: largest on its line's cruise
  double height_error = 0.0;  ///< of the tip from MotionSettings::tip_height, m; a push: largest on its line

  double line_deviation = 0.0;  ///< a push: largest distance of the axis from its line while on it, m

  /// The same at the first touch of a disc, one instant before the impulse; empty when none was touched.
  struct Touch {
    double position_error = 0.0, direction_error = 0.0, speed_error = 0.0;  ///< m, rad, relative
    double late = 0.0;                                                      ///< after the instant that the controller reckons, s
    double speed = 0.0;                                                     ///< of the rod along direction_W, m/s
  };
  std::optional<Touch> touch;
  std::uint32_t strikes = 0;   ///< times that the rod came to a disc
  std::vector<SimDisc> discs;  ///< where they are in the end

  /// LoopEvent::kContact in terms of the tip: speed along direction_W, m/s. What StrokeStatus::contact_speed says.
  std::optional<double> measured_speed;
  double tracking_error = 0.0;     ///< largest distance of a joint from its set-point of drive_lag ago, rad
  double peak_torque_share = 0.0;  ///< of the drives' torque limits, 1: one saturated
};

struct StrokeRigSettings {
  ArmDescription arm;
  sim_bridge::SimSettings sim;  ///< X_WB of the cell; q_start and start are set per stroke
  control::LoopConfig loop;     ///< with the joints' limits
  double tip_height = 0.008;    ///< MotionSettings::tip_height, m
  /// From a joint state's stamp to the loop's tick. 0 in lockstep; else the contact lies between two states.
  Duration phase{};
};

/// Runs finished trajectories through the real control loop into the simulated arm, in lockstep, each in a world of its own. Reentrant.
class StrokeRig {
 public:
  explicit StrokeRig(StrokeRigSettings settings);

  /// @param trajectory  of `request`, from rest or out of `before`
  /// @param discs       on the table
  /// @param ticks       gets every tick of the loop, as its flight recorder does; may be null
  /// @param before      what runs first, from rest, so that the loop goes over into `trajectory` in motion; null: nothing does
  /// @throws std::invalid_argument for discs that cannot be placed
  AchievedStroke run(const StrokeRequest& request, const motion::Trajectory& trajectory, std::span<const SimDisc> discs,
                     std::vector<control::TickRecord>* ticks = nullptr, const Before* before = nullptr) const;

  const StrokeRigSettings& settings() const noexcept { return settings_; }

 private:
  StrokeRigSettings settings_;
  kinematics::ArmKinematics kinematics_;
};

/// The discs that a stroke is meant for, where it is to meet them: a hit, one disc that it touches at p_WS, head-on; a push, two touching discs
/// of which its line is the common tangent, met 10 mm after its start.
std::vector<SimDisc> discs_before(const StrokeRequest& request, const SimDisc& kind, double striker_radius);

}  // namespace breakshot::support
