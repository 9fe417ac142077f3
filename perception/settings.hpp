#pragma once

#include "common/geometry.hpp"
#include "common/table_markers.hpp"
#include "common/time.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::perception {

/// The part of HSV space that one colour of disc takes; closed ranges. Hue in degrees in [0, 360]: hue_min > hue_max runs through 0 (red).
/// What is nearly grey or nearly black has no hue worth the name, so the lower bounds matter.
struct ColourRange {
  std::string name;
  double hue_min_deg = 0.0, hue_max_deg = 360.0;
  double saturation_min = 0.35, saturation_max = 1.0;
  double value_min = 0.10, value_max = 1.0;
  std::optional<double> paint_hue_deg{};  ///< of the paint itself under the reference light; nothing: not known
};

/// How discs are found. `paper` is there to be compared with.
enum class Method : std::uint8_t {
  kRobust,  ///< under the light of now, circles through sub-pixel edges, with covariance; touching by the gap between them
  kPaper,   ///< HSV ranges as they are, a disc for each patch: its middle and its area, to a pixel; touching where thick contours overlap
};

/// The method of the paper, Sec. 5: contours made thicker, their overlap taken for a contact, its long axis for the push.
struct PaperContourSettings {
  /// Width of the drawn contour, px, odd. Contours up to about this width apart overlap, so it sets the gap that the method takes for a contact.
  int thickness_px = 5;
  /// Overlaps of fewer pixels are noise, px.
  int min_overlap_px = 10;
  /// Cut the side wall off a disc's segment (by its fitted circle) before the contour is taken. The paper's discs lie where the camera sees
  /// little of their walls; without the cut a wall hides the gap behind it, up to 7 mm at the workspace's edge, and reads as a contact.
  bool cut_walls = true;
};

/// How the camera's place is watched by the markers on the table.
struct CameraWatchSettings {
  TableMarkers markers;  ///< none: not watched
  Rect workspace;        ///< where the table must show no shift
  Duration period{std::chrono::milliseconds{500}};
  double max_shift = 0.5e-3;  ///< of a place of the table in the image, by which the camera counts as moved, m
};

/// What the Perceiver needs to know. Defaults fit the cell as shipped.
struct PerceptionSettings {
  // The cell's own section.
  std::vector<ColourRange> colours;  ///< at most 250; SceneDisc::colour indexes it
  double disc_height = 0.020;        ///< m
  Vector2 p_WB{-0.5, 0.0};           ///< base of the arm: pushes start at the end nearer to it

  // The section `perception`.
  Method method = Method::kRobust;
  std::array<double, 3> table_rgb{194.0, 191.0, 184.0};  ///< colour of the table under the reference light, encoded, [0, 255]
  double radius_min = 0.015, radius_max = 0.060;         ///< what counts as a disc, m
  int morphology_px = 3;                                 ///< side of the square of opening and closing, px, odd
  /// Exponent of the camera's encoding, by which pixel values become light before edges are measured: 2.2 for a real camera, whose pixels
  /// average light; 1 for the simulator, whose pixels average encoded values. A wrong one shifts edges by up to 0.2 px.
  double edge_gamma = 1.0;
  double min_seen_arc_deg = 100.0;  ///< least part of a disc's outline that must be seen, or it is not reported
  // The errors of an edge point, as measured on rendered images (breakshot-bench-perception): what is independent from point to point is
  // taken from the fit's own residuals, but not below the floor; what neighbouring points share, and what all points share, is not seen there.
  double edge_sigma_floor = 50e-6;  ///< m
  double edge_patch_sigma = 5e-6;   ///< shared by the points of an eighth of the outline (shading, sampling), m
  double edge_arc_sigma =
      20e-6;  ///< the same of a short arc, where such errors do not cancel as all around; in between by what is missing, m
  double edge_foot_sigma = 50e-6;   ///< shared by all points where the wall meets the table (contact shadow), m
  double edge_common_sigma = 6e-6;  ///< shared by all points: goes into the radius, not into the centre, m
  double touch_gap = 0.5e-3;        ///< pairs nearer than this touch; p_touch = P(gap < touch_gap), m
  double arm_margin = 0.006;        ///< the arm hides so much more than its shapes say (needs the poses of its links), m
  double occluder_height = 0.060;   ///< what stands higher than this above the table is the arm, m (needs depth)
  double max_disc_speed = 3.0;      ///< bounds the search from frame to frame, m/s
  double dark_level = 24.0;         ///< a frame whose brightest percent stays below this carries no light, [0, 255]
  PaperContourSettings paper;
  CameraWatchSettings watch;
};

}  // namespace breakshot::perception
