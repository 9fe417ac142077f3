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
/// Outlines, also those of the holes between discs, are cut into arcs where they turn too sharply for any disc. Each outline point is put on the
/// plane of the rim that bounds the silhouette there, which its normal tells (see View). Circles through single arcs and through pairs of
/// arcs are candidates; one counts for as much of its circumference as outline points lie on it and face the right way. The best is taken,
/// its points are used up, and so on while a good arc is left; of circles that would overlap a better one none is taken. Points
/// on the image's border or where the arm is known to be are no part of a disc's outline; other straight pieces agree with no circle.
class OutlineGuesser {
 public:
  /// All of them are kept by reference; the mask is the one of the frame that guess() works on.
  OutlineGuesser(const View& view, const PerceptionSettings& settings, const ArmMask& arm);

  /// @return the guesses of all regions; the same for the same input
  /// Cost: about 50 us per disc; up to twice that where many touch in one colour.
  std::vector<CircleGuess> guess(std::span<const Region> regions) const;

 private:
  const View& view_;
  const PerceptionSettings& settings_;
  const ArmMask& arm_;
};

}  // namespace breakshot::perception
