// What comes in as a camera frame: whatever a sender puts into its fields, the door lets through what its size allows or refuses it, and perception makes
// a scene of it whose numbers are finite and within the bounds of its own topic.

#include "common/config/camera_file.hpp"
#include "common/dds/cell_topics.hpp"
#include "perception/perceiver.hpp"
#include "perception/perception_config.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>

using namespace breakshot;

namespace {

using ColorTopic = dds::Topic<ColorFrame>;
using DepthTopic = dds::Topic<DepthFrame>;
using SceneTopic = dds::Topic<Scene>;

constexpr int kWidth = 160, kHeight = 90;

/// Takes numbers off the front of the input; zeros when it is used up.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_{data}, size_{size} {}
  template <typename Number>
  Number take() {
    Number value{};
    const std::size_t count = std::min(sizeof value, size_);
    std::memcpy(&value, data_, count);
    data_ += count;
    size_ -= count;
    return value;
  }
  std::size_t left() const { return size_; }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

/// A small camera over the cell's table.
perception::Perceiver make_perceiver() {
  const ConfigDocument document = load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml");
  const CellConfig cell = load_cell_config(document);
  CameraModel camera = load_camera(cell.camera_file);
  const double scale = static_cast<double>(kWidth) / camera.width;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx *= scale;
  camera.fy *= scale;
  camera.cx *= scale;
  camera.cy *= scale;
  perception::PerceptionSettings settings = perception::load_perception_config(document, cell).settings;
  settings.watch.period = Duration::zero();
  return perception::Perceiver{settings, camera};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static auto color = std::make_unique<ColorTopic::Wire>();
  static auto depth = std::make_unique<DepthTopic::Wire>();
  // Made once, because that takes longer than the rest: so what a frame comes to depends a little on those before it, as in the cell.
  static perception::Perceiver perceiver = make_perceiver();
  static std::int64_t stamp = 0;

  Input input{data, size};
  for (int frame = 0; frame < 2; ++frame) {
    const bool odd_size = input.take<std::uint8_t>() < 16;  // most frames get past the door
    color->seq(input.take<std::uint64_t>());
    color->stamp_ns(input.take<std::uint8_t>() == 1 ? stamp : ++stamp);
    color->width(odd_size ? input.take<std::uint32_t>() : kWidth);
    color->height(odd_size ? input.take<std::uint32_t>() : kHeight);
    depth->seq(color->seq());
    depth->stamp_ns(color->stamp_ns());
    depth->width(color->width());
    depth->height(color->height());
    // Boxes of one colour and depth each, then single pixels: what is left of the input, as long as it lasts.
    auto& rgb = color->data();
    auto& range = depth->data();
    std::fill_n(rgb.begin(), 3 * kWidth * kHeight, input.take<std::uint8_t>());
    std::fill_n(range.begin(), kWidth * kHeight, input.take<std::uint16_t>());
    for (int boxes = input.take<std::uint8_t>() % 24; boxes > 0 && input.left() > 0; --boxes) {
      const int left = input.take<std::uint8_t>() % kWidth, top = input.take<std::uint8_t>() % kHeight;
      const int right = std::min(kWidth, left + input.take<std::uint8_t>() % 64),
                bottom = std::min(kHeight, top + input.take<std::uint8_t>() % 64);
      const bool round = input.take<std::uint8_t>() % 2 == 0;
      const std::uint8_t paint[3] = {input.take<std::uint8_t>(), input.take<std::uint8_t>(), input.take<std::uint8_t>()};
      const auto far = input.take<std::uint16_t>();
      for (int y = top; y < bottom; ++y) {
        for (int x = left; x < right; ++x) {
          const double u = (2.0 * x + 1.0 - left - right) / std::max(1, right - left),
                       v = (2.0 * y + 1.0 - top - bottom) / std::max(1, bottom - top);
          if (round && u * u + v * v > 1.0) continue;
          const auto pixel = static_cast<std::size_t>(y * kWidth + x);
          std::copy_n(paint, 3, rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
          range[pixel] = far;
        }
      }
    }
    const auto taken = ColorTopic::decode(*color);
    const auto taken_depth = DepthTopic::decode(*depth);
    if (!taken) continue;
    const Scene scene = perceiver.process(*taken, taken_depth ? &*taken_depth : nullptr);
    SceneTopic::Wire wire;
    SceneTopic::encode(scene, wire);
    if (!SceneTopic::decode(wire)) std::abort();
  }
  return 0;
}
