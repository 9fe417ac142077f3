#include "planner/world/virtual_world.hpp"

#include "planner/world/formation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace breakshot::world {

namespace {

void require(bool ok, const char* what) {
  if (!ok) throw std::invalid_argument{what};
}

}  // namespace

VirtualWorld::VirtualWorld(const WorldSettings& settings, std::shared_ptr<const ImpactLaw> law)
    : settings_{settings}, law_{std::move(law)} {
  require(law_ != nullptr, "virtual world: no impact law");
  require(settings.friction > 0.0 && std::isfinite(settings.friction), "virtual world: friction must be above 0");
  require(settings.restitution >= 0.0 && settings.restitution <= 1.0, "virtual world: restitution must be in [0, 1]");
  require(settings.striker_restitution >= 0.0 && settings.striker_restitution <= 1.0,
          "virtual world: striker_restitution must be in [0, 1]");
  require(settings.touch_gap >= kContactSlack && settings.touch_gap < 0.01, "virtual world: touch_gap must be in [1 nm, 10 mm)");
  require(settings.allowed_overlap >= 0.0 && settings.allowed_overlap < 0.01, "virtual world: allowed_overlap must be in [0, 10 mm)");
}

Result<Rollout, WorldInputError> VirtualWorld::run(std::span<const Disc> discs, const StrikerRun* striker) & {
  if (auto error = check_formation(discs, settings_.allowed_overlap)) return WorldInputError{std::move(*error)};
  if (striker != nullptr) {
    if (auto error = check_striker(discs, *striker, settings_.allowed_overlap)) return WorldInputError{std::move(*error)};
  }
  load(discs, striker);

  Rollout rollout;
  double time = 0.0;
  // Far above what was seen: a break of 50 discs has some 100 impacts, a push with rubbing contacts some 1,000 per disc pushed.
  const int limit = 20'000 + 2'000 * static_cast<int>(discs.size());
  while (true) {
    std::size_t first = 0;
    double next = kNever;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (soonest_[i].time < next) {
        next = soonest_[i].time;
        first = i;
      }
    }
    const double striker_turn = striker_down_ ? bodies_[discs_].since + bodies_[discs_].motion.end : kNever;
    if (striker_turn <= next) {
      if (striker_turn == kNever) break;
      time = striker_turn;
      advance_striker(time);
      continue;
    }
    time = next;
    if (rollout.impacts++ == limit) {
      rollout.status = Rollout::Status::kEventLimit;
      break;
    }
    if (!resolve_impact(first, soonest_[first].partner, time, rollout)) {
      rollout.status = Rollout::Status::kLawFailed;
      break;
    }
  }

  rollout.duration = time;
  rest_.resize(discs_);
  for (std::size_t i = 0; i < discs_; ++i) {
    const bool stopped_early = rollout.status != Rollout::Status::kAtRest;
    if (!stopped_early) rollout.duration = std::max(rollout.duration, bodies_[i].since + bodies_[i].motion.end);
    rest_[i] = position(bodies_[i], stopped_early ? time : kNever);
  }
  rollout.p_WD = rest_;
  rollout.smallest_gap = kNever;
  for (std::size_t i = 0; i < discs_; ++i) {
    for (std::size_t j = i + 1; j < discs_; ++j) {
      rollout.smallest_gap = std::min(rollout.smallest_gap, (rest_[i] - rest_[j]).norm() - bodies_[i].radius - bodies_[j].radius);
    }
  }
  return rollout;
}

void VirtualWorld::load(std::span<const Disc> discs, const StrikerRun* striker) {
  discs_ = discs.size();
  bodies_.clear();
  for (const Disc& disc : discs) {
    bodies_.push_back({{}, 0.0, disc.radius, 1.0 / disc.mass});
    set_velocity(bodies_.size() - 1, disc.p_WD, disc.v_WD_W, 0.0);
  }
  striker_down_ = striker != nullptr;
  striker_brakes_ = false;
  if (striker != nullptr) {
    striker_ = *striker;
    Body body;
    body.motion = {striker->p_WS, striker->speed * striker->direction, {0.0, 0.0}, striker->cruise / striker->speed, false};
    body.radius = striker->radius;
    body.inverse_mass = 1.0 / striker->mass;
    bodies_.push_back(body);
  }
  pair_time_.assign(bodies_.size() * bodies_.size(), kNever);
  soonest_.assign(bodies_.size(), {});
  group_index_.assign(bodies_.size(), -1);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    for (std::size_t j = i + 1; j < bodies_.size(); ++j) pair_time(i, j) = predict(i, j, 0.0);
    find_soonest(i);
  }
}

Vector2 VirtualWorld::position(const Body& body, double time) const noexcept {
  const double s = std::clamp(time - body.since, 0.0, body.motion.end);
  return body.motion.p + s * (body.motion.v + 0.5 * s * body.motion.a);
}

Motion VirtualWorld::motion_at(const Body& body, double time) const noexcept {
  const double s = time - body.since;
  Motion motion = body.motion;
  motion.p = position(body, time);
  if (s >= body.motion.end) {
    motion.v = motion.a = Vector2::Zero();
    motion.end = 0.0;
  } else {
    motion.v += s * motion.a;
    motion.end -= s;
  }
  return motion;
}

