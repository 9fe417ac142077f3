#pragma once

#include "controller/motion/stroke_search.hpp"

#include <algorithm>
#include <array>
#include <span>

// What the two halves of StrokeSearch share. Private to it.

namespace breakshot::motion {

/// Distance in time of a dip's samples on which the search decides, s.
inline constexpr double kDipStep = 0.006;

/// Shares of the joints' acceleration and jerk that the vertical motion of a dip may take, most first: the less, the longer the striker is low, but
/// the more is left for what the line itself asks of the joints.
inline constexpr std::array kClimbShares{0.9, 0.65, 0.45, 0.3, 0.2, 0.12};
inline constexpr std::array kMoreClimbShares{0.9, 0.65, 0.45, 0.3, 0.2, 0.12, 0.07, 0.04};
/// Accelerations along the line at a hit's contact, as shares of the least and the most that the joints allow there: through it at constant speed
/// when they can, or speeding up, or slowing down.
struct AlongShare {
  double of_least, of_most;
};
inline constexpr std::array<AlongShare, 4> kAlongShares{{{0.0, 0.0}, {0.0, 0.6}, {0.6, 0.0}, {0.5, 0.5}}};
inline constexpr std::array<AlongShare, 10> kMoreAlongShares{
    {{0.0, 0.0}, {0.0, 0.6}, {0.6, 0.0}, {0.5, 0.5}, {0.0, 0.3}, {0.0, 0.85}, {0.3, 0.0}, {0.85, 0.0}, {0.7, 0.3}, {0.3, 0.7}}};
inline constexpr std::array kJerkShares{1.0};
inline constexpr std::array kMoreJerkShares{1.0, 0.5};

/// Shapes of the dip that a search tries.
struct StrokeSearch::Variety {
  std::span<const double> climb_shares;
  std::span<const AlongShare> along_shares;
  std::span<const double> jerk_shares;  ///< of a run-up's jerk, as long as none is found
  /// How often the acceleration along the line is cut, and to what, when a dip asks too much of the joints.
  int cuts;
  double cut;
};

inline constexpr StrokeSearch::Variety kUsual{kClimbShares, kAlongShares, kJerkShares, 3, 0.6};
/// For a stroke that is near to what the arm can do, when none of the usual shapes will do: some times the work.
inline constexpr StrokeSearch::Variety kThorough{kMoreClimbShares, kMoreAlongShares, kMoreJerkShares, 6, 0.75};

/// Largest tip acceleration along a direction, by the joint speeds that go with unit tip speed there.
inline double tip_limit(const JointVector& joint_per_tip, double joint_limit) noexcept {
  return joint_limit / std::max(joint_per_tip.cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace breakshot::motion
