#include "perception/hue_check.hpp"

#include "perception/hsv.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace breakshot::perception {
namespace {

constexpr std::size_t kLeastDiscs = 3;
constexpr double kOff = 9.0;     // deg, median over the discs: the light that is left after the table's white balance turns hues by less
constexpr double kBetter = 2.0;  // times
constexpr int kClipped = 250;    // from here on a channel counts as clipped, which turns hues

double apart(double a_deg, double b_deg) noexcept { return std::abs(std::remainder(a_deg - b_deg, 360.0)); }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Mean colour about the middle of a disc's top face; nothing when it is out of the picture or clipped.
std::optional<cv::Vec3d> middle_of(const cv::Mat3b& rgb, const View& view, const DiscFit& disc) {
  constexpr int kHalf = 3;  // px
  const auto pixel = view.camera.project({disc.p_WD.x(), disc.p_WD.y(), view.disc_height});
  if (!pixel) return std::nullopt;
  const cv::Rect box{static_cast<int>(std::lround(pixel->x())) - kHalf, static_cast<int>(std::lround(pixel->y())) - kHalf, 2 * kHalf + 1,
                     2 * kHalf + 1};
  if ((box & cv::Rect{{0, 0}, rgb.size()}) != box) return std::nullopt;
  const cv::Scalar mean = cv::mean(rgb(box));
  if (std::max({mean[0], mean[1], mean[2]}) >= kClipped) return std::nullopt;
  return cv::Vec3d{mean[0], mean[1], mean[2]};
}

}  // namespace

bool mirrored_hues(const cv::Mat3b& rgb, const TableLight& light, std::span<const ColourRange> colours, const View& view,
                   std::span<const DiscFit> discs) {
  std::vector<double> as_is, exchanged;
  bool two_colours = false;
  std::uint8_t first_colour = 0;
  for (const DiscFit& disc : discs) {
    const auto paint = colours[disc.colour].paint_hue_deg;
    const auto seen = paint ? middle_of(rgb, view, disc) : std::nullopt;
    if (!seen) continue;
    if (as_is.empty()) first_colour = disc.colour;
    two_colours = two_colours || disc.colour != first_colour;
    const double r = (*seen)[0] * light.gain[0], g = (*seen)[1] * light.gain[1], b = (*seen)[2] * light.gain[2];
    as_is.push_back(apart(to_hsv(r, g, b).hue_deg, *paint));
    double nearest = 180.0;
    for (const ColourRange& colour : colours) {
      if (colour.paint_hue_deg) nearest = std::min(nearest, apart(to_hsv(b, g, r).hue_deg, *colour.paint_hue_deg));
    }
    exchanged.push_back(nearest);
  }
  if (as_is.size() < kLeastDiscs || !two_colours) return false;
  const double off = median(as_is);
  return off > kOff && off > kBetter * median(exchanged);
}

}  // namespace breakshot::perception
