#include "controller/motion/transit.hpp"

#include <ruckig/ruckig.hpp>

#include <vector>

namespace breakshot::motion {
namespace {

void copy(const JointVector& from, std::vector<double>& to) { to.assign(from.data(), from.data() + from.size()); }
JointVector joints(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>{v.data(), static_cast<Eigen::Index>(v.size())};
}

}  // namespace

struct Transit::Solver {
  Solver(std::size_t n, double tick) : ruckig{n, tick}, input{n}, trajectory{n}, q(n), qd(n), qdd(n) {}

  ruckig::Ruckig<ruckig::DynamicDOFs> ruckig;
  ruckig::InputParameter<ruckig::DynamicDOFs> input;
  ruckig::Trajectory<ruckig::DynamicDOFs> trajectory;
  std::vector<double> q, qd, qdd;
};

Transit::Transit(const JointLimits& limits, double tick)
    : solver_{std::make_unique<Solver>(static_cast<std::size_t>(limits.speed.size()), tick)} {
  auto& input = solver_->input;
  copy(limits.speed, input.max_velocity);
  input.max_acceleration.assign(input.degrees_of_freedom, limits.acceleration);
  input.max_jerk.assign(input.degrees_of_freedom, limits.jerk);
  input.duration_discretization = ruckig::DurationDiscretization::Discrete;
}

Transit::~Transit() = default;

bool Transit::plan(const MotionState& from, const MotionState& to) {
  auto& input = solver_->input;
  copy(from.q, input.current_position);
  copy(from.qd, input.current_velocity);
  copy(from.qdd, input.current_acceleration);
  copy(to.q, input.target_position);
  copy(to.qd, input.target_velocity);
  copy(to.qdd, input.target_acceleration);
  // With both ends checked against the limits, ruckig guarantees them in between.
  if (!solver_->ruckig.validate_input<false>(input, true, true)) return false;
  const ruckig::Result result = solver_->ruckig.calculate(input, solver_->trajectory);
  return result == ruckig::Result::Working || result == ruckig::Result::Finished;
}

double Transit::duration() const { return solver_->trajectory.get_duration(); }

void Transit::at(double t, MotionState& state) {
  solver_->trajectory.at_time(t, solver_->q, solver_->qd, solver_->qdd);
  state = {joints(solver_->q), joints(solver_->qd), joints(solver_->qdd)};
}

}  // namespace breakshot::motion
