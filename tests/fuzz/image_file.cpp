// The reader of image files behind ./breakshot perceive and calibrate: any bytes give a picture that is what it says, or an ImageFileError.

#include "perception/image_file.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

using namespace breakshot::perception;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const breakshot::ColorFrame frame = decode_color({data, size}, "fuzz");
    if (frame.rgb.size() != 3U * static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height)) std::abort();
  } catch (const ImageFileError&) {
  }
  try {
    const breakshot::DepthFrame frame = decode_depth({data, size}, "fuzz");
    if (frame.depth.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height)) std::abort();
  } catch (const ImageFileError&) {
  }
  return 0;
}
