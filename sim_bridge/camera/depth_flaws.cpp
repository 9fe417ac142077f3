#include "sim_bridge/camera/depth_flaws.hpp"

#include "common/random.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

namespace breakshot::sim_bridge {
namespace {

constexpr int kJump = 80;           // 0.1 mm: where depth differs by more is a rim; a disc is 20 mm high
constexpr int kRimWidth = 2;        // px at least, of what counts as beside a rim
constexpr float kHiddenBy = 0.25F;  // px; a level table seen through rounded depths hides nothing of itself
constexpr std::uint16_t kNothing = std::numeric_limits<std::uint16_t>::max();

/// As something that hides nothing.
constexpr std::uint16_t or_nothing(std::uint16_t depth) { return depth == 0 ? kNothing : depth; }

}  // namespace

DepthFlaws::DepthFlaws(const DepthFlawSettings& settings, double focal, double baseline, std::uint64_t seed)
    : settings_{settings}, seed_{seed} {
  if (!(settings.holes >= 0.0 && settings.holes <= 1.0)) {
    throw CameraError{"camera: depth_flaws.holes: found " + std::to_string(settings.holes) + "; allowed 0 to 1"};
  }
  if (!(settings.bleed >= 0.0 && settings.bleed <= 8.0)) {
    throw CameraError{"camera: depth_flaws.bleed in px: found " + std::to_string(settings.bleed) + "; allowed 0 to 8"};
  }
  if (!settings.shadow) return;
  disparity_.resize(std::size_t{kNothing} + 1, 0.0F);
  for (std::size_t z = 1; z < disparity_.size(); ++z)
    disparity_[z] = static_cast<float>(focal * baseline / (1e-4 * static_cast<double>(z)));
}

double DepthFlaws::draw(int x, int y, std::uint64_t frame, std::uint64_t use) const {
  const auto block = static_cast<std::uint64_t>(y / kBlock) * 65536U + static_cast<std::uint64_t>(x / kBlock);
  SplitMix64 random{SplitMix64{seed_ + 4 * frame + use}.next() ^ SplitMix64{block}.next()};
  return random.uniform();
}

void DepthFlaws::roughen(std::span<const std::uint16_t> ideal, int width, const PixelRect& run, std::uint64_t frame,
                         std::span<std::uint16_t> flawed) {
  const int height = static_cast<int>(ideal.size()) / width;
  const int reach = std::max(kRimWidth, static_cast<int>(std::ceil(settings_.bleed)));
  const auto at = [&](int x, int y) { return or_nothing(ideal[pixel_index(x, y, width)]); };
  const int top = std::max(run.y - reach, 0), bottom = std::min(run.y + run.height + reach, height);
  // Smallest depth in a square window, first along the rows, then down.
  nearest_.resize(area(run.width, bottom - top));
  for (int y = top; y < bottom; ++y) {
    std::uint16_t* out = &nearest_[pixel_index(0, y - top, run.width)];
    for (int i = 0; i < run.width; ++i) out[i] = at(run.x + i, y);
    for (int shift = -reach; shift <= reach; ++shift) {
      for (int i = std::max(0, -(run.x + shift)); i < std::min(run.width, width - run.x - shift); ++i)
        out[i] = std::min(out[i], at(run.x + i + shift, y));
    }
  }
  const auto nearest_within = [&](int x, int y, int within) {
    std::uint16_t nearest = kNothing;
    for (int v = std::max(y - within, 0); v <= std::min(y + within, height - 1); ++v) {
      for (int u = std::max(x - within, 0); u <= std::min(x + within, width - 1); ++u) nearest = std::min(nearest, at(u, v));
    }
    return nearest;
  };
  for (int y = run.y; y < run.y + run.height; ++y) {
    for (int i = 0; i < run.width; ++i) {
      const int x = run.x + i, own = ideal[pixel_index(x, y, width)];
      if (own == 0) continue;
      std::uint16_t nearest = kNothing;
      for (int v = std::max(y - reach, top); v < std::min(y + reach + 1, bottom); ++v)
        nearest = std::min(nearest, nearest_[pixel_index(i, v - top, run.width)]);
      if (own - nearest <= kJump) continue;
      std::uint16_t& out = flawed[pixel_index(x, y, width)];
      const auto within = static_cast<int>(std::lround(settings_.bleed * draw(x, y, frame, 0)));
      if (within > 0) {
        const std::uint16_t over = nearest_within(x, y, within);
        if (own - over > kJump) out = over;
      }
      if (settings_.holes > 0.0 && draw(x, y, frame, 1) < settings_.holes) out = 0;
    }
  }
}

void DepthFlaws::shade_row(std::span<std::uint16_t> row, int end) {
  // From the right: the second camera sees pixel x at x - disparity, and of two at the same place the nearer one.
  float leftmost = std::numeric_limits<float>::max();
  for (int x = end - 1; x >= 0; --x) {
    std::uint16_t& depth = row[static_cast<std::size_t>(x)];
    if (depth == 0) continue;
    const float seen = static_cast<float>(x) - disparity_[depth];
    if (seen > leftmost + kHiddenBy) depth = 0;
    leftmost = std::min(leftmost, seen);
  }
}

void DepthFlaws::apply(std::span<const std::uint16_t> ideal, int width, const TileGrid& raised, std::uint64_t frame,
                       std::span<std::uint16_t> flawed) {
  std::copy(ideal.begin(), ideal.end(), flawed.begin());
  if (settings_.holes > 0.0 || settings_.bleed > 0.0) {
    raised.for_each_run([&](const PixelRect& run) { roughen(ideal, width, run, frame, flawed); });
  }
  if (!settings_.shadow) return;
  // A row is gone through from the last run in it, once: runs come from left to right.
  std::optional<PixelRect> last;
  const auto shade = [&](const PixelRect& run) {
    for (int y = run.y; y < run.y + run.height; ++y) {
      shade_row(flawed.subspan(pixel_index(0, y, width), static_cast<std::size_t>(width)), run.x + run.width);
    }
  };
  raised.for_each_run([&](const PixelRect& run) {
    if (last && last->y != run.y) shade(*last);
    last = run;
  });
  if (last) shade(*last);
}

}  // namespace breakshot::sim_bridge
