#pragma once

#include "perception/arm_mask.hpp"
#include "perception/segmentation.hpp"
#include "perception/settings.hpp"
#include "perception/view.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace breakshot::perception {

/// A circle of the table plane, good to about a pixel.
struct CircleGuess {
  Vector2 p_WD{0.0, 0.0};  ///< m
  double radius = 0.0;     ///< m
  std::uint8_t colour = 0;
  std::size_t region = 0;  ///< index of the patch that it came from
};

/// Finds the discs behind the outlines of coloured patches: one for a patch of one disc, several where discs of one colour touch.
///
/// Samples three outline points, draws their circle and counts the outline points that agree, each on the plane of its rim (see View);
/// takes the best circle, removes its points and goes on while a good arc is left. Points on the image's border or where the arm is known to
/// be are no part of a disc's outline; other straight pieces agree with no circle.
class OutlineGuesser {
 public:
  /// All of them are kept by reference; the mask is the one of the frame that guess() works on.
  OutlineGuesser(const View& view, const PerceptionSettings& settings, const ArmMask& arm);

  /// @return the guesses of all regions; the same for the same input (its random draws start anew on each call)
  std::vector<CircleGuess> guess(std::span<const Region> regions) const;

 private:
  const View& view_;
  const PerceptionSettings& settings_;
  const ArmMask& arm_;
};

}  // namespace breakshot::perception
