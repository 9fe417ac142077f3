#include "planner/world/virtual_world.hpp"

#include "planner/world/formation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace breakshot::world {

namespace {

/// Notes what an impact did to the energy and the momentum of its bodies.
void audit(std::span<const double> inverse_mass, std::span<const Vector2> before, std::span<const Vector2> after,
           Rollout& rollout) noexcept {
  rollout.energy_gain = std::max(rollout.energy_gain, kinetic_energy(inverse_mass, after) / kinetic_energy(inverse_mass, before) - 1.0);
  Vector2 change{0.0, 0.0};
  double magnitude = 0.0;
  for (std::size_t k = 0; k < before.size(); ++k) {
    change += (after[k] - before[k]) / inverse_mass[k];
    magnitude += before[k].norm() / inverse_mass[k];
  }
  rollout.momentum_error = std::max(rollout.momentum_error, change.norm() / magnitude);
}

/// What CountNear gives for two that touch no third.
constexpr int kTwoSeenTwice = 4;

/// A meeting so short before a body's motion changes waits until it has: rounding could have ended the motion, s.
constexpr double kInstant = 1e-12;

/// What a law may leave of the approach of a contact, m/s: well below what makes an impact of it.
constexpr double kLeftApproaching = 0.1 * kQuietApproach;

/// Discs that are pressed together while they slide would sink into each other by kQuietApproach / 2 between one impact and the next if none
/// threw them apart. So contacts slower than kRubbing, m/s, do; how discs rest depends on it by less than a micrometre (v^2 / (2 mu g)).
constexpr double kRubbing = 2.0 * kQuietApproach;
constexpr double kRubbingRestitution = 0.9;

/// A disc that stays at the striker leaves it at this speed, or the one at which they met if that is less, m/s: by a tenth of a millimetre, and some ten times
/// in the time of a follow-through, where a contact without any bounce would have hundreds of impacts.
constexpr double kStaysAtStriker = 0.02;

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
  require(settings.striker_bounce_speed >= 0.0 && std::isfinite(settings.striker_bounce_speed),
          "virtual world: striker_bounce_speed must be 0 or above");
  require(settings.touch_gap >= kContactSlack && settings.touch_gap < 0.01, "virtual world: touch_gap must be in [1 nm, 10 mm)");
  require(settings.allowed_overlap >= 0.0 && settings.allowed_overlap < 0.01, "virtual world: allowed_overlap must be in [0, 10 mm)");
  touch_gap_ = law_->takes_near_contacts() ? settings.touch_gap : kContactSlack;
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
    const double crossing = crossings_.empty() ? kNever : crossings_[next_crossing_].time;
    const double turn = std::min(striker_turn_, crossing);
    const auto meeting = meetings_.next(bodies_, time, turn - kInstant);
    if (meeting.time == kNever) {
      if (turn == kNever) break;
      bodies_.advance(std::max(0.0, turn - time));
      time = turn;
      crossing < striker_turn_ ? cross_border(time) : turn_striker(time);
      continue;
    }
    bodies_.advance(std::max(0.0, meeting.time - time));
    time = meeting.time;
    if (rollout.impacts++ == limit) {
      rollout.status = Rollout::Status::kEventLimit;
      break;
    }
    if (!resolve_impact(meeting.a, meeting.b, time, rollout)) {
      rollout.status = Rollout::Status::kLawFailed;
      break;
    }
  }
  return rest(rollout, time);
}

Rollout VirtualWorld::rest(Rollout rollout, double time) {
  double longest = 0.0;
  if (rollout.status == Rollout::Status::kAtRest) {
    for (std::size_t i = 0; i < discs_; ++i) longest = std::max(longest, bodies_.left(i));
    bodies_.advance(longest);
  }
  rollout.duration = time + longest;
  rest_.resize(discs_);
  for (std::size_t i = 0; i < discs_; ++i) rest_[i] = bodies_.position(i);
  rollout.p_WD = rest_;
  rollout.smallest_gap = kNever;
  for (std::size_t i = 0; i < discs_; ++i) {
    for (std::size_t j = i + 1; j < discs_; ++j) {
      const double reach = bodies_.radius(i) + bodies_.radius(j);
      const double squared = (rest_[i] - rest_[j]).squaredNorm();
      // Most pairs are further apart than the nearest: their distance, which takes a root, need not be known.
      const double nearer = rollout.smallest_gap + reach;
      if (squared < nearer * nearer) rollout.smallest_gap = std::sqrt(squared) - reach;
    }
  }
  return rollout;
}

