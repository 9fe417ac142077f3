#pragma once

#include "common/frames.hpp"
#include "common/scene.hpp"
#include "perception/arm_mask.hpp"
#include "perception/disc_fit.hpp"
#include "perception/segmentation.hpp"
#include "perception/settings.hpp"
#include "perception/view.hpp"

#include <opencv2/core.hpp>

#include <span>
#include <vector>

namespace breakshot::perception {

/// Finds what is neither table nor disc nor arm: a hand, a tool, a disc that does not lie on the table.
///
/// By colour: paint that the fitted discs do not cover. By depth: what stands up from the table beside discs and arm, and discs whose top faces
/// are not where those of discs on the table are. Heights are means over many pixels, and are counted from the table as depth shows it: one
/// pixel is off by 2.4 mm, and a whole depth image of a real camera may be by as much as a disc is high. What the arm or the image's border
/// cuts may be a disc of which too little is seen, and is let pass as long as it is no higher than one.
class ForeignObjects {
 public:
  ForeignObjects(const View& view, const PerceptionSettings& settings, const ArmMask& arm);

  /// Whether the mask says where the arm is. If not, it is found in the depth image, as what hangs together with its base; where that does not show, or
  /// there is no depth, nothing is reported: the arm itself would be.
  enum class ArmKnown : std::uint8_t { kNo, kYes };

  /// @param depth  registered to the colour image, or null
  /// @return at most kMaxSceneForeign
  /// Cost: about 0.2 ms with depth.
  std::vector<ForeignObject> find(std::span<const Region> regions, std::span<const DiscFit> discs, const DepthFrame* depth, ArmKnown known);

 private:
  enum Block : std::uint8_t { kTable, kDisc, kArm };  // what the 16 x 16 px of a block show of; the latter goes before

  std::vector<cv::Point> silhouette(const DiscFit& disc, double margin) const;
  void find_paint(std::span<const Region> regions, std::span<const DiscFit> discs, std::vector<ForeignObject>& out);
  bool behind_arm(const cv::Point& pixel) const noexcept;
  void find_blocks(const DepthFrame& depth);
  void measure_table();
  void widen_arm();
  bool find_arm();
  void find_heights(std::span<const DiscFit> discs, const DepthFrame& depth, std::vector<ForeignObject>& out);
  double height_of_top(const DiscFit& disc, const DepthFrame& depth) const;
  bool cut(const Region& region) const;
  double height(const DepthFrame& depth, int x, int y) const noexcept;
  Vector2 place(const Vector2& pixel, double height) const { return view_.camera.point_on_plane(pixel, height); }

  const View& view_;
  const PerceptionSettings& settings_;
  const ArmMask& arm_;
  std::vector<float> slope_;  // of samples kGlance px apart: height per range along the optical axis
  cv::Mat1b shown_;           // per block: a Block; empty without depth
  cv::Mat1f mean_;            // height of a block above the table's plane, m; NaN: unknown
  cv::Mat1b left_, tall_;
  cv::Mat1i components_;
  std::vector<float> heights_;
  double table_height_ = 0.0;  // as depth shows it, m
};

}  // namespace breakshot::perception
