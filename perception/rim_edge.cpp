#include "perception/rim_edge.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace breakshot::perception {
namespace {

constexpr double kSampleStep = 0.5;  // px
constexpr std::size_t kMaxSamples = static_cast<std::size_t>(2.0 * kMaxReach / kSampleStep) + 1;
constexpr float kMinContrast = 15.0F;  // distance of the two sides in RGB under the reference light: five times the noise of a sample
constexpr float kMinSine = 0.15F;      // of the angle between the two sides' colours: below, noise grows by more than six
constexpr float kMinLight = 12.0F;     // of the darker side: below, its hue is noise
constexpr float kLeastSum = 0.1F;
constexpr float kFull = 250.0F;  // from here on a channel is clipped
constexpr double kTrustInClipped = 0.7;
constexpr double kBlur = 1.5;        // px: half the width of an edge, of a pixel's square and of the interpolation between pixels together
constexpr float kMostSlope = 0.15F;  // of a side's light, relative, per px: more is the border of a shadow, which does not go on like that
// Of the inside's hue towards that of the outside, per px: an edge beside such a drift counts half. What is left of its shift after the correction, about
// half a pixel times the drift, is shared by neighbours.
constexpr float kDriftOfHalfTrust = 0.04F;

// The part of a colour that one side adds, as a factor on that side's own colour: perpendicular to the other side's hue, so that how bright the
// other side is does not matter.
RgbLight axis_of(const RgbLight& side, const RgbLight& other) noexcept {
  const RgbLight across = side - other * (side.dot(other) / other.squaredNorm());
  return across / across.dot(side);
}

bool differ(const RgbLight& inside, const RgbLight& outside, float level) noexcept {
  return (inside - outside).norm() >= level * kMinContrast;
}

bool differ_in_hue(const RgbLight& inside, const RgbLight& outside, float level) noexcept {
  const float cosine = inside.dot(outside) / std::max(1e-6F, inside.norm() * outside.norm());
  return 1.0F - cosine * cosine > kMinSine * kMinSine && std::min(inside.norm(), outside.norm()) > level * kMinLight;
}

// How much of a colour is what lies outside, 0 to 1.
//
// Usually the two sides differ in hue: the colour is then split into a part of each. Beside a sharp edge both may be brighter or darker than
// where they are told by (a bevel, the brim of a shadow): the outside's part of the sum hardly follows that, as long as it happens to both alike. Where the
// line starts on another face than the one that ends, only the outside's part itself means something. Where the hues are nearly the
// same (a grey disc, deep shadow) the answer is the place between the two colours.
class OutsideShare {
 public:
  OutsideShare(const RgbLight& inside, const RgbLight& outside, bool by_hue, bool of_sum) noexcept
      : axis_{by_hue ? axis_of(outside, inside) : RgbLight{(outside - inside) / (outside - inside).squaredNorm()}},
        origin_{by_hue ? 0.0F : inside.dot(axis_)},
        of_sum_{by_hue && of_sum} {
    if (of_sum_) sum_ = axis_of(inside, outside) + axis_;
  }
  float operator()(const RgbLight& colour) const noexcept {
    const float outside = colour.dot(axis_) - origin_;
    return of_sum_ ? outside / std::max(kLeastSum, colour.dot(sum_)) : outside;
  }

 private:
  RgbLight axis_, sum_{0.0F, 0.0F, 0.0F};
  float origin_;
  bool of_sum_;
};

// Where shares first pass a half nearest to the middle, in samples from there.
std::optional<double> half_way(std::span<const float> shares) noexcept {
  const double middle = static_cast<double>(shares.size() - 1) / 2.0;
  std::optional<double> nearest;
  for (std::size_t i = 1; i < shares.size(); ++i) {
    const float previous = shares[i - 1], next = shares[i];
    if (previous > 0.5F || next <= 0.5F) continue;
    const double at = static_cast<double>(i - 1) + static_cast<double>((0.5F - previous) / (next - previous)) - middle;
    if (!nearest || std::abs(at) < std::abs(*nearest)) nearest = at;
  }
  return nearest;
}

}  // namespace

RgbLight RimLine::at(double distance) const noexcept {
  const Vector2 at = origin_ + distance * outward_;
  const int x = static_cast<int>(at.x());
  const int y = static_cast<int>(at.y());
  const auto fx = static_cast<float>(at.x() - x);
  const auto fy = static_cast<float>(at.y() - y);
  const std::uint8_t* top = rgb_.ptr<std::uint8_t>(y) + 3 * x;
  const std::uint8_t* bottom = rgb_.ptr<std::uint8_t>(y + 1) + 3 * x;
  const auto pixel = [&](const std::uint8_t* p) { return RgbLight{light_[p[0]], light_[p[1]], light_[p[2]]}; };
  return (1 - fy) * ((1 - fx) * pixel(top) + fx * pixel(top + 3)) + fy * ((1 - fx) * pixel(bottom) + fx * pixel(bottom + 3));
}

