#include "tests/controller/loop/harness.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::control::test {

LoopConfig test_config() {
  LoopConfig config;
  config.limits.joints = kJoints;
  for (std::size_t j = 0; j < kJoints; ++j) {
    config.limits.lower[j] = -3.0;
    config.limits.upper[j] = 3.0;
    config.limits.max_speed[j] = 3.14;
    config.limits.max_acceleration[j] = 20.0;
  }
  config.drive_lag = Duration::zero();  // FakeDrives are ideal
  config.session = 42;
  return config;
}

FakeDrives::FakeDrives(std::uint64_t session)
    : session_{session},
      q_{JointVector::LinSpaced(kJoints, -0.5, 0.7)},
      qd_{JointVector::Zero(kJoints)},
      offset_{JointVector::Zero(kJoints)} {}

void FakeDrives::take(const JointCommand& command) {
  if (command.q.size() != kJoints) return;
  if (ticks_without_command_ > 20) {
    commander_ = command.session;
    commands_.clear();
  }
  if (command.session != commander_) return;
  if (!commands_.empty() && command.seq <= commands_.back().seq) return;
  commands_.push_back(command);
  if (commands_.size() > 30) commands_.erase(commands_.begin());
  command_seq_ = command.seq;
  ticks_without_command_ = 0;
}

void FakeDrives::step() {
  const double dt = to_seconds(kTick);
  now_ += kTick;
  ++seq_;
  const double slip = std::clamp(slip_left_, -2.0 * dt, 2.0 * dt);
  slip_left_ -= slip;
  offset_[slipping_joint_] += slip;
  q_[slipping_joint_] += slip;
  move();
  if (blocked_joint_ >= 0) {
    q_[blocked_joint_] = blocked_at_;
    qd_[blocked_joint_] = 0.0;
  }
}

void FakeDrives::move() {
  const double dt = to_seconds(kTick);
  if (++ticks_without_command_ > 20) {
    for (int j = 0; j < kJoints; ++j) {
      const double slower = std::copysign(std::max(0.0, std::abs(qd_[j]) - 20.0 * dt), qd_[j]);
      q_[j] += 0.5 * (qd_[j] + slower) * dt;
      qd_[j] = slower;
    }
    return;
  }
  auto after = std::find_if(commands_.begin(), commands_.end(), [&](const JointCommand& c) { return c.due >= now_; });
  if (after == commands_.begin()) return;  // not due yet
  if (after == commands_.end()) {
    const JointCommand& newest = commands_.back();
    q_ = newest.q + newest.qd * to_seconds(now_ - newest.due) + offset_;
    qd_ = newest.qd;
    return;
  }
  const JointCommand& a = *(after - 1);
  const JointCommand& b = *after;
  const double h = to_seconds(b.due - a.due);
  const double x = to_seconds(now_ - a.due) / h;
  const double x2 = x * x, x3 = x2 * x;
  q_ = (2 * x3 - 3 * x2 + 1) * a.q + (x3 - 2 * x2 + x) * h * a.qd + (3 * x2 - 2 * x3) * b.q + (x3 - x2) * h * b.qd + offset_;
  qd_ = (1 - x) * a.qd + x * b.qd;
}

void FakeDrives::step_to(Time now) {
  if (now - now_ > std::chrono::milliseconds{50}) now_ = now - kTick;
  while (now_ < now) step();
}

void FakeDrives::restart() {
  FakeDrives fresh{session_ + 1};
  fresh.q_ = q_;
  fresh.now_ = now_;
  *this = fresh;
}

JointState FakeDrives::state() const {
  JointState state;
  state.seq = seq_;
  state.session = session_;
  state.stamp = now_;
  state.q = q_;
  state.qd = qd_;
  state.tau = JointVector::Zero(kJoints);
  state.command_seq = command_seq_;
  state.braked = ticks_without_command_ > 20;
  return state;
}

safety::JointArray all(double value) {
  safety::JointArray array{};
  std::fill_n(array.begin(), kJoints, value);
  return array;
}

std::unique_ptr<motion::Trajectory> make_trajectory(const safety::JointArray& from, const safety::JointArray& by, std::uint64_t id,
                                                    std::size_t ticks) {
  auto trajectory = std::make_unique<motion::Trajectory>();
  trajectory->stroke_id = id;
  trajectory->joints = kJoints;
  trajectory->size = ticks;
  trajectory->contact_tick = ticks / 2;
  trajectory->tick = kTick;
  const double total = to_seconds(kTick) * static_cast<double>(ticks - 1);
  for (std::size_t k = 0; k < ticks; ++k) {
    auto& point = trajectory->points[k];
    // Minimum-jerk polynomial: rest to rest, with acceleration zero at both ends.
    const double x = static_cast<double>(k) / static_cast<double>(ticks - 1);
    for (std::size_t j = 0; j < kJoints; ++j) {
      point.q[j] = from[j] + by[j] * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
      point.qd[j] = by[j] * 30.0 * x * x * (1.0 - x) * (1.0 - x) / total;
      point.qdd[j] = by[j] * 60.0 * x * (1.0 - 3.0 * x + 2.0 * x * x) / (total * total);
    }
    using enum StrokePhase;
    const std::size_t fifth = 5 * k / ticks;
    point.phase = fifth < 2                       ? kTransit
                  : k <= trajectory->contact_tick ? kRunIn
                  : fifth < 3                     ? kFollowThrough
                  : fifth < 4                     ? kRetreat
                                                  : kParking;
  }
  return trajectory;
}

std::unique_ptr<motion::Trajectory> make_joined(const motion::Trajectory& first, std::size_t tick, const safety::JointArray& by,
                                                std::uint64_t id) {
  auto joined = make_trajectory(first.points[first.size - 1].q, by, id, 400);
  const std::size_t rest = first.size - 1 - tick;
  std::copy_backward(joined->points.begin(), joined->points.begin() + static_cast<std::ptrdiff_t>(joined->size),
                     joined->points.begin() + static_cast<std::ptrdiff_t>(joined->size + rest));
  std::copy_n(first.points.begin() + static_cast<std::ptrdiff_t>(tick), rest, joined->points.begin());
  for (std::size_t k = 0; k < rest; ++k) joined->points[k].phase = StrokePhase::kTransit;
  joined->size += rest;
  joined->contact_tick += rest;
  return joined;
}

Stand::Stand(const LoopConfig& with, FlightTap* flight) : config{with}, loop{with, channels, flight}, drives{7} {}

JointCommand Stand::tick(const Upset& upset) {
  for (int i = 0; i < 1 + upset.skip + upset.freeze; ++i) drives.step();
  const JointState state = upset.instead ? *upset.instead : drives.state();
  last = loop.tick(upset.lose_state ? nullptr : &state, drives.now_);
  if (!upset.lose_command) drives.take(last);
  return last;
}

bool Stand::get_ready() {
  for (int i = 0; i < 100 && !status().ready(); ++i) tick();
  return status().ready();
}

bool Stand::run_until(LoopEvent::Kind kind, int limit) {
  for (int i = 0; i < limit && find(kind) == nullptr; ++i) tick();
  return find(kind) != nullptr;
}

const std::vector<LoopEvent>& Stand::events() {
  LoopEvent event;
  while (channels.events.pop(event)) events_.push_back(event);
  return events_;
}

const LoopEvent* Stand::find(LoopEvent::Kind kind) {
  events();
  const auto found = std::find_if(events_.begin(), events_.end(), [&](const LoopEvent& event) { return event.kind == kind; });
  return found == events_.end() ? nullptr : &*found;
}

}  // namespace breakshot::control::test