void VirtualWorld::set_velocity(std::size_t body, const Vector2& p, const Vector2& v, double time) noexcept {
  Motion& motion = bodies_[body].motion;
  bodies_[body].since = time;
  motion.p = p;
  motion.v = v;
  motion.rests_after = true;
  const double speed = v.norm();
  const double deceleration = settings_.friction * kGravity;
  motion.end = speed / deceleration;
  motion.a = speed > 0.0 ? Vector2{-(deceleration / speed) * v} : Vector2{0.0, 0.0};
}

double VirtualWorld::predict(std::size_t i, std::size_t j, double time) const noexcept {
  if (j == discs_ && !striker_down_) return kNever;
  const double in = next_collision(motion_at(bodies_[i], time), motion_at(bodies_[j], time), bodies_[i].radius + bodies_[j].radius);
  return in == kNever ? kNever : time + in;
}

void VirtualWorld::predict_all_of(std::size_t body, double time) noexcept {
  for (std::size_t other = 0; other < bodies_.size(); ++other) {
    if (other == body) continue;
    store_prediction(std::min(body, other), std::max(body, other), predict(std::min(body, other), std::max(body, other), time));
  }
}

void VirtualWorld::store_prediction(std::size_t i, std::size_t j, double when) noexcept {
  pair_time(i, j) = when;
  if (when < soonest_[i].time) {
    soonest_[i] = {when, j};
  } else if (soonest_[i].partner == j && soonest_[i].time != when) {
    find_soonest(i);
  }
}

void VirtualWorld::find_soonest(std::size_t row) noexcept {
  Soonest best;
  for (std::size_t j = row + 1; j < bodies_.size(); ++j) {
    if (pair_time(row, j) < best.time) best = {pair_time(row, j), j};
  }
  soonest_[row] = best;
}

void VirtualWorld::advance_striker(double time) noexcept {
  Body& striker = bodies_[discs_];
  if (striker_brakes_) {
    striker_down_ = false;
  } else {
    striker_brakes_ = true;
    const Vector2 p = position(striker, time);
    striker.since = time;
    striker.motion.p = p;
    striker.motion.a = -striker_.braking * striker_.direction;
    striker.motion.end = std::min(striker_.speed / striker_.braking, striker_.lift);
  }
  predict_all_of(discs_, time);
}

void VirtualWorld::gather_contacts(std::size_t i, std::size_t j, double time) {
  group_.assign({i, j});
  group_index_[i] = 0;
  group_index_[j] = 1;
  contacts_.clear();
  group_p_.assign({position(bodies_[i], time), position(bodies_[j], time)});
  // The group grows while it is walked; each contact is noted when its second body is walked.
  for (std::size_t k = 0; k < group_.size(); ++k) {
    const std::size_t body = group_[k];
    for (std::size_t other = 0; other < bodies_.size(); ++other) {
      if (other == body || (other == discs_ && !striker_down_)) continue;
      const int known = group_index_[other];
      const Vector2 p_other = known >= 0 ? group_p_[static_cast<std::size_t>(known)] : position(bodies_[other], time);
      const Vector2 p = p_other - group_p_[k];
      const double reach = bodies_[body].radius + bodies_[other].radius;
      const double near = reach + settings_.touch_gap;
      const bool struck = (body == i && other == j) || (body == j && other == i);
      if (!struck && p.squaredNorm() > near * near) continue;
      if (known < 0) {
        group_index_[other] = static_cast<int>(group_.size());
        group_.push_back(other);
        group_p_.push_back(p_other);
      } else if (static_cast<std::size_t>(known) < k) {
        const bool with_striker = body == discs_ || other == discs_;
        contacts_.push_back(
            {known, static_cast<int>(k), -p.normalized(), with_striker ? settings_.striker_restitution : settings_.restitution});
      }
    }
  }
}

bool VirtualWorld::resolve_impact(std::size_t i, std::size_t j, double time, Rollout& rollout) {
  gather_contacts(i, j, time);
  group_v_.clear();
  group_inverse_mass_.clear();
  bool with_striker = false;
  for (const std::size_t body : group_) {
    group_v_.push_back(motion_at(bodies_[body], time).v);
    group_inverse_mass_.push_back(bodies_[body].inverse_mass);
    with_striker = with_striker || body == discs_;
    group_index_[body] = -1;
  }
  group_v_before_ = group_v_;

  const Vector2 n = (group_p_[1] - group_p_[0]).normalized();
  const double approach_before = (group_v_[0] - group_v_[1]).dot(n);
  law_->resolve({contacts_, group_inverse_mass_, group_v_}, scratch_);

  if (!with_striker) {
    const double before = kinetic_energy(group_inverse_mass_, group_v_before_);
    const double after = kinetic_energy(group_inverse_mass_, group_v_);
    rollout.energy_gain = std::max(rollout.energy_gain, after / before - 1.0);
  }
  for (std::size_t k = 0; k < group_.size(); ++k) {
    const std::size_t body = group_[k];
    // The drives carry the striker on along its run, whatever the impact did to it.
    if (body == discs_ || group_v_[k] == group_v_before_[k]) continue;
    set_velocity(body, group_p_[k], group_v_[k], time);
  }
  for (std::size_t k = 0; k < group_.size(); ++k) {
    if (group_[k] != discs_ && group_v_[k] != group_v_before_[k]) predict_all_of(group_[k], time);
  }
  // A law that did nothing for the pair that met would see it again at the same instant, without end.
  return (group_v_[0] - group_v_[1]).dot(n) < 0.999 * approach_before;
}

}  // namespace breakshot::world
