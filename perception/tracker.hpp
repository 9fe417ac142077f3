#pragma once

#include "common/scene.hpp"
#include "common/time.hpp"
#include "perception/settings.hpp"

#include <cstdint>
#include <vector>

namespace breakshot::perception {

/// Gives discs their identities from frame to frame, and so their velocities.
///
/// It never adds a disc to a scene. A disc that was not seen for a while (behind the arm) gets its old identity back when it shows up near
/// where it was last seen; after kForget it would get a new one.
class Tracker {
 public:
  explicit Tracker(const PerceptionSettings& settings);

  /// Fills SceneDisc::id and v_WD_W, and Scene::max_speed: infinity when a disc came or went since the last frame (so also in the first one).
  void update(Scene& scene);
  /// To be called for a frame that showed nothing usable: velocities start anew, identities stay.
  void interrupt() noexcept { continuous_ = false; }

 private:
  struct Track {
    std::uint32_t id;
    std::uint8_t colour;
    Vector2 p_WD, v_WD_W;
    Time seen;
    bool in_last_frame;
  };
  struct Match {
    double distance;
    std::size_t track, disc;
  };

  const PerceptionSettings& settings_;
  std::vector<Track> tracks_;
  std::vector<Match> matches_;
  std::uint32_t next_id_ = 1;
  bool continuous_ = false;
};

}  // namespace breakshot::perception
