#pragma once

#include "common/geometry.hpp"
#include "common/time.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace breakshot {

/// Most discs that a scene may hold; the bound of the DDS type.
inline constexpr std::size_t kMaxSceneDiscs = 64;
/// Most contacts: a planar contact graph of n discs has at most 3n - 6 edges.
inline constexpr std::size_t kMaxSceneContacts = 3 * kMaxSceneDiscs;

/// What counts as rest, m/s: the speed of a disc that friction stops within a millisecond.
inline constexpr double kRestSpeed = 0.002;

/// A disc as perception sees it. Never ground truth.
struct SceneDisc {
  std::uint32_t id = 0;                 ///< stays with the disc from frame to frame as long as tracking holds; unique in a scene
  Vector2 p_WD{0.0, 0.0};               ///< centre, m
  Matrix2 covariance{Matrix2::Zero()};  ///< of p_WD, m^2
  Vector2 v_WD_W{0.0, 0.0};             ///< from frame to frame; zero when the disc was not in the last frame, m/s
  double radius = 0.0;                  ///< m
  double radius_sigma = 0.0;            ///< standard deviation of radius, m
  std::uint8_t colour = 0;              ///< index into the colour table of the configuration
  bool complete = true;                 ///< the whole outline was seen (not cut by the image border or hidden)
};

/// Two discs that perception takes for touching, with the push that the paper's contour method finds (Sec. 5, Fig. 7).
struct SceneContact {
  std::uint16_t a = 0, b = 0;          ///< indices into Scene::discs, a < b
  double gap = 0.0;                    ///< from the fitted circles; slightly negative by noise when touching, m
  double p_touch = 0.0;                ///< probability that they touch
  Vector2 push_start_W{0.0, 0.0};      ///< end of the overlap's long axis nearer to the arm, m
  Vector2 push_direction_W{0.0, 0.0};  ///< unit vector along the overlap's long axis, away from the arm
  double contour_length = 0.0;         ///< extent of the overlap along that axis, m
};

/// Most foreign objects that a scene names.
inline constexpr std::size_t kMaxSceneForeign = 16;

/// Something on or over the table that is neither disc nor arm. Nothing may be moved while there is one.
struct ForeignObject {
  enum class Kind : std::uint8_t {
    kPaint = 0,     ///< a coloured patch that is no disc
    kHeight = 1,    ///< stands up from the table where no disc is
    kOffTable = 2,  ///< round like a disc, but its top is not at the height of one: it lies on something, or something on it
  };
  Kind kind = Kind::kPaint;
  Vector2 p_W{0.0, 0.0};  ///< its middle, m
  double extent = 0.0;    ///< half of its largest width, m
  double height = 0.0;    ///< above the table, m; 0: not known
};

enum class SceneQuality : std::uint8_t {
  kOk = 0,
  kDark = 1,       ///< the image carries no usable light
  kFrozen = 2,     ///< the same content under new stamps
  kBadImage = 3,   ///< wrong size, encoding or stamp
  kMisplaced = 4,  ///< the camera is not where its calibration says
};

/// What stands on the table. Travels on `cell/scene` once per camera frame.
struct Scene {
  std::uint64_t seq = 0;
  std::uint64_t frame_seq = 0;  ///< sequence number of the colour frame that it was made from
  Time exposed{};               ///< when that frame was exposed
  SceneQuality quality = SceneQuality::kOk;
  double max_speed = 0.0;  ///< fastest disc since the last frame, m/s; infinity when a disc came or went
  /// Every disc rests: by all that was seen of them since they last moved, none is faster than kRestSpeed, with 95 % confidence. Also true of an
  /// empty table.
  bool at_rest = false;
  Duration age{};  ///< from the exposure to when the scene was sent; 0 where stamps are not of the clock that people live by (lockstep)
  std::vector<SceneDisc> discs;  ///< at most kMaxSceneDiscs
  std::vector<SceneContact> contacts;
  std::vector<ForeignObject> foreign;  ///< at most kMaxSceneForeign
  std::string text;                    ///< for people, when quality is not kOk
};

const char* to_string(SceneQuality quality) noexcept;
const char* to_string(ForeignObject::Kind kind) noexcept;
/// For people: what it is, where, how large.
std::string describe(const ForeignObject& object);

/// What a scene knows of the gap between two of its discs.
struct SceneGap {
  double mean = 0.0;   ///< slightly negative by noise when they touch, m
  double sigma = 0.0;  ///< standard deviation of its error, m
};
SceneGap gap_between(const SceneDisc& a, const SceneDisc& b) noexcept;

/// Smallest gap between any two discs of the scene, m; infinity with fewer than two.
double smallest_gap(const Scene& scene) noexcept;

}  // namespace breakshot
