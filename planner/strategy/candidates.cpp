#include "planner/strategy/candidates.hpp"

#include "planner/strategy/stroke_room.hpp"
#include "planner/strategy/strokes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <set>

namespace breakshot::strategy {

namespace {

// How finely strokes are varied. A finer grid finds better nominal hits (physics.md 6), but those are the ones that noise undoes.
constexpr int kHitBearings = 24;
constexpr double kHitOffsets[] = {0.0, 0.45, -0.45};  // rad, between the direction and the line from the contact to the disc's centre
constexpr int kHitSpeeds = 6;
constexpr double kPushTurns[] = {0.0, 0.35, -0.35};  // rad, off the tangent
constexpr int kOutwardBearings = 12;
constexpr double kOutwardTravels[] = {0.025, 0.05};             // m, that the disc is pushed
constexpr double kReturnTurns[] = {0.0, 0.4, -0.4, 0.8, -0.8};  // rad, off the shortest way back into the region
constexpr double kReturnDepths[] = {0.02, 0.05, 0.09};          // m, how far inside a disc that is brought back is to end

Vector2 unit(double bearing) { return {std::cos(bearing), std::sin(bearing)}; }
Vector2 turned(const Vector2& v, double angle) { return Eigen::Rotation2Dd{angle} * v; }
std::string disc_name(std::size_t disc) { return std::to_string(disc + 1); }

class Finder {
 public:
  Finder(const TableModel& model, const DecisionContext& context, const StrategySettings& settings)
      : model_{model}, context_{context}, cell_{settings.cell}, rules_{settings.rules} {}

  std::vector<Candidate> all() {
    if (context_.hits_left > 0) add_hits();
    if (context_.pushes_left > 0) {
      add_pushes_through_pairs();
      add_outward_pushes();
      add_returning_pushes();
    }
    return std::move(found_);
  }

 private:
  void add_hits() {
    const double fastest = std::min(rules_.hit_speed_max * context_.speed_scale, context_.hit_speed_cap);
    if (fastest < rules_.hit_speed_min) return;
    for (std::size_t disc = 0; disc < model_.discs.size(); ++disc) {
      for (int k = 0; k < kHitBearings; ++k) {
        const Vector2 direction = unit(2.0 * std::numbers::pi * k / kHitBearings);
        for (const double offset : kHitOffsets) {
          const Vector2 p_WS = central_contact(model_.discs[disc], turned(direction, offset), cell_.striker_radius);
          for (int step = 0; step < kHitSpeeds; ++step) {
            const double speed = rules_.hit_speed_min + (fastest - rules_.hit_speed_min) * step / (kHitSpeeds - 1);
            const StrokeRequest hit = hit_stroke(p_WS, direction, speed, rules_);
            if (!run_in_is_free(hit, disc)) break;  // faster ones come down further away
            char what[64];
            std::snprintf(what, sizeof what, "hit disc %zu at %.2f m/s", disc + 1, speed);
            found_.push_back({hit, what});
          }
        }
      }
    }
  }

  bool run_in_is_free(const StrokeRequest& hit, std::size_t disc) const {
    const Vector2 begin = low_from(hit, cell_);
    return way_is_inside(cell_.striker_area, begin, hit.p_WS) &&
           way_is_free(model_.discs, begin, hit.p_WS, cell_.striker_radius, rules_.landing_margin, disc);
  }

  void add_pushes_through_pairs() {
    for (const ClosePair& pair : model_.pairs) {
      for (const double turn : kPushTurns) {
        for (const double side : {1.0, -1.0}) {
          const Vector2 direction = turned(side * pair.tangent_W, turn);
          const auto start =
              push_start_at_pair(model_.discs, pair.a, pair.b, pair.middle_W, direction, cell_.striker_radius, rules_.landing_margin);
          if (!start) continue;
          const double length = (pair.middle_W - *start).dot(direction) + 0.5 * pair.contour_length + 2.0 * cell_.striker_radius;
          add_push(*start, direction, length, "push between discs " + disc_name(pair.a) + " and " + disc_name(pair.b));
        }
      }
    }
  }

  void add_outward_pushes() {
    std::set<std::size_t> discs;
    for (const ClosePair& pair : model_.pairs) discs.insert({pair.a, pair.b});
    for (const std::size_t disc : discs) {
      for (int k = 0; k < kOutwardBearings; ++k) {
        const Vector2 direction = unit(2.0 * std::numbers::pi * k / kOutwardBearings);
        const Vector2 start = central_contact(model_.discs[disc], direction, cell_.striker_radius + rules_.landing_margin);
        if (!way_is_free(model_.discs, start, start, cell_.striker_radius, rules_.landing_margin - 1e-9)) continue;
        for (const double travel : kOutwardTravels) {
          add_push(start, direction, rules_.landing_margin + travel, "push disc " + disc_name(disc));
        }
      }
    }
  }

  /// Of discs that have left the region, back into it. (Hits of theirs are among the others.)
  void add_returning_pushes() {
    for (std::size_t disc = 0; disc < model_.discs.size(); ++disc) {
      const Vector2& p_WD = model_.discs[disc].p_WD;
      if (context_.region.contains(p_WD)) continue;
      const Vector2 nearest = p_WD.cwiseMax(context_.region.min).cwiseMin(context_.region.max);
      for (const double turn : kReturnTurns) {
        const Vector2 direction = turned((nearest - p_WD).normalized(), turn);
        const Vector2 start = central_contact(model_.discs[disc], direction, cell_.striker_radius + rules_.landing_margin);
        if (!way_is_free(model_.discs, start, start, cell_.striker_radius, rules_.landing_margin - 1e-9)) continue;
        for (const double depth : kReturnDepths) {
          const double travel = ((nearest - p_WD).norm() + depth) / std::cos(turn);
          add_push(start, direction, rules_.landing_margin + travel, "push disc " + disc_name(disc) + " back into the region");
        }
      }
    }
  }

  void add_push(const Vector2& start, const Vector2& direction, double length, std::string what) {
    if (!way_is_inside(cell_.striker_area, start, start + length * direction)) return;
    found_.push_back({push_stroke(start, direction, length, rules_), std::move(what)});
  }

  const TableModel& model_;
  const DecisionContext& context_;
  const CellKnowledge& cell_;
  const StrokeRules& rules_;
  std::vector<Candidate> found_;
};

}  // namespace

std::vector<Candidate> stroke_candidates(const TableModel& model, const DecisionContext& context, const StrategySettings& settings) {
  return Finder{model, context, settings}.all();
}

}  // namespace breakshot::strategy
