#pragma once

#include "common/geometry.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace breakshot {

/// A family of square black-and-white markers. The numbers are OpenCV's (cv::aruco::PREDEFINED_DICTIONARY_NAME).
enum class MarkerDictionary : std::uint8_t { k4x4 = 0, k5x5 = 5, k6x6 = 10, kAprilTag36h11 = 20 };

/// What a dictionary is called in a configuration, and how many markers it has.
struct MarkerDictionaryName {
  MarkerDictionary dictionary;
  std::string_view name;
  int markers;
};
inline constexpr std::array<MarkerDictionaryName, 4> kMarkerDictionaries{{{MarkerDictionary::k4x4, "4x4_50", 50},
                                                                          {MarkerDictionary::k5x5, "5x5_100", 100},
                                                                          {MarkerDictionary::k6x6, "6x6_250", 250},
                                                                          {MarkerDictionary::kAprilTag36h11, "apriltag_36h11", 587}}};

/// Most markers on a table; four are enough to see a camera move.
inline constexpr std::size_t kMaxTableMarkers = 16;

/// A marker printed on the table top. Its frame M lies in the middle of the black square, x to the right and y up as the print is read.
struct TableMarker {
  int id = 0;
  Vector2 p_WM{0.0, 0.0};  ///< m
  double yaw = 0.0;        ///< from x of W to x of M, rad
};

/// By these perception notices that the camera was moved.
struct TableMarkers {
  MarkerDictionary dictionary = MarkerDictionary::k4x4;
  double side = 0.0;  ///< of the black square, m
  std::vector<TableMarker> at;
};

/// Corners of a marker's black square in W, in the order in which detectors give them: as the print is read, from the top left on clockwise.
std::array<Vector2, 4> corners_of(const TableMarker& marker, double side) noexcept;

}  // namespace breakshot
