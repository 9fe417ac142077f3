#include "perception/image_file.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <vector>

namespace breakshot::perception {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr int kMaxSide = 4096;                                 // px, as the camera file allows
constexpr std::size_t kMaxFileSize = std::size_t{128} << 20U;  // bytes; 4096 x 4096 px uncompressed are 50 MB

[[noreturn]] void refuse(const std::string& name, const std::string& found, const std::string& allowed) {
  throw ImageFileError{name + ": found " + found + "; allowed: " + allowed};
}

std::uint32_t big_endian(Bytes bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8U | bytes[at + i];
  return value;
}

bool starts_with(Bytes bytes, std::initializer_list<std::uint8_t> signature) {
  return bytes.size() >= signature.size() && std::equal(signature.begin(), signature.end(), bytes.begin());
}
bool ends_with(Bytes bytes, std::initializer_list<std::uint8_t> end) {
  return bytes.size() >= end.size() && std::equal(end.begin(), end.end(), bytes.end() - static_cast<std::ptrdiff_t>(end.size()));
}

struct Size {
  std::uint32_t width = 0, height = 0;
};

/// PNG (ISO/IEC 15948): signature, then the chunk IHDR; the last chunk is IEND.
bool is_png(Bytes bytes) { return starts_with(bytes, {0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a}); }
Size png_size(Bytes bytes, const std::string& name) {
  constexpr std::size_t kHeader = 33;  // signature, length, type, 13 bytes, checksum
  if (bytes.size() < kHeader || big_endian(bytes, 12, 4) != 0x49484452U) refuse(name, "a PNG without a header", "a whole file");
  if (!ends_with(bytes, {'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82})) refuse(name, "a PNG that breaks off", "a whole file");
  return {big_endian(bytes, 16, 4), big_endian(bytes, 20, 4)};
}

/// JPEG (ITU-T T.81): segments of a marker and a length, among them a frame header (SOF); the end is EOI, after which some cameras pad.
bool is_jpeg(Bytes bytes) { return starts_with(bytes, {0xff, 0xd8, 0xff}); }
Size jpeg_size(Bytes bytes, const std::string& name) {
  Bytes body = bytes;
  while (body.size() > 4 && body.back() == 0) body = body.first(body.size() - 1);
  if (!ends_with(body, {0xff, 0xd9})) refuse(name, "a JPEG that breaks off", "a whole file");
  for (std::size_t at = 2; at + 9 <= body.size();) {
    if (body[at] != 0xff) break;
    const std::uint8_t marker = body[at + 1];
    if (marker == 0xff) {  // fill
      ++at;
      continue;
    }
    const bool frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame) return {big_endian(body, at + 7, 2), big_endian(body, at + 5, 2)};
    at += 2 + std::max<std::size_t>(2, big_endian(body, at + 2, 2));
  }
  refuse(name, "a JPEG without a frame", "a whole file");
}

void check_size(const Size& size, const std::string& name) {
  if (size.width >= 1 && size.height >= 1 && size.width <= kMaxSide && size.height <= kMaxSide) return;
  refuse(name, std::to_string(size.width) + " x " + std::to_string(size.height) + " px", "1 to 4096 px a side");
}

cv::Mat decode(Bytes bytes, const std::string& name) {
  const bool png = is_png(bytes);
  if (!png && !is_jpeg(bytes)) refuse(name, bytes.empty() ? "an empty file" : "no image of a known kind", "PNG, JPEG");
  check_size(png ? png_size(bytes, name) : jpeg_size(bytes, name), name);
  cv::Mat image;
  try {
    // OpenCV has no header over constant bytes; the decoder does not write to it.
    image = cv::imdecode(cv::Mat1b(1, static_cast<int>(bytes.size()), const_cast<std::uint8_t*>(bytes.data())), cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& error) {
    refuse(name, "an image that cannot be decoded (" + error.err + ")", "a sound file");
  }
  if (image.empty()) refuse(name, "an image that cannot be decoded", "a sound file");
  return image;
}

std::string describe(const cv::Mat& image) {
  return std::to_string(image.channels()) + (image.channels() == 1 ? " channel of " : " channels of ") +
         std::to_string(8 * image.elemSize1()) + " bits";
}

std::vector<std::uint8_t> read_file(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) refuse(file.string(), "no such file", "a readable image");
  const auto size = std::filesystem::file_size(file, error);
  if (error) refuse(file.string(), "a file that cannot be read: " + error.message(), "a readable image");
  if (size > kMaxFileSize) refuse(file.string(), "a file of more than 128 MiB", "a smaller one");
  std::vector<std::uint8_t> bytes(size);
  std::ifstream stream{file, std::ios::binary};
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!stream) refuse(file.string(), "a file that cannot be read: " + std::generic_category().message(errno), "a readable image");
  return bytes;
}

}  // namespace

ColorFrame decode_color(std::span<const std::uint8_t> bytes, const std::string& name) {
  const cv::Mat bgr = decode(bytes, name);
  if (bgr.type() != CV_8UC3) refuse(name, describe(bgr), "3 channels of 8 bits");
  cv::Mat rgb;
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return {1, Time{}, rgb.cols, rgb.rows, {rgb.datastart, rgb.dataend}};
}

DepthFrame decode_depth(std::span<const std::uint8_t> bytes, const std::string& name) {
  const cv::Mat depth = decode(bytes, name);
  if (depth.type() != CV_16UC1) refuse(name, describe(depth), "1 channel of 16 bits, the depth in 0.1 mm");
  return {1, Time{}, depth.cols, depth.rows, {depth.begin<std::uint16_t>(), depth.end<std::uint16_t>()}};
}

ColorFrame read_color(const std::filesystem::path& file) { return decode_color(read_file(file), file.string()); }
DepthFrame read_depth(const std::filesystem::path& file) { return decode_depth(read_file(file), file.string()); }

void write_color(const std::filesystem::path& file, const ColorFrame& image) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.rgb.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  bool written = false;
  try {
    written = cv::imwrite(file.string(), bgr);
  } catch (const cv::Exception& error) {
    throw ImageFileError{file.string() + ": cannot be written: " + error.err};
  }
  if (!written) throw ImageFileError{file.string() + ": cannot be written"};
}

}  // namespace breakshot::perception