std::optional<RimEdge> find_edge(const RimLine& line, Rim rim, double reach, float level) noexcept {
  std::array<RgbLight, kMaxSamples> colours;
  const std::size_t n = static_cast<std::size_t>(2.0 * reach / kSampleStep) + 1;
  for (std::size_t i = 0; i < n; ++i) colours[i] = line.at(static_cast<double>(i) * kSampleStep - reach);
  const RgbLight inside = (colours[0] + colours[1]) / 2.0F;
  const RgbLight outside = (colours[n - 1] + colours[n - 2]) / 2.0F;
  if (!differ(inside, outside, level)) return std::nullopt;
  const bool by_hue = differ_in_hue(inside, outside, level);
  if (rim == Rim::kNarrowFoot && !by_hue) return std::nullopt;
  const OutsideShare share{inside, outside, by_hue, rim != Rim::kNarrowFoot};
  std::array<float, kMaxSamples> shares;
  for (std::size_t i = 0; i < n; ++i) shares[i] = share(colours[i]);
  const auto at = half_way(std::span{shares}.first(n));
  if (!at) return std::nullopt;
  return RimEdge{*at * kSampleStep, 1.0};
}

std::optional<RimEdge> measure_edge(const RimLine& line, Rim rim, float level) noexcept {
  constexpr std::size_t kSide = 2;  // samples of each side beyond the blur
  constexpr std::size_t kCount = static_cast<std::size_t>(2.0 * kExactReach / kSampleStep) + 1;
  constexpr std::size_t kFirst = kSide, kLast = kCount - 1 - kSide;  // of the blur
  std::array<RgbLight, kCount> colours;
  for (std::size_t i = 0; i < kCount; ++i) colours[i] = line.at(static_cast<double>(i) * kSampleStep - kExactReach);
  // Three samples of each side, half a pixel apart, their middle kFrom from the edge.
  constexpr float kFrom = static_cast<float>(kExactReach - kSampleStep);
  const RgbLight inside = (colours[0] + colours[1] + colours[2]) / 3.0F;
  const RgbLight outside = (colours[kCount - 1] + colours[kCount - 2] + colours[kCount - 3]) / 3.0F;
  if (!differ(inside, outside, level)) return std::nullopt;
  if (!differ_in_hue(inside, outside, level)) {
    return rim == Rim::kNarrowFoot ? std::nullopt : find_edge(line, rim, kBlur, level);
  }

  const bool by_wall = rim == Rim::kFoot;
  const RgbLight axis = by_wall ? axis_of(inside, outside) : axis_of(outside, inside);
  const auto part = [&](std::size_t sample) { return colours[sample].dot(axis); };
  const auto bounded = [](float per_px) { return std::clamp(per_px, -kMostSlope, kMostSlope); };
  // Both away from the edge: how that side's light changes, and how the hue of a top face drifts towards the table's (the image of a lamp, clipped
  // paint), which looks as if there were table in it.
  const float slope = bounded(by_wall ? part(0) - part(2) : part(kCount - 1) - part(kCount - 3));
  const float drift = by_wall ? 0.0F : bounded(part(0) - part(2));
  // The trapezoidal rule; all of that side's light, had the side no edge, would be 1 everywhere.
  double sum = 0.0;
  bool clipped = false;
  for (std::size_t i = kFirst; i <= kLast; ++i) {
    const auto distance = static_cast<float>(static_cast<double>(i) * kSampleStep - kExactReach);
    const float beyond = std::max(0.0F, by_wall ? -distance : distance);
    const float false_part = drift * (std::max(0.0F, -distance) - kFrom);
    const float share = (part(i) / (1.0F + slope * (beyond - kFrom)) - false_part) / (1.0F - false_part);
    sum += static_cast<double>(share) * (i == kFirst || i == kLast ? 0.5 : 1.0) * kSampleStep;
    clipped = clipped || (distance <= 0.0F && colours[i].maxCoeff() >= kFull);
  }
  const double at = by_wall ? sum - kBlur : kBlur - sum;
  if (std::abs(at) > kBlur) return std::nullopt;
  const float doubt = drift / kDriftOfHalfTrust;
  return RimEdge{at, (clipped ? kTrustInClipped : 1.0) / (1.0 + static_cast<double>(doubt * doubt))};
}

}  // namespace breakshot::perception
