#pragma once

#include "common/scene.hpp"
#include "planner/estimate/grid_belief.hpp"
#include "planner/world/friction_map.hpp"

#include <Eigen/Cholesky>

#include <cstdint>
#include <memory>
#include <vector>

namespace breakshot::estimate {

struct FrictionPrior {
  double mean = 0.25;
  double factor = 1.15;  ///< 95 % of the prior lie within the mean times and over this, a few beyond it wherever mu may be
  /// How much mu varies from place to place, relative: an observation says no more than this of the whole table.
  double local_spread = 0.05;
  double slowest = 0.2;  ///< discs not faster than this say nothing: a push may be driving them, or the stop is near, m/s
};

/// Learns the friction between discs and table by watching discs slide.
///
/// Between impacts a disc loses mu g of speed per second (Coulomb). Three scenes in a row in which it moved freely give its deceleration, whatever set it
/// off and whatever the discs weigh: no model of the impact takes part. At 30 Hz, with positions good to 0.05 mm, one such look is good to 5 %; a stroke
/// gives several per disc. Looks in which something else happened (an impact, the stop) are left out where the track shows it, and are outliers where it
/// does not.
class FrictionEstimate {
 public:
  explicit FrictionEstimate(const FrictionPrior& prior);

  /// Takes the next scene of the stream, with discs at rest or in motion; identities must be perception's.
  void on_scene(const Scene& scene);

  strategy::Belief belief() const noexcept { return belief_.belief(); }
  /// What is believed of one place: the nearer observations weigh more. Equal to belief() where none is near.
  /// Gaussian process regression (Rasmussen and Williams 2006, ch. 2) on what is left of each look after the mean.
  strategy::Belief belief_at(const Vector2& p_W) const;
  /// The means of belief_at() around a place as factors on the one there, for the virtual world: a square metre. Nothing before the first look.
  std::shared_ptr<const world::FrictionMap> map_around(const Vector2& p_W) const;
  std::size_t looks() const noexcept { return looks_; }

 private:
  /// One deceleration that was seen.
  struct Look {
    Vector2 p_W;
    double mu, sigma;
  };
  /// The looks that count for the map, and what they say together.
  struct Regression {
    double local = 0.0;  ///< standard deviation of mu from place to place
    std::vector<const Look*> looks;
    Eigen::LLT<Eigen::MatrixXd> factor;
    Eigen::VectorXd weights;

    Eigen::VectorXd alike(const Vector2& p_W) const;  ///< covariance of mu there with that at each look
  };
  struct Place {
    Time exposed;
    Vector2 p_WD;
    double variance;  ///< of a coordinate, m^2
  };
  struct Track {
    std::uint32_t id;
    std::vector<Place> places;  ///< at most four, without a break
  };

  void watch(Track& track);
  void take(const Look& look);
  Regression regression() const;

  FrictionPrior prior_;
  GridBelief belief_;
  std::vector<Track> tracks_;
  std::vector<Look> looks_kept_;  ///< the newest ones, for the map
  std::size_t next_kept_ = 0;
  std::size_t looks_ = 0;
};

}  // namespace breakshot::estimate
