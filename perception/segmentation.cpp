#include "perception/segmentation.hpp"

#include "perception/hsv.hpp"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace breakshot::perception {
namespace {

constexpr int kBits = 6;            // per channel in the look-up table: 2^18 entries stay in the second-level cache
constexpr int kTile = 16;           // px: discs are found on a coarse grid first, so that empty table costs little
constexpr int kGlance = 4;          // px between the pixels of that first look
constexpr int kTileMinPixels = 16;  // fewer labelled pixels in a tile are noise, or the rim of a patch that a neighbour tile shows
constexpr int kLeastHole = 16;      // px of contour: smaller holes are noise and highlights, and say nothing of a disc's outline
// Nearer to the table's hue than this is table, whatever the ranges say: cosine of the angle in RGB between a grey and one of saturation 0.25.
constexpr double kTableCosine = 0.985;
constexpr double kGlareCosine = 0.996;  // the same for what is brighter than the table ever is
constexpr double kGlare = 1.20;         // times as bright as the table: above the seams between it and the brightest paint
constexpr double kGlareSaturation = 0.20;
constexpr double kPaintSaturation = 0.5;  // from here on something is painted, if only in a colour that no disc has

std::uint32_t index_part(int channel, unsigned value) noexcept { return (value >> (8 - kBits)) << ((2 - channel) * kBits); }

// `glare_value`: what is brighter than this mirrors a lamp, whose white takes saturation from the paint.
bool in_range(const Hsv& hsv, const ColourRange& range, double glare_value) noexcept {
  const double least = hsv.value > glare_value ? std::min(range.saturation_min, kGlareSaturation) : range.saturation_min;
  if (hsv.saturation < least || hsv.saturation > range.saturation_max) return false;
  if (hsv.value < range.value_min || hsv.value > range.value_max) return false;
  if (range.hue_min_deg <= range.hue_max_deg) return hsv.hue_deg >= range.hue_min_deg && hsv.hue_deg <= range.hue_max_deg;
  return hsv.hue_deg >= range.hue_min_deg || hsv.hue_deg <= range.hue_max_deg;
}

std::uint8_t label_for(const Hsv& hsv, const std::vector<ColourRange>& colours, double glare_value) noexcept {
  double darkest = 1.0;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (in_range(hsv, colours[i], glare_value)) return static_cast<std::uint8_t>(i + 1);
    darkest = std::min(darkest, colours[i].value_min);
  }
  return hsv.saturation >= kPaintSaturation && hsv.value >= 2.0 * darkest ? static_cast<std::uint8_t>(colours.size() + 1) : std::uint8_t{0};
}

bool hue_of_table(double r, double g, double b, const std::array<double, 3>& table, double glare_value) noexcept {
  const double cosine = std::max({r, g, b}) > 255.0 * glare_value ? kGlareCosine : kTableCosine;
  const double dot = r * table[0] + g * table[1] + b * table[2];
  const double squares = (r * r + g * g + b * b) * (table[0] * table[0] + table[1] * table[1] + table[2] * table[2]);
  return dot * dot >= cosine * cosine * squares;
}

int divided_up(int pixels) noexcept { return (pixels + kTile - 1) / kTile; }

}  // namespace

Segmenter::Segmenter(const PerceptionSettings& settings)
    : colours_{static_cast<int>(settings.colours.size())},
      kernel_{cv::getStructuringElement(cv::MORPH_RECT, {settings.morphology_px, settings.morphology_px})},
      table_(std::size_t{1} << (3 * kBits)) {
  constexpr double kHalfStep = 0.5 * ((1 << (8 - kBits)) - 1);  // an entry stands for the middle of the values that it covers
  const double glare_value = kGlare / 255.0 * *std::max_element(settings.table_rgb.begin(), settings.table_rgb.end());
  constexpr unsigned kStep = 1u << (8 - kBits);
  for (unsigned r = 0; r < 256; r += kStep) {
    for (unsigned g = 0; g < 256; g += kStep) {
      for (unsigned b = 0; b < 256; b += kStep) {
        std::uint8_t& label = table_[index_part(0, r) | index_part(1, g) | index_part(2, b)];
        if (hue_of_table(r + kHalfStep, g + kHalfStep, b + kHalfStep, settings.table_rgb, glare_value)) continue;
        label = label_for(to_hsv(r + kHalfStep, g + kHalfStep, b + kHalfStep), settings.colours, glare_value);
      }
    }
  }
  adapt({});
}

void Segmenter::adapt(const TableLight& light) noexcept {
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    for (unsigned value = 0; value < 256; ++value) {
      index_[c][value] = index_part(channel, static_cast<unsigned>(std::min(255.0, value * light.gain[c] + 0.5)));
    }
  }
}

