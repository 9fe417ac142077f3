#pragma once

#include "common/camera_model.hpp"
#include "common/frames.hpp"
#include "common/scene.hpp"
#include "common/stroke.hpp"

#include <optional>
#include <string>
#include <vector>

namespace breakshot::perception {

/// What to draw over an image beside its scene.
struct Annotation {
  Rect workspace;
  double disc_height = 0.020;           ///< m
  double striker_radius = 0.010;        ///< m
  double target_gap = 0.015;            ///< G: narrower gaps are drawn amber, wider ones green, m
  std::string headline;                 ///< first line of the banner above the image; no banner when empty
  std::string detail;                   ///< second line of the banner, smaller
  std::optional<StrokeRequest> stroke;  ///< the stroke that was chosen
  std::vector<Vector2> predicted_p_WD;  ///< where the discs are expected to rest, by index of the scene; may be empty
};

/// Draws a scene for people: outlines and ids, the workspace, foreign objects, contacts with their push arrows, gaps in mm, the chosen stroke and what it is
/// expected to do. The result is as wide as the image, and higher by the banner, if there is one.
/// @throws std::invalid_argument when the image has another size than the camera
ColorFrame annotate(const ColorFrame& image, const Scene& scene, const CameraModel& camera, const Annotation& annotation);

}  // namespace breakshot::perception
