#include "perception/table_light.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace breakshot::perception {
namespace {

constexpr int kStep = 8;         // px between samples: 14400 of 1280 x 720
constexpr int kWhite = 250;      // from here on a channel counts as clipped
constexpr int kFaint = 6;        // darker samples have no hue worth the name
constexpr int kReach = 3;        // bins around the most frequent hue that still are the table: a fifth of an octave
constexpr double kLeast = 0.08;  // share of the picture that the table takes at least: fifty discs and the arm leave more
// Lamps change a colour along one line of (log2 r/g, log2 b/g): from 6500 K to 2700 K by (0.66, -1.0) in encoded values (CIE daylight and
// Planck's law in sRGB, power law of about 2). `along` counts towards warm.
constexpr double kAlongU = 0.55, kAlongV = -0.83;
constexpr double kCoolest = -0.75, kWarmest = 2.0;  // octaves: about 15000 K to 2000 K
constexpr double kTint = 0.40;                      // octaves off that line: fluorescent lamps, light thrown back by walls

struct Lamp {
  double along, across;
};
Lamp lamp(double u, double v) noexcept { return {kAlongU * u + kAlongV * v, -kAlongV * u + kAlongU * v}; }

// The middle of the values that a histogram holds.
int median(const std::array<int, 256>& histogram, int count) noexcept {
  int below = 0;
  for (int value = 0; value < 256; ++value) {
    below += histogram[static_cast<std::size_t>(value)];
    if (2 * below >= count) return value;
  }
  return 255;
}

}  // namespace

LightMeter::LightMeter(const std::array<double, 3>& table_rgb)
    : table_rgb_{table_rgb},
      log2_{},
      u0_{static_cast<int>(std::lround(kBinsPerOctave * std::log2(table_rgb[0] / table_rgb[1])))},
      v0_{static_cast<int>(std::lround(kBinsPerOctave * std::log2(table_rgb[2] / table_rgb[1])))},
      counts_(static_cast<std::size_t>(kSide) * kSide) {
  for (std::size_t i = 0; i < log2_.size(); ++i) {
    log2_[i] = static_cast<std::int16_t>(std::lround(kBinsPerOctave * std::log2(std::max<double>(1.0, static_cast<double>(i)))));
  }
}

bool LightMeter::plausible(int u, int v) const noexcept {
  const auto [along, across] = lamp(static_cast<double>(u) / kBinsPerOctave, static_cast<double>(v) / kBinsPerOctave);
  return along >= kCoolest && along <= kWarmest && std::abs(across) <= kTint;
}

std::optional<TableLight> LightMeter::measure(const ColorFrame& frame, std::string& why) {
  std::fill(counts_.begin(), counts_.end(), 0);
  samples_.clear();
  int seen = 0, white = 0, grey = 0;
  const auto width = static_cast<std::size_t>(frame.width);
  for (int y = kStep / 2; y < frame.height; y += kStep) {
    const std::uint8_t* row = frame.rgb.data() + static_cast<std::size_t>(y) * width * 3;
    for (int x = kStep / 2; x < frame.width; x += kStep) {
      const std::uint8_t* p = row + 3 * x;
      ++seen;
      white += std::min({p[0], p[1], p[2]}) >= kWhite ? 1 : 0;
      grey += p[0] == p[1] && p[1] == p[2] ? 1 : 0;
      if (std::max({p[0], p[1], p[2]}) < kFaint) continue;
      const int u = log2_[p[0]] - log2_[p[1]] - u0_, v = log2_[p[2]] - log2_[p[1]] - v0_;
      if (std::abs(u) > kHalf || std::abs(v) > kHalf) continue;
      ++counts_[static_cast<std::size_t>((u + kHalf) * kSide + v + kHalf)];
      samples_.push_back({p[0], p[1], p[2], static_cast<std::int16_t>(u), static_cast<std::int16_t>(v)});
    }
  }
  const double share_of_white = static_cast<double>(white) / seen;
  if (white == seen) {
    why = "found nothing but white: overexposed";
    return std::nullopt;
  }
  if (grey == seen) {
    why = "found no colour: red, green and blue are equal everywhere; discs are told by their colours";
    return std::nullopt;
  }

  // The most frequent hue, each counted with its neighbours: noise and rounding spread it over some.
  const auto around = [&](int u, int v) {
    int sum = 0;
    for (int i = std::max(0, u - 1); i <= std::min(kSide - 1, u + 1); ++i) {
      for (int k = std::max(0, v - 1); k <= std::min(kSide - 1, v + 1); ++k) sum += counts_[static_cast<std::size_t>(i * kSide + k)];
    }
    return sum;
  };
  int most = 0, most_anywhere = 0, best_u = 0, best_v = 0;
  int odd_u = 0, odd_v = 0;
  for (int u = 0; u < kSide; ++u) {
    for (int v = 0; v < kSide; ++v) {
      if (counts_[static_cast<std::size_t>(u * kSide + v)] == 0) continue;
      const int count = around(u, v);
      if (count > most_anywhere) {
        most_anywhere = count;
        odd_u = u - kHalf;
        odd_v = v - kHalf;
      }
      if (count <= most || !plausible(u - kHalf, v - kHalf)) continue;
      most = count;
      best_u = u - kHalf;
      best_v = v - kHalf;
    }
  }

  std::array<std::array<int, 256>, 3> histograms{};
  int table = 0;
  for (const Sample& s : samples_) {
    if (std::abs(s.u - best_u) > kReach || std::abs(s.v - best_v) > kReach) continue;
    ++table;
    ++histograms[0][s.r];
    ++histograms[1][s.g];
    ++histograms[2][s.b];
  }
  TableLight light;
  light.clipped_share = share_of_white;
  light.table_share = static_cast<double>(table) / seen;
  if (most == 0 || light.table_share < kLeast) {
    why = "found no table: its colour takes " + std::to_string(static_cast<int>(100.0 * light.table_share)) +
          " % of the picture under any lamp; at least " + std::to_string(static_cast<int>(100.0 * kLeast)) + " % is needed";
    const double along = lamp(static_cast<double>(odd_u) / kBinsPerOctave, static_cast<double>(odd_v) / kBinsPerOctave).along;
    if (most_anywhere > seen / 4 && along < kCoolest) why += " (most of it is bluer than any lamp makes it: are red and blue swapped?)";
    return std::nullopt;
  }
  for (std::size_t c = 0; c < 3; ++c) light.gain[c] = table_rgb_[c] / std::max(1, median(histograms[c], table));
  return light;
}

}  // namespace breakshot::perception
