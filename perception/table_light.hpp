#pragma once

#include "common/frames.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::perception {

/// What the light does to the picture, told by the table, whose colour is known.
struct TableLight {
  std::array<double, 3> gain{1.0, 1.0, 1.0};  ///< factors on encoded red, green, blue that bring the table back to its known colour
  double table_share = 0.0;                   ///< of the picture that has the table's hue under this light
  double clipped_share = 0.0;                 ///< of the picture that is white in all three channels: what is brighter cannot be told
};

/// Measures white balance and exposure on the part of the picture that nobody paints: the table.
///
/// Light multiplies the channels, and a power law keeps that so for encoded values; the table then shows as the most frequent hue among those
/// that lamps from candle light to blue sky give to its colour. Discs and arm are other hues, or fewer. A shadow on the table keeps its hue.
class LightMeter {
 public:
  /// @param table_rgb  encoded colour of the table under the reference light, [0, 255]
  explicit LightMeter(const std::array<double, 3>& table_rgb);

  /// Nothing when no such hue takes a good part of the picture; `why` then says what was found.
  /// @param frame  of the right size (ImageCheck)
  /// Cost: about 0.1 ms.
  std::optional<TableLight> measure(const ColorFrame& frame, std::string& why);

 private:
  static constexpr int kBinsPerOctave = 16;
  static constexpr int kHalf = 40;  // bins on each side of the known hue: 2.5 octaves
  static constexpr int kSide = 2 * kHalf + 1;

  bool plausible(int u, int v) const noexcept;

  std::array<double, 3> table_rgb_;
  std::array<std::int16_t, 256> log2_;  // of a value, in bins
  int u0_, v0_;                         // log2 of red over green and of blue over green of the table, in bins
  std::vector<int> counts_;             // by hue relative to the table's, kSide x kSide
  struct Sample {
    std::uint8_t r, g, b;
    std::int16_t u, v;
  };
  std::vector<Sample> samples_;
};

}  // namespace breakshot::perception
