#pragma once

#include "planner/strategy/strategy.hpp"
#include "planner/strategy/table_model.hpp"
#include "planner/strategy/trial.hpp"

#include <string>
#include <vector>

namespace breakshot::strategy {

/// A way to hit: everything but the speed.
struct HitAim {
  std::size_t disc = 0;           ///< struck first
  Vector2 p_WS{0.0, 0.0};         ///< striker's axis at first contact
  Vector2 direction_W{1.0, 0.0};  ///< unit
  std::string what;               ///< "disc 3 between 1 and 2 (simultaneous impact)"
};

/// A way to part a pair by pushing.
struct PushAim {
  std::size_t pair = 0;           ///< index into TableModel::pairs
  Vector2 p_WS{0.0, 0.0};         ///< where the line begins
  Vector2 direction_W{1.0, 0.0};  ///< unit
  double length = 0.0;            ///< m
  std::string what;               ///< "discs 1|2 from the arm's side"
};

/// The paper's procedure, with the choice of directions left open: what `paper`, `random_hybrid` and `random_push` share, so that they
/// differ in the directions and in nothing else. docs/strategies.md gives every reading of the paper's text.
class HybridStrategy : public Strategy {
 public:
  Decision decide(const Scene& scene, const DecisionContext& context) final;

 protected:
  explicit HybridStrategy(const StrategySettings& settings);

  /// Whether more than four discs in one cluster are hit.
  virtual bool hits() const noexcept = 0;
  /// Ways to hit the cluster, the preferred first.
  virtual std::vector<HitAim> hit_aims(const TableModel& model, int cluster, const DecisionContext& context) const = 0;
  /// Ways to part pairs, the preferred first.
  virtual std::vector<PushAim> push_aims(const TableModel& model, const DecisionContext& context) const = 0;

  /// Whether pushes that the virtual world calls vain, or that bring a disc near the border, are put behind the others.
  virtual bool weighs_pushes() const noexcept = 0;

  /// Length of a push that begins at `p_WS`: to the end of the contour and the striker's diameter further (paper, Sec. 5).
  double push_length(const ClosePair& pair, const Vector2& p_WS, const Vector2& direction) const noexcept;

  const StrategySettings& settings() const noexcept { return settings_; }

 private:
  /// A speed of a hit and what it comes to.
  struct SpeedTrial {
    double speed = 0.0;
    TrialResult result;
  };

  bool hit_has_room(const TableModel& model, const HitAim& aim, double speed, std::string& why_not) const;
  std::vector<SpeedTrial> try_speeds(const TableModel& model, const HitAim& aim, const DecisionContext& context, std::string& why_ended);
  std::optional<StrokeOption> hit_option(const TableModel& model, const HitAim& aim, const DecisionContext& context, bool leads,
                                         std::string& why_not);
  void add_hits(const TableModel& model, const DecisionContext& context, Decision& decision);
  void add_pushes(const TableModel& model, const DecisionContext& context, Decision& decision);
  StrokeOption option_of(const StrokeRequest& stroke, const TrialResult& trial, const DecisionContext& context) const;

  StrategySettings settings_;
  Trial trial_;
};

}  // namespace breakshot::strategy