const std::vector<Region>& Segmenter::segment(const cv::Mat3b& rgb, const TableLight& light, int min_area_px) {
  adapt(light);
  find_tiles(rgb);
  label_pixels(rgb);
  regions_.clear();
  const int columns = divided_up(rgb.cols);
  const int rows = divided_up(rgb.rows);
  cv::Mat stats, centroids;
  for (int label = 1; label <= colours_ + 1; ++label) {
    tiles_.create(rows, columns);
    const int* counts = tile_counts_.data() + static_cast<std::size_t>(label) * static_cast<std::size_t>(rows * columns);
    for (int i = 0; i < rows * columns; ++i) tiles_.data[i] = counts[i] >= kTileMinPixels ? 255 : 0;
    if (cv::countNonZero(tiles_) == 0) continue;
    cv::dilate(tiles_, tiles_, cv::Mat());  // a patch's rim may reach into tiles that hold too few of its pixels
    const int found = cv::connectedComponentsWithStats(tiles_, components_, stats, centroids, 8);
    for (int i = 1; i < found; ++i) {
      const cv::Rect tiles{stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP), stats.at<int>(i, cv::CC_STAT_WIDTH),
                           stats.at<int>(i, cv::CC_STAT_HEIGHT)};
      const cv::Rect box =
          cv::Rect{tiles.x * kTile, tiles.y * kTile, tiles.width * kTile, tiles.height * kTile} & cv::Rect{{0, 0}, rgb.size()};
      find_regions(static_cast<std::uint8_t>(label), box, min_area_px);
    }
  }
  return regions_;
}

// Tiles that hold paint, by a few of their pixels, and their neighbours: the smallest disc covers many such pixels.
void Segmenter::find_tiles(const cv::Mat3b& rgb) {
  busy_.create(divided_up(rgb.rows), divided_up(rgb.cols));
  busy_ = std::uint8_t{0};
  for (int y = kGlance / 2; y < rgb.rows; y += kGlance) {
    const std::uint8_t* in = rgb.ptr<std::uint8_t>(y);
    std::uint8_t* busy = busy_.ptr<std::uint8_t>(y / kTile);
    for (int x = kGlance / 2; x < rgb.cols; x += kGlance) {
      const std::uint8_t* p = in + 3 * x;
      busy[x / kTile] |= label_of(p[0], p[1], p[2]);
    }
  }
  cv::dilate(busy_, busy_, cv::Mat());
}

void Segmenter::label_pixels(const cv::Mat3b& rgb) {
  const auto per_label = static_cast<std::size_t>(busy_.rows) * static_cast<std::size_t>(busy_.cols);
  labels_.create(rgb.size());
  labels_ = std::uint8_t{0};
  tile_counts_.assign(static_cast<std::size_t>(colours_ + 2) * per_label, 0);
  for (int y = 0; y < rgb.rows; ++y) {
    const std::uint8_t* row = rgb.ptr<std::uint8_t>(y);
    std::uint8_t* out = labels_.ptr<std::uint8_t>(y);
    const std::uint8_t* busy = busy_.ptr<std::uint8_t>(y / kTile);
    for (int column = 0; column < busy_.cols; ++column) {
      if (busy[column] == 0) continue;
      int* counts = tile_counts_.data() + (y / kTile) * busy_.cols + column;
      const int end = std::min((column + 1) * kTile, rgb.cols);
      const std::uint8_t* in = row + std::ptrdiff_t{3} * column * kTile;
      for (int x = column * kTile; x < end; ++x, in += 3) {
        const std::uint8_t label = label_of(in[0], in[1], in[2]);
        out[x] = label;
        ++counts[label * per_label];
      }
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
  std::vector<cv::Vec4i> hierarchy;
  for (int i = 1; i < found; ++i) {
    const int area = stats.at<int>(i, cv::CC_STAT_AREA);
    if (area < min_area_px) continue;
    const cv::Rect part{stats.at<int>(i, cv::CC_STAT_LEFT), stats.at<int>(i, cv::CC_STAT_TOP), stats.at<int>(i, cv::CC_STAT_WIDTH),
                        stats.at<int>(i, cv::CC_STAT_HEIGHT)};
    Region region;
    region.colour = label > colours_ ? kNoColour : static_cast<std::uint8_t>(label - 1);
    region.area_px = area;
    region.box = part + box.tl();
    cv::compare(components_(part), i, region.mask, cv::CMP_EQ);
    cv::findContours(region.mask, contours, hierarchy, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE, region.box.tl());
    for (std::size_t k = 0; k < contours.size(); ++k) {
      const bool hole = hierarchy[k][3] >= 0;
      if (hole && contours[k].size() < kLeastHole) continue;
      const auto where = hole ? region.outlines.end() : region.outlines.begin();
      region.outlines.insert(where, {std::move(contours[k]), hole});
    }
    if (!region.outlines.empty()) regions_.push_back(std::move(region));
  }
}

}  // namespace breakshot::perception