void VirtualWorld::load(std::span<const Disc> discs, const StrikerRun* striker) {
  discs_ = discs.size();
  bodies_.resize(discs_ + (striker != nullptr ? 1 : 0));
  crossings_.assign(settings_.friction_map != nullptr ? discs_ : 0, {});
  next_crossing_ = 0;
  for (std::size_t i = 0; i < discs_; ++i) {
    bodies_.place(i, discs[i].p_WD, discs[i].radius, 1.0 / discs[i].mass);
    if (!discs[i].v_WD_W.isZero(0.0)) slide(i, discs[i].v_WD_W, 0.0);
  }
  striker_turn_ = kNever;
  if (striker != nullptr) {
    striker_.begin(*striker);
    striker_mobility_ = striker->mobility;
    bodies_.place(discs_, striker->p_WS, striker->radius, 0.0);
    drive_striker(0.0);
  }
  group_index_.assign(bodies_.size(), -1);
  is_struck_.assign(bodies_.size(), 0);
  meetings_.reset(bodies_);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    // Who meets a body at rest moves, and knows of it.
    if (bodies_.left(i) > 0.0) meetings_.look(bodies_, i, 0.0);
  }
}

void VirtualWorld::drive_striker(double time) noexcept {
  const StrikerMotion::Leg leg = striker_.leg(time, bodies_.position(discs_));
  striker_turn_ = leg.until;
  if (leg.until < kNever) {
    bodies_.drive(discs_, leg.v, leg.deceleration, leg.until - time);
  } else {
    bodies_.take_away(discs_);
  }
}

void VirtualWorld::turn_striker(double time) noexcept {
  meetings_.forget(discs_);
  drive_striker(time);
  if (striker_turn_ < kNever) meetings_.look(bodies_, discs_, time);
}

void VirtualWorld::slide(std::size_t disc, const Vector2& v, double time) noexcept {
  if (crossings_.empty()) {
    bodies_.slide(disc, v, settings_.friction * kGravity);
    return;
  }
  const double speed = v.norm();
  const Vector2 direction = speed > 0.0 ? Vector2{v / speed} : Vector2::Zero();
  const Vector2 p = bodies_.position(disc);
  const double least = settings_.friction_map->least() * settings_.friction * kGravity;
  const auto stretch = settings_.friction_map->stretch(p, direction, speed * speed / (2.0 * least));
  const double deceleration = stretch.factor * settings_.friction * kGravity;
  const double left_squared = speed * speed - 2.0 * deceleration * stretch.length;
  Crossing& crossing = crossings_[disc];
  if (left_squared > 0.0) {
    const double speed_then = std::sqrt(left_squared);
    const double lasts = 2.0 * stretch.length / (speed + speed_then);
    bodies_.drive(disc, v, deceleration * direction, lasts);
    crossing = {time + lasts, speed_then * direction};
  } else {
    bodies_.slide(disc, v, deceleration);
    crossing.time = kNever;
  }
  const auto earlier = [](const Crossing& a, const Crossing& b) { return a.time < b.time; };
  next_crossing_ = static_cast<std::size_t>(std::min_element(crossings_.begin(), crossings_.end(), earlier) - crossings_.begin());
}

void VirtualWorld::cross_border(double time) noexcept {
  const std::size_t disc = next_crossing_;
  meetings_.forget(disc);
  slide(disc, crossings_[disc].v, time);
  meetings_.look(bodies_, disc, time);
}

bool VirtualWorld::resolve_impact(std::size_t i, std::size_t j, double time, Rollout& rollout) {
  struck_.clear();
  const bool alone = law_->bounces_pairs() && kernels_.count_near(bodies_.columns(), i, j, touch_gap_) <= kTwoSeenTwice;
  const bool parted = alone ? resolve_pair(i, j, time, rollout) : resolve_group(i, j, time, rollout);
  meetings_.forget(struck_, is_struck_);
  for (const std::size_t body : struck_) meetings_.look(bodies_, body, time);
  for (const std::size_t body : struck_) is_struck_[body] = 0;
  return parted;
}

double VirtualWorld::restitution_of(std::size_t i, std::size_t j, double approach) const noexcept {
  const bool with_striker = i == discs_ || j == discs_;
  if (with_striker && approach <= settings_.striker_bounce_speed) return std::min(1.0, kStaysAtStriker / approach);
  const double e = with_striker ? settings_.striker_restitution : settings_.restitution;
  return approach > kRubbing ? e : std::max(e, kRubbingRestitution);
}

double VirtualWorld::inverse_mass_along(std::size_t body, const Vector2& n) const noexcept {
  return body == discs_ ? n.dot(striker_mobility_ * n) : bodies_.inverse_mass(body);
}

void VirtualWorld::strike(std::size_t body, const Vector2& v, double time) noexcept {
  slide(body, v, time);
  struck_.push_back(body);
  is_struck_[body] = 1;
}

void VirtualWorld::throw_back(const Vector2& impulse, double time) noexcept {
  if (!striker_.throw_back(time, bodies_.position(discs_), striker_mobility_ * impulse)) return;
  drive_striker(time);
  struck_.push_back(discs_);
  is_struck_[discs_] = 1;
}

