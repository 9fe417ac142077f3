#pragma once

#include "common/scene.hpp"
#include "common/time.hpp"
#include "perception/settings.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace breakshot::perception {

/// Gives discs their identities from frame to frame, and so their velocities, and says when they rest.
///
/// Rest is said of a disc as soon as a line through its last places, two of them or more, is so flat that its slope is below kRestSpeed with 95 %
/// confidence. What places err from frame to frame is learnt from discs that hardly move: it is far less than their covariance, most of which
/// is the same in every frame that shows the disc in the same place.
///
/// It never adds a disc to a scene. A disc that was not seen for a while (behind the arm) gets its old identity back when it shows up near
/// where it was last seen; after kForget it would get a new one.
class Tracker {
 public:
  explicit Tracker(const PerceptionSettings& settings);

  /// Fills SceneDisc::id and v_WD_W, Scene::at_rest and Scene::max_speed: infinity when a disc came or went since the last frame (so also in the first one).
  void update(Scene& scene);
  /// To be called for a frame that showed nothing usable: velocities start anew, identities stay.
  void interrupt() noexcept { continuous_ = false; }

 private:
  struct Place {
    Time seen{};
    Vector2 p_WD{0.0, 0.0};
  };
  static constexpr std::size_t kPlaces = 6;
  struct Track {
    std::uint32_t id;
    std::uint8_t colour;
    Vector2 p_WD, v_WD_W;
    Time seen;
    bool in_last_frame;
    std::array<Place, kPlaces> places{};  // of consecutive frames, the newest first
    std::size_t held = 0;
  };
  struct Match {
    double distance;
    std::size_t track, disc;
  };

  static void remember(Track& track, bool follows) noexcept;
  bool rests(const Track& track) const noexcept;
  void learn_noise(double moved) noexcept;

  const PerceptionSettings& settings_;
  double noise2_;  // variance of a place from frame to frame along one axis, m^2
  std::vector<Track> tracks_;
  std::vector<Match> matches_;
  std::uint32_t next_id_ = 1;
  bool continuous_ = false;
};

}  // namespace breakshot::perception
