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

/// What a law may leave of the approach of a contact, m/s: well below what makes an impact of it.
constexpr double kLeftApproaching = 0.1 * kQuietApproach;

/// Discs that are pressed together while they slide would sink into each other by kQuietApproach / 2 between one impact and the next if none
/// threw them apart. So contacts slower than kRubbing, m/s, do; how discs rest depends on it by less than a micrometre (v^2 / (2 mu g)).
constexpr double kRubbing = 2.0 * kQuietApproach;
constexpr double kRubbingRestitution = 0.9;

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
    const auto meeting = meetings_.next(bodies_, time, striker_turn_);
    if (meeting.time == kNever) {
      if (striker_turn_ == kNever) break;
      bodies_.advance(std::max(0.0, striker_turn_ - time));
      time = striker_turn_;
      advance_striker(time);
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
  for (std::size_t i = 0; i < discs_; ++i) {
    bodies_.place(i, discs[i].p_WD, discs[i].radius, 1.0 / discs[i].mass);
    if (!discs[i].v_WD_W.isZero(0.0)) bodies_.slide(i, discs[i].v_WD_W, settings_.friction * kGravity);
  }
  striker_turn_ = kNever;
  striker_brakes_ = false;
  if (striker != nullptr) {
    striker_ = *striker;
    bodies_.place(discs_, striker->p_WS, striker->radius, 1.0 / striker->mass);
    striker_turn_ = striker->cruise / striker->speed;
    bodies_.drive(discs_, striker->speed * striker->direction, Vector2::Zero(), striker_turn_);
  }
  group_index_.assign(bodies_.size(), -1);
  is_struck_.assign(bodies_.size(), 0);
  meetings_.reset(bodies_);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    // Who meets a body at rest moves, and knows of it.
    if (bodies_.left(i) > 0.0) meetings_.look(bodies_, i, 0.0);
  }
}

void VirtualWorld::advance_striker(double time) noexcept {
  meetings_.forget(discs_);
  if (striker_brakes_) {
    bodies_.take_away(discs_);
    striker_turn_ = kNever;
    return;
  }
  striker_brakes_ = true;
  const double lasts = std::min(striker_.speed / striker_.braking, striker_.lift);
  striker_turn_ = time + lasts;
  bodies_.drive(discs_, striker_.speed * striker_.direction, striker_.braking * striker_.direction, lasts);
  meetings_.look(bodies_, discs_, time);
}

bool VirtualWorld::resolve_impact(std::size_t i, std::size_t j, double time, Rollout& rollout) {
  struck_.clear();
  const bool alone = law_->bounces_pairs() && kernels_.count_near(bodies_.columns(), i, j, settings_.touch_gap) <= kTwoSeenTwice;
  const bool parted = alone ? resolve_pair(i, j, rollout) : resolve_group(i, j, rollout);
  meetings_.forget(struck_, is_struck_);
  for (const std::size_t body : struck_) meetings_.look(bodies_, body, time);
  for (const std::size_t body : struck_) is_struck_[body] = 0;
  return parted;
}

double VirtualWorld::restitution_of(std::size_t i, std::size_t j, double approach) const noexcept {
  const double e = i == discs_ || j == discs_ ? settings_.striker_restitution : settings_.restitution;
  return approach > kRubbing ? e : std::max(e, kRubbingRestitution);
}

void VirtualWorld::strike(std::size_t body, const Vector2& v) noexcept {
  if (body == discs_) return;  // the drives carry the striker on along its run, whatever the impact did to it
  bodies_.slide(body, v, settings_.friction * kGravity);
  struck_.push_back(body);
  is_struck_[body] = 1;
}

bool VirtualWorld::resolve_pair(std::size_t i, std::size_t j, Rollout& rollout) noexcept {
  const Vector2 n = (bodies_.position(j) - bodies_.position(i)).normalized();
  const std::array before{bodies_.velocity(i), bodies_.velocity(j)};
  const std::array inverse_mass{bodies_.inverse_mass(i), bodies_.inverse_mass(j)};
  const double approach = (before[0] - before[1]).dot(n);
  const double P = (1.0 + restitution_of(i, j, approach)) * approach / (inverse_mass[0] + inverse_mass[1]);
  const std::array<Vector2, 2> after{before[0] - P * inverse_mass[0] * n, before[1] + P * inverse_mass[1] * n};
  if (settings_.audit && i != discs_ && j != discs_) audit(inverse_mass, before, after, rollout);
  strike(i, after[0]);
  strike(j, after[1]);
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
    std::size_t other = bodies_.next_neighbour(body, settings_.touch_gap, 0);
    for (; other != SlidingBodies::kNobody; other = bodies_.next_neighbour(body, settings_.touch_gap, other + 1)) {
      if (other != met) add(other);
    }
  }
  for (ImpactContact& contact : contacts_) {
    contact.restitution = restitution_of(group_[static_cast<std::size_t>(contact.a)], group_[static_cast<std::size_t>(contact.b)], fastest);
  }
  for (const std::size_t body : group_) group_index_[body] = -1;
}

bool VirtualWorld::resolve_group(std::size_t i, std::size_t j, Rollout& rollout) {
  gather_contacts(i, j);
  group_v_.clear();
  group_inverse_mass_.clear();
  bool with_striker = false;
  for (const std::size_t body : group_) {
    group_v_.push_back(bodies_.velocity(body));
    group_inverse_mass_.push_back(bodies_.inverse_mass(body));
    with_striker = with_striker || body == discs_;
  }
  group_v_before_ = group_v_;

  const Vector2 n = (bodies_.position(j) - bodies_.position(i)).normalized();
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
    if (group_v_[k] != group_v_before_[k]) strike(group_[k], group_v_[k]);
  }
  // A law that did nothing for the pair that met would see it again at the same instant, without end.
  return (group_v_[0] - group_v_[1]).dot(n) < 0.999 * approach_before;
}

}  // namespace breakshot::world
