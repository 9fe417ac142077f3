#include "controller/kinematics/inverse_kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::kinematics {
namespace {

/// Solutions nearer than this in every joint are one, rad.
constexpr double kSame = 1e-3;

double largest_way(const JointVector& a, const JointVector& b) noexcept { return (a - b).cwiseAbs().maxCoeff(); }

}  // namespace

std::optional<JointVector> nearest_turns(const ArmKinematics& arm, const JointVector& q, const JointVector& near) noexcept {
  constexpr double turn = 2.0 * std::numbers::pi;
  constexpr double rounding = 1e-9;
  JointVector result = q;
  for (int i = 0; i < arm.joints(); ++i) {
    // The turns within limits are k_min..k_max; of these the one nearest to `near`.
    const double k_min = std::ceil((arm.lower()[i] - q[i] - rounding) / turn);
    const double k_max = std::floor((arm.upper()[i] - q[i] + rounding) / turn);
    if (k_min > k_max) return std::nullopt;
    const double k = std::clamp(std::round((near[i] - q[i]) / turn), k_min, k_max);
    result[i] = std::clamp(q[i] + turn * k, arm.lower()[i], arm.upper()[i]);
  }
  return result;
}

InverseKinematics::InverseKinematics(const ArmKinematics& arm, const GeneralIkOptions& options) : arm_{&arm}, general_{arm, options} {
  if (const auto parallel_axes = ParallelAxesIk::recognise(arm)) {
    closed_form_ = *parallel_axes;
  } else if (const auto spherical_wrist = SphericalWristIk::recognise(arm)) {
    closed_form_ = *spherical_wrist;
  }
}

Branches InverseKinematics::branches(const Pose& X_BT, const JointVector& near) const noexcept {
  if (const auto* parallel_axes = std::get_if<ParallelAxesIk>(&closed_form_)) return parallel_axes->solve(X_BT, near[5]);
  return std::get_if<SphericalWristIk>(&closed_form_)->solve(X_BT, near[3]);
}

void InverseKinematics::add(IkSolutions& solutions, const JointVector& q) const noexcept {
  const bool known =
      std::any_of(solutions.begin(), solutions.end(), [&](const JointVector& other) { return largest_way(q, other) < kSame; });
  if (!known && solutions.size < IkSolutions::kCapacity) solutions.q[solutions.size++] = q;
}

IkSolutions InverseKinematics::solve(const Pose& X_WT, const JointVector& near) const noexcept {
  IkSolutions solutions;
  if (has_closed_form()) {
    const Branches all = branches(arm_->X_WB().inverse() * X_WT, near);
    for (std::size_t i = 0; i < all.size; ++i) {
      if (const auto q = nearest_turns(*arm_, all.q[i], near)) solutions.q[solutions.size++] = *q;
    }
  } else {
    int start = 0;
    for (int search = 0; search < kGeneralSearches; ++search) {
      const GeneralIkResult result = general_.solve(X_WT, near, start);
      if (!result.solved) break;  // all starts failed: a further search would only repeat that
      if (const auto q = nearest_turns(*arm_, result.q, near)) add(solutions, *q);
      start += result.starts;
    }
  }
  // Few enough for insertion, with every way measured once.
  std::array<double, IkSolutions::kCapacity> way;
  for (std::size_t i = 0; i < solutions.size; ++i) {
    const JointVector q = solutions.q[i];
    const double way_of_q = largest_way(q, near);
    std::size_t place = i;
    for (; place > 0 && way[place - 1] > way_of_q; --place) {
      way[place] = way[place - 1];
      solutions.q[place] = solutions.q[place - 1];
    }
    way[place] = way_of_q;
    solutions.q[place] = q;
  }
  return solutions;
}

}  // namespace breakshot::kinematics
