#include "perception/image_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace breakshot::perception {
namespace {

constexpr int kRowStride = 8;  // every eighth row: a tenth of a disc, and sensor noise differs in every row anyway

// The level that the brightest percent of the pixels reaches.
int bright_level(const ColorFrame& frame) noexcept {
  std::array<int, 256> histogram{};
  int pixels = 0;
  for (int y = 0; y < frame.height; y += kRowStride) {
    const std::uint8_t* row = frame.rgb.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) * 3;
    for (int x = 0; x < frame.width; x += kRowStride) {
      const std::uint8_t* p = row + 3 * x;
      ++histogram[std::max({p[0], p[1], p[2]})];
      ++pixels;
    }
  }
  int above = 0;
  int level = 255;
  while (level > 0 && (above += histogram[static_cast<std::size_t>(level)]) * 100 < pixels) --level;
  return level;
}

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height) + " px"; }

}  // namespace

// Checksums of every eighth row, for each band of rows. The noise of a live sensor never repeats, so an equal checksum means the same picture.
ImageCheck::Bands ImageCheck::content(const ColorFrame& frame) noexcept {
  Bands bands{};
  const auto row_bytes = static_cast<std::size_t>(frame.width) * 3;
  for (int band = 0; band < kBands; ++band) {
    std::uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a over words (Fowler, Noll, Vo)
    std::uint64_t first = 0, different = 0;
    for (int y = band * frame.height / kBands; y < (band + 1) * frame.height / kBands; y += kRowStride) {
      const std::uint8_t* row = frame.rgb.data() + static_cast<std::size_t>(y) * row_bytes;
      for (std::size_t i = 0; i + 8 <= row_bytes; i += 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, row + i, sizeof word);
        hash = (hash ^ word) * 0x100000001b3u;
        hash ^= hash >> 29;  // FNV alone never carries high bits of a word down
        if (first == 0) first = word;
        different |= word ^ first;
      }
    }
    bands[static_cast<std::size_t>(band)] = {hash, different != 0};
  }
  return bands;
}

std::optional<std::string> ImageCheck::frozen(const Bands& bands) const {
  int same = 0, first = -1;
  for (int band = 0; band < kBands; ++band) {
    const auto i = static_cast<std::size_t>(band);
    if (!bands[i].varied || bands[i].hash != last_content_[i].hash) continue;
    ++same;
    if (first < 0) first = band;
  }
  if (same == 0) return std::nullopt;
  if (same == kBands) return "found the content of the frame before it under a new stamp";
  return "found the content of the frame before it in " + std::to_string(same) + " of " + std::to_string(kBands) +
         " bands of rows, the first from row " + std::to_string(first * height_ / kBands) + " on";
}

ImageCheck::ImageCheck(int width, int height, double dark_level) : width_{width}, height_{height}, dark_level_{dark_level} {}

std::optional<ImageFault> ImageCheck::check(const ColorFrame& frame) {
  const std::string who = "colour frame " + std::to_string(frame.seq) + ": ";
  if (frame.width != width_ || frame.height != height_) {
    return ImageFault{SceneQuality::kBadImage,
                      who + "found " + size_text(frame.width, frame.height) + "; the calibrated camera has " + size_text(width_, height_)};
  }
  const auto bytes = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3;
  if (frame.rgb.size() != bytes) {
    return ImageFault{SceneQuality::kBadImage, who + "found " + std::to_string(frame.rgb.size()) + " bytes; RGB of 8 bits at " +
                                                   size_text(width_, height_) + " takes " + std::to_string(bytes)};
  }
  const Time before = last_exposed_;
  const bool first = !any_;
  any_ = true;
  last_exposed_ = frame.exposed;
  if (!first && frame.exposed <= before) {
    return ImageFault{SceneQuality::kBadImage, who + "found a stamp " + std::to_string(to_ns(before) - to_ns(frame.exposed)) +
                                                   " ns behind the frame before it; stamps must grow"};
  }
  const Bands bands = content(frame);
  const auto same = first ? std::nullopt : frozen(bands);
  last_content_ = bands;
  if (const int level = bright_level(frame); level < dark_level_) {
    return ImageFault{SceneQuality::kDark, who + "found the brightest percent of the pixels to begin at " + std::to_string(level) +
                                               " of 255; at least " + std::to_string(static_cast<int>(std::ceil(dark_level_))) +
                                               " is needed"};
  }
  if (same) return ImageFault{SceneQuality::kFrozen, who + *same};
  return std::nullopt;
}

std::optional<std::string> stale(const ColorFrame& frame, Time now, Duration limit) {
  constexpr Duration kAhead = std::chrono::milliseconds{50};  // clocks of one machine do not differ by so much
  const auto ms = [](Duration d) { return std::to_string(static_cast<long>(std::lround(1e3 * to_seconds(d)))) + " ms"; };
  const std::string who = "colour frame " + std::to_string(frame.seq) + ": ";
  if (now - frame.exposed > limit) return who + "found a stamp " + ms(now - frame.exposed) + " old; at most " + ms(limit) + " is allowed";
  if (frame.exposed - now > kAhead) return who + "found a stamp " + ms(frame.exposed - now) + " in the future";
  return std::nullopt;
}

std::optional<std::string> depth_fault(const DepthFrame& depth, const ColorFrame& color) {
  const std::string who = "depth frame " + std::to_string(depth.seq) + ": ";
  if (depth.seq != color.seq) return who + "belongs to another frame than colour frame " + std::to_string(color.seq);
  if (depth.width != color.width || depth.height != color.height) {
    return who + "found " + size_text(depth.width, depth.height) + "; the colour frame has " + size_text(color.width, color.height);
  }
  const auto values = static_cast<std::size_t>(depth.width) * static_cast<std::size_t>(depth.height);
  if (depth.depth.size() != values) {
    return who + "found " + std::to_string(depth.depth.size()) + " values; " + size_text(depth.width, depth.height) + " takes " +
           std::to_string(values);
  }
  return std::nullopt;
}

}  // namespace breakshot::perception
