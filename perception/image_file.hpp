#pragma once

#include "common/frames.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>

namespace breakshot::perception {

/// What is wrong with an image file: its name, what was found, what is allowed.
class ImageFileError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads a picture from a file: PNG or JPEG, colour of 8 bits, whole, at most 4096 px a side. seq is 1, the stamp 0.
///
/// Before a decoder sees it, the size in its header is looked at (a few bytes can ask for gigabytes), and whether it ends as it must.
/// @throws ImageFileError
ColorFrame read_color(const std::filesystem::path& file);
/// Reads a depth image: PNG, grey of 16 bits, in 0.1 mm.
DepthFrame read_depth(const std::filesystem::path& file);

/// As above, from the bytes of a file; `name` stands for it in errors.
ColorFrame decode_color(std::span<const std::uint8_t> bytes, const std::string& name);
DepthFrame decode_depth(std::span<const std::uint8_t> bytes, const std::string& name);

/// Writes a PNG or JPEG. @throws ImageFileError
void write_color(const std::filesystem::path& file, const ColorFrame& image);

}  // namespace breakshot::perception
