#pragma once

#include "perception/settings.hpp"
#include "perception/table_light.hpp"

#include <opencv2/core.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace breakshot::perception {

/// Of a patch that is painted, but in none of the discs' colours.
inline constexpr std::uint8_t kNoColour = 255;

/// A closed contour of a patch: image pixels of the patch's rim, in order.
struct Outline {
  std::vector<cv::Point> points;
  bool hole = false;  ///< around something in the patch that is not of it, rather than around the patch
};

/// One connected patch of one colour.
struct Region {
  std::uint8_t colour = 0;  ///< index into PerceptionSettings::colours, or kNoColour
  cv::Rect box;             ///< in the image
  cv::Mat1b mask;           ///< 255 in the patch, the size of box
  int area_px = 0;
  std::vector<Outline> outlines;  ///< the outer one first
};

/// HSV segmentation per colour (paper Sec. 5), opening and closing, connected components.
///
/// Unlike the paper's it sees colours as they are under the reference light (TableLight), and takes what has the table's own hue for table
/// whatever the colours' ranges say.
class Segmenter {
 public:
  explicit Segmenter(const PerceptionSettings& settings);

  /// Patches of at least min_area_px pixels. The result stays valid until the next call.
  /// @param rgb    8-bit RGB image
  /// @param light  on it; classify() follows it until the next call
  /// Cost: about 0.3 ns per pixel of the image, plus 25 ns per pixel of coloured patches.
  const std::vector<Region>& segment(const cv::Mat3b& rgb, const TableLight& light, int min_area_px);

  /// Colour class of one RGB value: index into the colour table, or -1.
  int classify(std::uint8_t r, std::uint8_t g, std::uint8_t b) const noexcept {
    const int label = label_of(r, g, b);
    return label > colours_ ? -1 : label - 1;
  }

 private:
  void adapt(const TableLight& light) noexcept;
  std::uint8_t label_of(std::uint8_t r, std::uint8_t g, std::uint8_t b) const noexcept {
    return table_[index_[0][r] | index_[1][g] | index_[2][b]];
  }
  void find_tiles(const cv::Mat3b& rgb);
  void label_pixels(const cv::Mat3b& rgb);
  void find_regions(std::uint8_t label, const cv::Rect& box, int min_area_px);

  int colours_;
  cv::Mat kernel_;
  std::vector<std::uint8_t>
      table_;  // RGB under the reference light, 6 bits each, to label: 0 for none, else colour index + 1, or colours_ + 1
  std::array<std::array<std::uint32_t, 256>, 3> index_{};  // a channel's part of the index into table_, under the light of now
  cv::Mat1b labels_;
  std::vector<int> tile_counts_;  // labelled pixels per colour and tile
  cv::Mat1b mask_, tiles_, busy_;
  cv::Mat1i components_;
  std::vector<Region> regions_;
};

}  // namespace breakshot::perception
