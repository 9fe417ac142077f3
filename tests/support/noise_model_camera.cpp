#include "tests/support/noise_model_camera.hpp"

#include "common/random.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::support {

Scene NoiseModelCamera::look(const sim_bridge::WorldSnapshot& world, std::uint64_t frame) {
  SplitMix64 random{0x5DEECE66DU * (frame + 1)};
  Scene scene;
  scene.seq = ++scenes_;
  scene.frame_seq = frame;
  scene.exposed = world.stamp;
  for (const SimDisc& disc : world.discs) {
    const Vector2 error{random.normal(), random.normal()};
    const double radius_error = random.normal();
    if (!disc.on_table) continue;
    SceneDisc seen;
    seen.p_WD = disc.p_WD + errors_.centre_sigma * error;
    seen.covariance = errors_.centre_sigma * errors_.centre_sigma * Matrix2::Identity();
    seen.radius = disc.radius + errors_.radius_sigma * radius_error;
    seen.radius_sigma = errors_.radius_sigma;
    seen.colour = disc.colour;
    scene.discs.push_back(seen);
  }
  tracker_.update(scene);
  for (std::size_t a = 0; a < scene.discs.size(); ++a) {
    for (std::size_t b = a + 1; b < scene.discs.size(); ++b) {
      const SceneDisc& one = scene.discs[a];
      const SceneDisc& other = scene.discs[b];
      const double gap = (one.p_WD - other.p_WD).norm() - one.radius - other.radius;
      if (gap > settings_.touch_gap) continue;
      SceneContact contact;
      contact.a = static_cast<std::uint16_t>(a);
      contact.b = static_cast<std::uint16_t>(b);
      contact.gap = gap;
      const double sigma = std::max(1e-9, std::sqrt(2.0) * std::hypot(errors_.centre_sigma, errors_.radius_sigma));
      contact.p_touch = 0.5 * std::erfc((gap - settings_.touch_gap) / (sigma * std::sqrt(2.0)));
      scene.contacts.push_back(contact);
    }
  }
  return scene;
}

}  // namespace breakshot::support
