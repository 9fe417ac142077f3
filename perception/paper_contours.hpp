#pragma once

#include "common/geometry.hpp"
#include "perception/disc_fit.hpp"
#include "perception/segmentation.hpp"
#include "perception/settings.hpp"
#include "perception/view.hpp"

#include <opencv2/core.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace breakshot::perception {

/// A contact as the paper finds it, with the push that parts the pair.
struct ContourContact {
  std::size_t a = 0, b = 0;            ///< indices of the discs, a < b
  Vector2 push_start_W{0.0, 0.0};      ///< end of the overlap's long axis nearer to the arm, m
  Vector2 push_direction_W{0.0, 0.0};  ///< unit vector along that axis, away from the arm
  double contour_length = 0.0;         ///< extent of the overlap along it, m
};

/// The discs as the paper's segmentation gives them: one for each patch, where the patch's middle is and as large as the patch, walls and all.
/// Discs of one colour that touch are one; what is hidden or cut is smaller. Covariances are those of a whole pixel.
std::vector<DiscFit> paper_discs(const View& view, const PerceptionSettings& settings, std::span<const Region> regions);

/// The contact method of the paper (Sec. 5, Fig. 7): each disc's contour is drawn thicker; where two thick contours overlap the discs count
/// as touching; principal component analysis of the overlapping pixels gives the push axis, along the common tangent.
///
/// It sees no gap narrower than the contours are thick. The principal components are taken in W, on the plane of the top faces, so that
/// perspective and distortion do not turn the axis.
class PaperContours {
 public:
  PaperContours(const View& view, const PerceptionSettings& settings);

  /// Contacts among the discs, ordered by (a, b).
  /// @param regions  the patches that the discs were found in; DiscFit::region indexes them
  /// Cost: about 30 us per disc and 20 us per pair of neighbours.
  const std::vector<ContourContact>& find(std::span<const Region> regions, std::span<const DiscFit> discs);

 private:
  struct ThickContour {
    cv::Rect box;     // in the image
    cv::Mat1b drawn;  // the size of box, 255 on the contour
  };
  void draw(const Region& region, const DiscFit& disc, ThickContour& out);
  bool contact(const ThickContour& a, const ThickContour& b, ContourContact& out);

  const View& view_;
  const PerceptionSettings& settings_;
  std::vector<ThickContour> thick_;
  std::vector<ContourContact> contacts_;
  std::vector<cv::Point> overlap_;
  cv::Mat1b clip_, both_;
};

}  // namespace breakshot::perception