bool VirtualWorld::resolve_pair(std::size_t i, std::size_t j, double time, Rollout& rollout) noexcept {
  const Vector2 n = (bodies_.position(j) - bodies_.position(i)).normalized();
  const std::array before{bodies_.velocity(i), bodies_.velocity(j)};
  const std::array inverse_mass{inverse_mass_along(i, n), inverse_mass_along(j, n)};
  const double approach = (before[0] - before[1]).dot(n);
  const double P = (1.0 + restitution_of(i, j, approach)) * approach / (inverse_mass[0] + inverse_mass[1]);
  const std::array<Vector2, 2> after{before[0] - P * inverse_mass[0] * n, before[1] + P * inverse_mass[1] * n};
  if (settings_.audit && i != discs_ && j != discs_) audit(inverse_mass, before, after, rollout);
  if (i == discs_) {
    throw_back(-P * n, time);
  } else {
    strike(i, after[0], time);
  }
  if (j == discs_) {
    throw_back(P * n, time);
  } else {
    strike(j, after[1], time);
  }
  return approach > 0.0;
}

void VirtualWorld::gather_contacts(std::size_t i, std::size_t j) {
  group_.assign({i, j});
  group_index_[i] = 0;
  group_index_[j] = 1;
  contacts_.clear();
  double fastest = 0.0;
  // The group grows while it is walked; each contact is noted when its second body is walked.
  for (std::size_t k = 0; k < group_.size(); ++k) {
    const std::size_t body = group_[k];
    const auto add = [&](std::size_t other) {
      const int known = group_index_[other];
      if (known < 0) {
        group_index_[other] = static_cast<int>(group_.size());
        group_.push_back(other);
      } else if (static_cast<std::size_t>(known) < k) {
        const Vector2 n = (bodies_.position(body) - bodies_.position(other)).normalized();
        contacts_.push_back({known, static_cast<int>(k), n, 0.0});
        fastest = std::max(fastest, (bodies_.velocity(other) - bodies_.velocity(body)).dot(n));
      }
    };
    // The two that met are in contact, whatever rounding says.
    const std::size_t met = body == i ? j : body == j ? i : SlidingBodies::kNobody;
    if (met != SlidingBodies::kNobody) add(met);
    std::size_t other = bodies_.next_neighbour(body, touch_gap_, 0);
    for (; other != SlidingBodies::kNobody; other = bodies_.next_neighbour(body, touch_gap_, other + 1)) {
      if (other != met) add(other);
    }
  }
  for (ImpactContact& contact : contacts_) {
    contact.restitution = restitution_of(group_[static_cast<std::size_t>(contact.a)], group_[static_cast<std::size_t>(contact.b)], fastest);
  }
  for (const std::size_t body : group_) group_index_[body] = -1;
}

bool VirtualWorld::resolve_group(std::size_t i, std::size_t j, double time, Rollout& rollout) {
  gather_contacts(i, j);
  const Vector2 n = (bodies_.position(j) - bodies_.position(i)).normalized();
  group_v_.clear();
  group_inverse_mass_.clear();
  // Laws know bodies of one mass: along the normal of the striker's contact; of several, as in a push, of one of them.
  double striker_inverse_mass = 0.0;
  for (const ImpactContact& contact : contacts_) {
    const bool of_striker = group_[static_cast<std::size_t>(contact.a)] == discs_ || group_[static_cast<std::size_t>(contact.b)] == discs_;
    if (of_striker) striker_inverse_mass = inverse_mass_along(discs_, contact.n_AB);
  }
  bool with_striker = false;
  for (const std::size_t body : group_) {
    group_v_.push_back(bodies_.velocity(body));
    group_inverse_mass_.push_back(body == discs_ ? striker_inverse_mass : bodies_.inverse_mass(body));
    with_striker = with_striker || body == discs_;
  }
  group_v_before_ = group_v_;
  const double approach_before = (group_v_[0] - group_v_[1]).dot(n);
  if (law_->heeds_gaps()) {
    for (ImpactContact& contact : contacts_) {
      const std::size_t a = group_[static_cast<std::size_t>(contact.a)], b = group_[static_cast<std::size_t>(contact.b)];
      contact.gap = std::max(0.0, (bodies_.position(b) - bodies_.position(a)).norm() - bodies_.radius(a) - bodies_.radius(b));
    }
  }
  law_->resolve({contacts_, group_inverse_mass_, group_v_, kLeftApproaching}, scratch_);

  if (settings_.audit && !with_striker) audit(group_inverse_mass_, group_v_before_, group_v_, rollout);
  for (std::size_t k = 0; k < group_.size(); ++k) {
    if (group_v_[k] == group_v_before_[k]) continue;
    if (group_[k] == discs_) {
      throw_back((group_v_[k] - group_v_before_[k]) / striker_inverse_mass, time);
    } else {
      strike(group_[k], group_v_[k], time);
    }
  }
  // A law that did nothing for the pair that met would see it again at the same instant, without end.
  return (group_v_[0] - group_v_[1]).dot(n) < 0.999 * approach_before;
}

}  // namespace breakshot::world
