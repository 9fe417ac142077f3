#include "planner/estimate/restitution_estimate.hpp"

#include "planner/strategy/sampled_worlds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace breakshot::estimate {

namespace {

// Discs that are to be scattered by hits are of something that bounces.
constexpr double kLeast = 0.5;
constexpr double kMost = 1.0;
constexpr std::size_t kPoints = 501;
/// Restitutions at which the virtual world is asked; between them the answer is interpolated.
constexpr std::size_t kKnots = 6;
constexpr std::size_t kWorlds = 32;
constexpr double kOutliers = 0.1;
/// What the virtual world itself is wrong by, relative: its impact law, the striker's mass.
constexpr double kModelSigma = 0.05;

struct Ways {
  double mean = 0.0, sigma = 0.0;  ///< kg m
};

/// Mass times way, summed over the discs, over many worlds.
std::optional<Ways> ways_in_worlds(const ObservedHit& hit, const strategy::TableModel& model, const strategy::StrategySettings& settings,
                                   const strategy::DecisionContext& context) {
  strategy::SampledWorlds worlds{model, hit.before, context, settings};
  double sum = 0.0;
  double squares = 0.0;
  std::size_t ran = 0;
  for (std::size_t world = 1; world <= kWorlds; ++world) {
    const auto aftermath = worlds.run(hit.stroke, {}, world);
    if (!aftermath.valid) continue;
    double ways = 0.0;
    for (std::size_t i = 0; i < model.discs.size(); ++i) ways += model.discs[i].mass * (aftermath.p_WD[i] - model.discs[i].p_WD).norm();
    sum += ways;
    squares += ways * ways;
    ++ran;
  }
  if (ran < kWorlds / 2) return std::nullopt;
  const double mean = sum / static_cast<double>(ran);
  return Ways{mean, std::sqrt(std::max(0.0, squares / static_cast<double>(ran) - mean * mean))};
}

/// Mass times way as seen; nothing unless every disc is known again.
std::optional<double> ways_seen(const ObservedHit& hit, const strategy::TableModel& model) {
  if (hit.before.discs.size() != hit.after.discs.size()) return std::nullopt;
  double ways = 0.0;
  for (std::size_t i = 0; i < hit.before.discs.size(); ++i) {
    const SceneDisc& before = hit.before.discs[i];
    const auto after =
        std::find_if(hit.after.discs.begin(), hit.after.discs.end(), [&](const SceneDisc& disc) { return disc.id == before.id; });
    if (after == hit.after.discs.end()) return std::nullopt;
    ways += model.discs[i].mass * (after->p_WD - before.p_WD).norm();
  }
  return ways;
}

}  // namespace

RestitutionEstimate::RestitutionEstimate(const RestitutionPrior& prior, const strategy::StrategySettings& settings)
    : settings_{settings}, belief_{kLeast, kMost, kPoints} {
  belief_.set_prior([&](double e) {
    const double z = (e - prior.mean) / prior.sigma;
    return -0.5 * z * z;
  });
}

bool RestitutionEstimate::on_hit(const ObservedHit& observed, const strategy::Belief& friction, std::uint64_t seed) {
  ObservedHit hit = observed;
  if (hit.stroke.kind != StrokeKind::kHit) return false;
  if (hit.contact_speed > 0.0) hit.stroke.speed = hit.contact_speed;
  std::string why_not;
  strategy::DecisionContext context;
  context.seed = seed;
  const auto model = strategy::model_of(hit.before, context.min_gap, settings_, why_not);
  if (!model) return false;
  const auto seen = ways_seen(hit, *model);
  if (!seen) return false;

  std::array<Ways, kKnots> ways;
  for (std::size_t k = 0; k < kKnots; ++k) {
    const double e = kLeast + (kMost - kLeast) * static_cast<double>(k) / (kKnots - 1);
    context.belief = strategy::TableBelief{friction, {e, 0.0}};
    const auto found = ways_in_worlds(hit, *model, settings_, context);
    if (!found) return false;
    ways[k] = *found;
  }
  belief_.observe([&](double e) {
    const double place = (e - kLeast) / (kMost - kLeast) * (kKnots - 1);
    const auto below = std::min(static_cast<std::size_t>(place), kKnots - 2);
    const double share = place - static_cast<double>(below);
    const double mean = (1.0 - share) * ways[below].mean + share * ways[below + 1].mean;
    const double sigma = (1.0 - share) * ways[below].sigma + share * ways[below + 1].sigma;
    return log_normal_or_outlier(*seen, mean, std::hypot(sigma, kModelSigma * mean), kOutliers, 0.0, 4.0 * mean);
  });
  return true;
}

}  // namespace breakshot::estimate
