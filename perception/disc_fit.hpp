#pragma once

#include "common/frames.hpp"
#include "perception/arm_mask.hpp"
#include "perception/outline_guess.hpp"
#include "perception/rim_circle.hpp"
#include "perception/segmentation.hpp"
#include "perception/settings.hpp"
#include "perception/table_light.hpp"
#include "perception/view.hpp"

#include <opencv2/core.hpp>

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace breakshot::perception {

/// A circle fitted to the sub-pixel edges of a disc's outline.
struct DiscFit {
  Vector2 p_WD{0.0, 0.0};               ///< m
  double radius = 0.0;                  ///< m
  Matrix3 covariance{Matrix3::Zero()};  ///< of (x, y, radius), m^2
  double seen_share = 0.0;              ///< of the outline's directions: an edge of this disc was found there
  double hidden_share = 0.0;            ///< no edge there, and no neighbour disc that explains it
  double missing_share = 0.0;           ///< the part of it that is neither beyond the image nor where the arm is known to be
  bool complete = false;                ///< so little of it is hidden that noise and highlights explain it
  std::uint8_t colour = 0;
  std::size_t region = 0;
};

/// Fits discs to an image, from guesses that are good to about two pixels.
///
/// In each of many directions it walks across the predicted rim (top or base, see View), takes the mean colours just inside and just
/// outside, and puts the edge where the colour is half-way between them: with the two sides measured on the spot, and the disc's part of a
/// mixture told by its hue, neither lighting, nor the shade of a bevel or a wall, nor the table's colour shifts it. Directions that look onto a neighbour
/// disc, and those where the arm is known to be, are left out rather than trusted. A robust least-squares circle follows; when a good part of
/// the outline is missing, through those edges only that most of them agree on.
class DiscFitter {
 public:
  /// All of them are kept by reference.
  DiscFitter(const View& view, const PerceptionSettings& settings, const Segmenter& segmenter, const ArmMask& arm);

  /// The light of the frames from now on: how much contrast an edge can have.
  void adapt(const TableLight& light) noexcept;

  /// @param guess          what to refine
  /// @param all            every disc of the scene as known so far; entry `self` is guess's own and is skipped
  /// @param depth          registered to rgb, or null
  /// @param fitted_before  the guess is a fit's, good to a tenth of a pixel
  /// @return nothing when too little of the outline is seen, or when it is no circle of allowed size
  /// Cost: about 0.1 ms per disc, half of that for one that was fitted before.
  std::optional<DiscFit> fit(const cv::Mat3b& rgb, const DepthFrame* depth, const CircleGuess& guess, std::span<const CircleGuess> all,
                             std::size_t self, bool fitted_before) const;

 private:
  enum class Look {
    kEdge,
    kNeighbour,   // looks onto another disc
    kNarrowWall,  // the base rim lies so close to the top rim that a line across it crosses both, and no edge is told from the other
    kHidden,      // beyond the image, or behind what is known to be the arm
    kNothing,     // no edge of this disc there
  };

  // Measures the edge in direction edge.n_W within `reach` px of the disc's predicted rim; `edge` receives its range and trust.
  Look look(const cv::Mat3b& rgb, const DepthFrame* depth, const CircleGuess& disc, std::span<const CircleGuess> near, double reach,
            Edge& edge) const;
  bool too_little(std::size_t seen, int explained, int directions) const noexcept;
  bool occluded(const DepthFrame& depth, const Vector2& pixel) const noexcept;

  const View& view_;
  const PerceptionSettings& settings_;
  const Segmenter& segmenter_;
  const ArmMask& arm_;
  std::vector<Vector2> directions_;  // all around
  Vector3 up_C_;                     // z of W
  float level_ = 1.0F;               // of the light, 1 for the reference or more
  std::array<float, 256> light_;     // of an encoded value, scaled to [0, 255]
};

}  // namespace breakshot::perception
