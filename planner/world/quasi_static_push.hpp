#pragma once

#include "common/result.hpp"
#include "planner/world/disc.hpp"
#include "planner/world/virtual_world.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace breakshot::world {

/// What a slow push does, without time: discs move only while something pushes them.
///
/// Along the striker's line, in steps of kPushStep, every disc in the way is moved along the contact normal just far enough, and discs that
/// then overlap give way to each other until none does. Exact for discs that only the striker touches: a push between two touching discs
/// leaves a gap of twice the striker's radius after a travel of (R+r) artanh(q) and drags them by (R+r)(artanh(q) - q) (singulation.md,
/// own fact 1).
/// Approximate for discs that push discs: they share the way equally, as if friction grew with speed, where Coulomb friction would move some
/// and leave others; positions within stacks are then off by some millimetres. The dynamics that a real push has (the first touch bounces
/// the discs off, each slides on v^2 / (2 mu g) when it is let go: 2 mm at 0.1 m/s) are left out. VirtualWorld runs the same push with them.
class QuasiStaticPush {
 public:
  /// Travel of the striker between two looks at the overlaps, m: a small part of any radius here.
  static constexpr double kPushStep = 5e-4;

  /// Pushes along run.p_WS + [0, length] run.direction; speed and braking do not matter here.
  ///
  /// Refuses what VirtualWorld refuses. `p_WD` of the result belongs to this object and lasts until its next call.
  /// Cost: about 20 us for six discs and 60 mm. Allocates only for more discs than ever before.
  Result<std::span<const Vector2>, WorldInputError> run(std::span<const Disc> discs, const StrikerRun& run, double length,
                                                        double allowed_overlap = 1e-5) &;

 private:
  /// Two discs near enough to overlap before the next look.
  struct Near {
    std::size_t a = 0, b = 0;
    double reach = 0.0;
  };
  bool part_from_striker(const Vector2& p_WS, double radius) noexcept;
  double part_from_each_other() noexcept;
  void look_who_is_near();
  bool someone_went_far() const noexcept;

  std::vector<Vector2> p_WD_;
  std::vector<double> radius_;
  std::vector<Near> near_;
  std::vector<Vector2> p_WD_then_;  // when near_ was made
};

}  // namespace breakshot::world
