#include "perception/segmentation.hpp"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace breakshot::perception {
namespace {

constexpr int kBits = 6;            // per channel in the look-up table: 2^18 entries stay in the second-level cache
constexpr int kTile = 16;           // px: discs are found on a coarse grid first, so that empty table costs one pass only
constexpr int kTileMinPixels = 16;  // fewer labelled pixels in a tile are noise, or the rim of a patch that a neighbour tile shows

std::size_t table_index(unsigned r, unsigned g, unsigned b) noexcept {
  return (static_cast<std::size_t>(r >> (8 - kBits)) << (2 * kBits)) | (static_cast<std::size_t>(g >> (8 - kBits)) << kBits) |
         static_cast<std::size_t>(b >> (8 - kBits));
}

struct Hsv {
  double hue_deg, saturation, value;
};

Hsv to_hsv(double r, double g, double b) noexcept {
  const double high = std::max({r, g, b});
  const double low = std::min({r, g, b});
  const double chroma = high - low;
  if (chroma <= 0.0) return {0.0, 0.0, high / 255.0};
  double sextant = 0.0;
  if (high == r) {
    sextant = (g - b) / chroma;
  } else if (high == g) {
    sextant = 2.0 + (b - r) / chroma;
  } else {
    sextant = 4.0 + (r - g) / chroma;
  }
  const double hue = 60.0 * sextant;
  return {hue < 0.0 ? hue + 360.0 : hue, chroma / high, high / 255.0};
}

bool in_range(const Hsv& hsv, const ColourRange& range) noexcept {
  if (hsv.saturation < range.saturation_min || hsv.saturation > range.saturation_max) return false;
  if (hsv.value < range.value_min || hsv.value > range.value_max) return false;
  if (range.hue_min_deg <= range.hue_max_deg) return hsv.hue_deg >= range.hue_min_deg && hsv.hue_deg <= range.hue_max_deg;
  return hsv.hue_deg >= range.hue_min_deg || hsv.hue_deg <= range.hue_max_deg;
}

std::uint8_t label_of(const Hsv& hsv, const std::vector<ColourRange>& colours) noexcept {
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (in_range(hsv, colours[i])) return static_cast<std::uint8_t>(i + 1);
  }
  return 0;
}

}  // namespace

Segmenter::Segmenter(const PerceptionSettings& settings)
    : colours_{static_cast<int>(settings.colours.size())},
      kernel_{cv::getStructuringElement(cv::MORPH_RECT, {settings.morphology_px, settings.morphology_px})},
      table_(std::size_t{1} << (3 * kBits)) {
  constexpr double kHalfStep = 0.5 * ((1 << (8 - kBits)) - 1);  // an entry stands for the middle of the values that it covers
  for (unsigned r = 0; r < 256; r += 1u << (8 - kBits)) {
    for (unsigned g = 0; g < 256; g += 1u << (8 - kBits)) {
      for (unsigned b = 0; b < 256; b += 1u << (8 - kBits)) {
        table_[table_index(r, g, b)] = label_of(to_hsv(r + kHalfStep, g + kHalfStep, b + kHalfStep), settings.colours);
      }
    }
  }
}

int Segmenter::classify(std::uint8_t r, std::uint8_t g, std::uint8_t b) const noexcept { return table_[table_index(r, g, b)] - 1; }

const std::vector<Region>& Segmenter::segment(const cv::Mat3b& rgb, int min_area_px) {
  label_pixels(rgb);
  regions_.clear();
  const int columns = (rgb.cols + kTile - 1) / kTile;
  const int rows = (rgb.rows + kTile - 1) / kTile;
  cv::Mat stats, centroids;
  for (int colour = 0; colour < colours_; ++colour) {
    tiles_.create(rows, columns);
    const int* counts = tile_counts_.data() + static_cast<std::size_t>(colour + 1) * static_cast<std::size_t>(rows * columns);
    for (int i = 0; i < rows * columns; ++i) tiles_.data[i] = counts[i] >= kTileMinPixels ? 255 : 0;
    if (cv::countNonZero(tiles_) == 0) continue;
    cv::dilate(tiles_, tiles_, cv::Mat());  // a patch's rim may reach into tiles that hold too few of its pixels
    const int found = cv::connectedComponentsWithStats(tiles_, components_, stats, centroids, 8);
    for (int i = 1; i < found; ++i) {
      const cv::Rect tiles{stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP), stats.at<int>(i, cv::CC_STAT_WIDTH),
                           stats.at<int>(i, cv::CC_STAT_HEIGHT)};
      const cv::Rect box =
          cv::Rect{tiles.x * kTile, tiles.y * kTile, tiles.width * kTile, tiles.height * kTile} & cv::Rect{{0, 0}, rgb.size()};
      find_regions(static_cast<std::uint8_t>(colour + 1), box, min_area_px);
    }
  }
  return regions_;
}

void Segmenter::label_pixels(const cv::Mat3b& rgb) {
  const int columns = (rgb.cols + kTile - 1) / kTile;
  const int rows = (rgb.rows + kTile - 1) / kTile;
  labels_.create(rgb.size());
  tile_counts_.assign(static_cast<std::size_t>(colours_ + 1) * static_cast<std::size_t>(rows * columns), 0);
  const auto per_colour = static_cast<std::size_t>(rows * columns);
  for (int y = 0; y < rgb.rows; ++y) {
    const std::uint8_t* in = rgb.ptr<std::uint8_t>(y);
    std::uint8_t* out = labels_.ptr<std::uint8_t>(y);
    int* counts = tile_counts_.data() + (y / kTile) * columns;
    for (int x = 0; x < rgb.cols; ++x, in += 3) {
      const std::uint8_t label = table_[table_index(in[0], in[1], in[2])];
      out[x] = label;
      if (label != 0) ++counts[label * per_colour + static_cast<std::size_t>(x / kTile)];
    }
  }
}

void Segmenter::find_regions(std::uint8_t label, const cv::Rect& box, int min_area_px) {
  cv::compare(labels_(box), label, mask_, cv::CMP_EQ);
  // Beyond the border OpenCV erodes nothing away, so a disc that the image cuts keeps its straight side.
  cv::morphologyEx(mask_, mask_, cv::MORPH_OPEN, kernel_);
  cv::morphologyEx(mask_, mask_, cv::MORPH_CLOSE, kernel_);
  cv::Mat stats, centroids;
  const int found = cv::connectedComponentsWithStats(mask_, components_, stats, centroids, 8);
  std::vector<std::vector<cv::Point>> contours;
  for (int i = 1; i < found; ++i) {
    if (stats.at<int>(i, cv::CC_STAT_AREA) < min_area_px) continue;
    const cv::Rect part{stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP), stats.at<int>(i, cv::CC_STAT_WIDTH),
                        stats.at<int>(i, cv::CC_STAT_HEIGHT)};
    Region region;
    region.colour = static_cast<std::uint8_t>(label - 1);
    region.box = part + box.tl();
    cv::compare(components_(part), i, region.mask, cv::CMP_EQ);
    cv::findContours(region.mask, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE, region.box.tl());
    const auto longest =
        std::max_element(contours.begin(), contours.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
    if (longest == contours.end()) continue;
    region.outline = std::move(*longest);
    regions_.push_back(std::move(region));
  }
}

}  // namespace breakshot::perception
