#pragma once

#include "common/scene.hpp"
#include "perception/tracker.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <cstdint>

namespace breakshot::support {

/// What perception is wrong by, by `./breakshot bench perception`.
struct PerceptionErrors {
  double centre_sigma = 25e-6;  ///< along each axis, m
  double radius_sigma = 30e-6;  ///< m; with it, gaps are off by 0.055 mm RMS (measured: 0.064 mm)
};

/// Stands in for camera and perception: the scene that they would report, drawn from the truth by their measured errors.
///
/// For benchmarks of thousands of episodes, which rendering would make ten times as long; `bench singulation` holds it against the real thing on the
/// same episodes. It knows nothing of light, occlusion and contours, so it gives pushes no axis but the tangent of the circles.
class NoiseModelCamera {
 public:
  /// @param settings  outlives the camera
  explicit NoiseModelCamera(const perception::PerceptionSettings& settings, const PerceptionErrors& errors = {})
      : settings_{settings}, errors_{errors}, tracker_{settings} {}

  /// The scene of one frame.
  /// @param frame  chooses the noise: the same frame of the same world gives the same scene
  Scene look(const sim_bridge::WorldSnapshot& world, std::uint64_t frame);

 private:
  const perception::PerceptionSettings& settings_;
  PerceptionErrors errors_;
  perception::Tracker tracker_;
  std::uint64_t scenes_ = 0;
};

}  // namespace breakshot::support
