#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/formation.hpp"
#include "common/task.hpp"
#include "controller/loop/control_loop.hpp"
#include "controller/loop/stroke_executor.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "perception/joint_history.hpp"
#include "perception/perceiver.hpp"
#include "planner/arm_filter.hpp"
#include "planner/estimate/table_estimate.hpp"
#include "planner/strategy/strategy.hpp"
#include "planner/task/task_runner.hpp"
#include "sim_bridge/camera/camera.hpp"
#include "sim_bridge/world/sim_world.hpp"
#include "tests/support/noise_model_camera.hpp"

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::support {

/// What sees the table.
enum class Sight : std::uint8_t {
  kRendered,    ///< the simulator's camera and perception
  kNoiseModel,  ///< NoiseModelCamera
};

/// Everything that the libraries of the cell are built from, as their processes read it from one configuration.
struct InProcessSettings {
  CellConfig cell;
  ArmDescription arm;
  CameraModel camera_model;
  sim_bridge::SimSettings sim;
  sim_bridge::CameraSettings camera;
  double disc_mass = 0.1;  ///< of a disc of disc_mass_radius; others by their area, kg
  double disc_mass_radius = 0.030;
  Sight sight = Sight::kRendered;
  PerceptionErrors perception_errors;  ///< of Sight::kNoiseModel
  motion::MotionSettings motion;
  control::LoopConfig loop;
  perception::PerceptionSettings perception;
  strategy::StrategySettings strategy;
  task::TaskSettings task;
  estimate::EstimateSettings estimate;
  bool learn = true;    ///< strategies are told what strokes taught
  bool ask_arm = true;  ///< strategies ask the motion library whether the arm can run a stroke
  Duration frame_period{};
  Duration camera_latency{};
  /// What the cell clock is charged for a decision and for planning a stroke. Fixed, because measured times would make runs differ; the
  /// measured ones are reported beside it.
  Duration think_charge = std::chrono::milliseconds{20};
  /// The same for `robust`, which thinks longer: about its slowest decisions about six discs.
  Duration robust_think_charge = std::chrono::milliseconds{200};
  /// The same for a decision that `robust` corrects for the scene that settled: a correction's p99 is a tenth to a fifth of a decision's
  /// (docs/results.md), and the stroke is planned after it, too.
  Duration robust_revise_charge = std::chrono::milliseconds{50};
  /// Of a stroke that is sent without a decision just before it (it was decided ahead of the scene, or another one was refused): planning it.
  Duration stroke_charge = std::chrono::milliseconds{20};
  /// Until a decision that nobody waits for any more has ended and the next one can begin: the question to the arm that it is at, at most.
  Duration give_up_charge = std::chrono::milliseconds{20};
};

/// Reads a cell configuration as the processes do. @throws ConfigError, ArmDescriptionError
InProcessSettings load_in_process_settings(const std::string& config_file, const std::vector<std::string>& overrides = {});

/// How the world of an episode differs from what the configuration says. The planner is told none of it.
struct EpisodeWorld {
  sim_bridge::TablePhysics physics;
  Duration camera_latency{};
  // Every stroke runs a little off what was asked, by draws within these half widths.
  double stroke_speed_spread = 0.0;  ///< relative
  double aim_spread = 0.0;           ///< of the direction, about the contact or start point, rad
  std::uint64_t seed = 0;            ///< of these errors, of random strategies and of the camera's noise
};

/// A look at the table that was decided on.
struct DecisionPoint {
  std::size_t pairs = 0;  ///< below the order's gap
  Time at{};
  Duration left{};  ///< from then to the end of the order
};

/// What an order came to.
struct EpisodeResult {
  TaskStatus task;                             ///< as the planner sees it
  std::vector<SimDisc> truth;                  ///< where the discs truly rest
  double true_gap = 0.0;                       ///< smallest gap in truth, m
  int truly_lost = 0;                          ///< discs outside the region or off the table
  Duration duration{};                         ///< of the cell clock, from the order to its end
  std::vector<double> decision_s;              ///< measured time of each decision
  std::vector<double> decision_cpu_s;          ///< and the CPU time in it, which other programs on the machine lengthen less
  std::vector<double> revision_cpu_s;          ///< the same of corrections
  task::AheadCounts ahead;                     ///< what became of decisions begun before the scene had settled
  std::vector<strategy::TableBelief> beliefs;  ///< after each stroke, about the whole table
  std::vector<DecisionPoint> decisions;        ///< those that were not mere corrections
  std::vector<Plan> plans;                     ///< every stroke that was asked for, in order
  std::vector<std::vector<SimDisc>> tables;    ///< where the discs truly were when each was
  std::vector<Outcome> outcomes;               ///< of those that ran: Outcome::plan_seq names the plan
  std::uint32_t strikes = 0;
};

/// The whole cell in one thread, without DDS: world, drives, camera, perception, planner, motion and control loop are the very libraries
/// that the processes are made of, joined by function calls in lockstep.
///
/// Deterministic: bit-identical for the same settings, discs and seed, on the same binary and machine. Frames that nobody would look at
/// are not rendered. Runs 5 to 20 times faster than real time.
class InProcessCell {
 public:
  /// Starts GL when it renders, which takes half a second: keep the cell for many episodes. @throws whatever the libraries refuse
  explicit InProcessCell(const InProcessSettings& settings);
  ~InProcessCell();
  InProcessCell(const InProcessCell&) = delete;
  InProcessCell& operator=(const InProcessCell&) = delete;

  /// Puts the arm to its park pose and the formation on the table, and runs one order to its end.
  ///
  /// @param world   the truth of this episode
  /// @param learnt  what orders before this one taught, and where this one's lessons go; null: the planner begins with its prior knowledge
  EpisodeResult run(const Formation& formation, const TaskRequest& request, const std::string& strategy, const EpisodeWorld& world,
                    estimate::TableEstimate* learnt = nullptr);

  const InProcessSettings& settings() const noexcept { return settings_; }
  /// An order as the gateway would pass it on when the MES leaves everything to the cell.
  TaskRequest default_request() const;

 private:
  struct Episode;
  void tick(Episode& episode);
  void look(Episode& episode);
  bool looked_at(const Episode& episode, const sim_bridge::WorldSnapshot& snapshot) const;
  Scene see(Episode& episode, const sim_bridge::WorldSnapshot& snapshot, std::uint64_t frame);
  /// Asks the strategy; the answer comes when the charged time has passed.
  void think(Episode& episode, const task::RunStrategy& question);
  void carry_out(Episode& episode);

  InProcessSettings settings_;
  std::optional<sim_bridge::Camera> camera_;
  motion::StrokePlanner stroke_planner_;  // the controller's
  motion::StrokePlanner planners_stroke_planner_;
  planner::ArmFilter arm_filter_{planners_stroke_planner_};
  std::uint64_t frames_ = 0;
};

}  // namespace breakshot::support
