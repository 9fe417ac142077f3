#pragma once

#include "controller/kinematics/general_ik.hpp"
#include "controller/kinematics/parallel_axes_ik.hpp"
#include "controller/kinematics/spherical_wrist_ik.hpp"

#include <array>
#include <cstddef>
#include <optional>
#include <variant>

namespace breakshot::kinematics {

/// Joint vectors that put the tip in one pose, each within limits, nearest to the reference first.
struct IkSolutions {
  static constexpr std::size_t kCapacity = kMaxBranches;

  std::array<JointVector, kCapacity> q;
  std::size_t size = 0;

  const JointVector* begin() const noexcept { return q.data(); }
  const JointVector* end() const noexcept { return q.data() + size; }
  bool empty() const noexcept { return size == 0; }
};

/// The turn of every joint (q + 2 pi k, within limits) that is nearest to `near`; nothing when some joint has none within its limits.
std::optional<JointVector> nearest_turns(const ArmKinematics& arm, const JointVector& q, const JointVector& near) noexcept;

/// Inverse kinematics of any arm: closed form where the geometry allows it (UR class, spherical wrist), else the general solver from many starts.
///
/// Immutable after construction and without allocation, so threads may share one. Keeps a pointer to the arm, which must outlive it.
class InverseKinematics {
 public:
  explicit InverseKinematics(const ArmKinematics& arm, const GeneralIkOptions& options = {});

  bool has_closed_form() const noexcept { return closed_form_.index() != 0; }

  /// Closed form: every branch that has a turn within limits. General: the distinct solutions of up to kGeneralSearches searches.
  /// Distance is the largest joint's way from `near`, which is what a transit's time depends on.
  /// Cost: closed form about 5 us; general up to kGeneralSearches * GeneralIkOptions' bound.
  IkSolutions solve(const Pose& X_WT, const JointVector& near) const noexcept;

  /// Searches of the general solver, to find more than one branch.
  static constexpr int kGeneralSearches = 8;

 private:
  /// All branches in closed form, joints in [-pi, pi]; has_closed_form() is a condition.
  Branches branches(const Pose& X_BT, const JointVector& near) const noexcept;
  void add(IkSolutions& solutions, const JointVector& q) const noexcept;

  const ArmKinematics* arm_;
  GeneralIk general_;
  std::variant<std::monostate, ParallelAxesIk, SphericalWristIk> closed_form_;
};

}  // namespace breakshot::kinematics
