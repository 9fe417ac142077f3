#include "tests/bench/perception/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::bench {
namespace {

constexpr double kBeside = 0.75;  // probability that a disc is put beside another
constexpr double kCover = 0.35;   // share of the workspace that discs cover at most, or random places run out
constexpr int kTries = 400;       // places for one disc, then the scene is drawn anew
constexpr double kBorder = 0.02;  // m by which centres may lie nearer to the image's upper and lower border than a whole 30 mm disc

using sim_bridge::DiscState;

}  // namespace

std::vector<DiscState> SceneMaker::make() {
  const bool one_size = scenes_++ % 2 == 0;
  for (;;) {
    const int n = options_.discs_min + static_cast<int>(random_() % static_cast<unsigned>(options_.discs_max - options_.discs_min + 1));
    const double area = 0.6 * 0.6 * kCover / n;
    const double largest = std::clamp(std::sqrt(area / std::numbers::pi), cell_.disc_radius_min, cell_.disc_radius_max);
    const auto first_colour = static_cast<std::size_t>(random_());
    std::vector<DiscState> discs;
    int tries = 0;
    while (static_cast<int>(discs.size()) < n && ++tries < kTries * n) {
      DiscState disc;
      disc.radius = one_size ? std::min(0.030, largest) : uniform(cell_.disc_radius_min, largest);
      disc.colour = static_cast<std::uint8_t>((first_colour + (options_.equal_colours ? 0 : discs.size())) % cell_.colours.size());
      const double reach = 0.29 + kBorder - disc.radius;  // the image ends at 0.31 m
      disc.p_WD = {uniform(-0.3, 0.3), uniform(-reach, reach)};
      if (!discs.empty() && uniform(0.0, 1.0) < kBeside) {
        const DiscState& host = discs[random_() % discs.size()];
        const double distance = host.radius + disc.radius + uniform(0.0, options_.gap_max), bearing = uniform(0.0, 2.0 * std::numbers::pi);
        disc.p_WD = host.p_WD + distance * Vector2{std::cos(bearing), std::sin(bearing)};
      }
      if (std::abs(disc.p_WD.x()) > 0.3 || std::abs(disc.p_WD.y()) > reach) continue;
      const bool free = std::all_of(discs.begin(), discs.end(),
                                    [&](const DiscState& d) { return (d.p_WD - disc.p_WD).norm() >= d.radius + disc.radius; });
      if (free) discs.push_back(disc);
    }
    if (static_cast<int>(discs.size()) == n) return discs;
  }
}

}  // namespace breakshot::bench
