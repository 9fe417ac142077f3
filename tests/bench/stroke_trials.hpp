#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "common/random.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "tests/bench/path_bound.hpp"
#include "tests/support/stroke_audit.hpp"
#include "tests/support/stroke_rig.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::bench {

/// What the trials are made with, as the processes read it from one configuration.
struct TrialSetup {
  CellConfig cell;
  motion::MotionSettings motion;
  support::StrokeRigSettings rig;
  SimDisc disc;  ///< the configuration's own; its place is of no meaning
};

/// @throws ConfigError, ArmDescriptionError
TrialSetup load_trial_setup(const std::string& config_file, const std::vector<std::string>& overrides);

/// A push's line in joint space, with what its duration is held against.
struct PushPath {
  JointPath path;
  double planned = 0.0;  ///< s
  double least = 0.0;    ///< s; 0: no bound found
};

/// One stroke: asked, planned or refused, measured, run.
struct Trial {
  StrokeRequest request;
  double speed_bound = 0.0;  ///< StrokePlanner::speed_bound, m/s; 0 for a park
  double plan_ms = 0.0;      ///< CPU time of the plan or the refusal
  std::optional<motion::Refusal> refusal;

  // Of an accepted one.
  motion::StrokeTimes times;
  support::StrokeAudit planned;
  double over_bound = 0.0;  ///< the ways to and from the contact (a push: the line) over their joint-space bound; 0 for a park
  std::optional<PushPath> push;
  /// The same stroke out of the one before it in motion: the time of the two over that of the two apart. 0: no way, or it does not follow one.
  double over_separate = 0.0;
  bool follows = false;                               ///< a stroke that it could take over from was before it
  std::string broken;                                 ///< limits that the set-points break, and by how much; empty: none
  std::optional<support::AchievedStroke> alone;       ///< run on an empty table
  std::optional<support::AchievedStroke> with_discs;  ///< run into support::discs_before()

  /// The rod of an accepted hit comes back to the disc that it struck head-on. Slower ones do not bounce off (sim_bridge's striker_bounce_speed).
  bool meets_disc_twice() const noexcept {
    constexpr double kBounces = 0.2;  // m/s
    return !refusal && request.kind == StrokeKind::kHit && request.speed > kBounces && !(planned.struck_disc_gap > 0.0);
  }
};

/// How much is done to each stroke.
struct TrialScope {
  bool bounds = true;    ///< lower bounds of its duration
  bool achieved = true;  ///< run in the simulator
};

using RequestSource = std::function<StrokeRequest(SplitMix64&)>;

/// Strokes in sequences of kSequence, each stroke from where the last one ended and the first from the park pose; half of them park.
/// The same seed gives the same strokes, on however many threads.
inline constexpr int kSequence = 50;
std::vector<Trial> run_trials(const TrialSetup& setup, const RequestSource& source, int n, std::uint64_t seed, TrialScope scope,
                              int threads);

}  // namespace breakshot::bench
