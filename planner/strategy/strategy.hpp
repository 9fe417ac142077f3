#pragma once

#include "common/result.hpp"
#include "common/scene.hpp"
#include "common/stroke.hpp"
#include "common/task.hpp"
#include "planner/strategy/settings.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot::strategy {

/// Why the arm cannot run a stroke.
struct StrokeRefusal {
  RefusalReason reason = RefusalReason::kUnreachable;
  std::string text;  ///< for people
};

/// What the arm says of a stroke that it can run. Zeros: not known.
struct StrokeForecast {
  double total = 0.0;      ///< from the first motion to rest, s
  double low_after = 0.0;  ///< how far the striker goes on after the contact of a hit until it is above the discs, m
  double low_time = 0.0;   ///< and how long that takes, s
};

/// Says whether the arm could run a stroke, before it is asked. Injected, so that strategies and their tests need no arm.
class StrokeFilter {
 public:
  virtual ~StrokeFilter() = default;
  /// Some milliseconds for a real arm, so strategies ask about the few strokes that they put first and no other.
  virtual Result<StrokeForecast, StrokeRefusal> forecast(const StrokeRequest& stroke) = 0;

  /// Nothing when the arm can run it.
  std::optional<StrokeRefusal> refusal(const StrokeRequest& stroke) {
    auto answer = forecast(stroke);
    return answer ? std::nullopt : std::optional{answer.error()};
  }
};

/// What is believed of a number.
struct Belief {
  double mean = 0.0;
  double sigma = 0.0;  ///< standard deviation
};

/// What has been learnt of the table and the discs on it (planner/estimate).
struct TableBelief {
  Belief friction;     ///< mu between disc and table, where the discs of the scene are
  Belief restitution;  ///< e between two discs
  std::shared_ptr<const world::FrictionMap> friction_map =
      nullptr;  ///< factors on friction from place to place; none: nothing is known of them
};

/// What a decision depends on besides the scene.
struct DecisionContext {
  double min_gap = 0.015;  ///< G, m
  Rect region;             ///< every disc's centre is to rest in it, W, m
  std::uint32_t hits_left = 0;
  std::uint32_t pushes_left = 0;
  double speed_scale = 1.0;           ///< of hit speeds, (0, 1]
  double hit_speed_cap = 1e9;         ///< what the controller last said to be attainable, m/s
  std::uint64_t seed = 0;             ///< of whatever is random in the decision: the same seed, scene and context give the same decision
  StrokeFilter* filter = nullptr;     ///< optional
  std::optional<TableBelief> belief;  ///< nothing: the prior knowledge of the settings
  std::stop_token stop;               ///< once asked for, nobody waits for the decision: it may be anything, but is to end soon
};

/// A stroke that a strategy offers, and what it expects of it. The request's id is 0: whoever sends it numbers it.
struct StrokeOption {
  StrokeRequest stroke;
  std::string why;
  double predicted_gap = 0.0;           ///< smallest gap afterwards, m
  std::vector<Vector2> predicted_p_WD;  ///< by scene index
  double p_singulated = 0.0;            ///< strategies that look at one world only say 0 or 1
  double p_lost = 0.0;
  double cost_s = 0.0;  ///< expected time to finish that way, s
};

/// What to do about a scene.
struct Decision {
  enum class Kind : std::uint8_t {
    kSingulated = 0,  ///< every gap is at least G
    kStroke = 1,      ///< `options` holds at least one
    kNoStroke = 2,    ///< there are gaps below G, but no stroke that the rules allow; `why` says what stood in the way
  };
  Kind kind = Kind::kNoStroke;
  std::vector<StrokeOption> options;  ///< in the order to try them in; the first one passed the filter
  std::string why;
};

/// Decides about one scene at a time. May keep buffers, but nothing that it decides on: what it needs to know is in its arguments.
class Strategy {
 public:
  virtual ~Strategy() = default;
  virtual std::string_view name() const noexcept = 0;
  /// @param scene  at rest, quality kOk
  virtual Decision decide(const Scene& scene, const DecisionContext& context) = 0;
  /// Corrects a decision that was made about a scene much like this one: the same discs, each within a few tenths of a millimetre. To be much
  /// quicker than decide(), which it may call when that is quick anyway. kNoStroke: nothing of the earlier decision will do.
  ///
  /// @param earlier  the options of that decision
  virtual Decision revise(const Scene& scene, const DecisionContext& context, std::span<const StrokeOption> earlier) {
    (void)earlier;
    return decide(scene, context);
  }
};

/// "paper", "random_hybrid", "random_push", "robust".
std::vector<std::string> strategy_names();

/// @throws std::invalid_argument for an unknown name, or settings that are out of their range
std::unique_ptr<Strategy> make_strategy(std::string_view name, const StrategySettings& settings);

}  // namespace breakshot::strategy
