#pragma once

#include "common/random.hpp"
#include "common/scene.hpp"
#include "planner/strategy/strategy.hpp"

#include <optional>
#include <vector>

namespace breakshot::task {

/// Predicts, from discs that slide freely, the scene that the camera will show when they rest.
///
/// Two frames in a row give a disc's velocity; the virtual world runs all discs on from there to rest, collisions included. How sure that is follows
/// from the same run under other draws of what is not known exactly (both places, friction, restitution): their spread is the forecast's covariance. A disc that the arm hides now counts if it rested when it was last seen.
class RestForecast {
 public:
  /// @param settle_speed  slower discs are at rest, m/s
  RestForecast(const strategy::StrategySettings& knowledge, double settle_speed);

  /// Forgets all: only what comes from now on counts. To be called when the striker has left the discs, for nothing here knows of it.
  void start() noexcept { tracks_.clear(); }
  /// Takes the next scene; quality must be kOk.
  void on_scene(const Scene& scene);

  struct Forecast {
    Scene scene;         ///< the last one, with discs where they are going to rest, covariances grown; hidden discs come last
    bool slid = false;   ///< whether a disc still moved
    double sigma = 0.0;  ///< largest standard deviation of a place along any direction, m
  };
  /// Nothing while what was seen does not say of every disc where it is going.
  ///
  /// @param discs   that there are
  /// @param belief  of friction and restitution
  std::optional<Forecast> forecast(std::size_t discs, const strategy::TableBelief& belief);

 private:
  struct Place {
    Time seen{};
    Vector2 p_WD{0.0, 0.0};
    Matrix2 covariance{Matrix2::Zero()};
  };
  struct Track {
    SceneDisc disc;  // as last seen
    Place now, before;
    bool known = false;  // how fast it is: two frames in a row showed it
  };
  /// Faster than what counts as rest, and further than two places of a disc at rest lie apart.
  bool slides(const Track& track) const noexcept;
  /// The tracks of all discs, those of the newest scene first and in its order; nothing while one of them does not say where its disc is going.
  std::vector<const Track*> complete(std::size_t discs) const;
  /// Where the discs come to rest; nothing when the virtual world cannot say.
  /// @param random  draws what is not known; null: all is as believed
  std::optional<std::vector<Vector2>> run(const std::vector<const Track*>& tracks, const strategy::TableBelief& belief,
                                          SplitMix64* random) const;
  /// Sets the covariances. @return whether the virtual world ran under every draw
  bool spread(Forecast& forecast, const std::vector<const Track*>& tracks, const strategy::TableBelief& belief) const;

  strategy::CellKnowledge cell_;
  double settle_speed_;
  std::vector<Track> tracks_;
  Scene newest_;
};

}  // namespace breakshot::task
