#include "planner/estimate/table_estimate.hpp"

#include "common/random.hpp"
#include "tests/planner/table_sim.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace breakshot::estimate {
namespace {

constexpr double kGravity = 9.81;
constexpr double kFrame = 1.0 / 30.0;

/// A camera at 30 Hz over discs that slide by Coulomb's law, each on its own.
class Slides {
 public:
  explicit Slides(std::uint64_t seed) : random{seed} {}

  /// Sets a disc off; it slides until it rests. Along each axis it is seen with `sigma` of noise that its covariance tells, and as much again that only
  /// moving discs have. @param bend_at  time of an impact that turns it, s; 0: none
  void slide(FrictionEstimate& estimate, double mu, const Vector2& from, double speed, double sigma, double bend_at = 0.0) {
    ++id_;
    double bearing = random.uniform(-3.14, 3.14);
    Vector2 p = from;
    Vector2 v = speed * Vector2{std::cos(bearing), std::sin(bearing)};
    constexpr int kSteps = 100;  // of a frame
    double t = 0.0;
    for (int frame = 0; frame < 40; ++frame) {
      Scene scene;
      scene.exposed = time_ += from_seconds(kFrame);
      SceneDisc disc;
      disc.id = id_;
      disc.p_WD = p + std::sqrt(2.0) * sigma * Vector2{random.normal(), random.normal()};
      disc.covariance = sigma * sigma * Matrix2::Identity();
      disc.radius = 0.03;
      scene.discs = {disc};
      estimate.on_scene(scene);
      for (int step = 0; step < kSteps; ++step) {
        const double dt = kFrame / kSteps;
        const double left = std::max(0.0, v.norm() - mu * kGravity * dt);
        v = v.norm() > 0.0 ? Vector2{left * v.normalized()} : v;
        p += dt * v;
        t += dt;
        if (bend_at > 0.0 && std::abs(t - bend_at) < 0.5 * dt) v = Eigen::Rotation2Dd{0.6} * (0.5 * v);
      }
    }
  }

  SplitMix64 random;

 private:
  std::uint32_t id_ = 0;
  Time time_{std::chrono::seconds{1}};
};

TEST(FrictionEstimate, FindsFrictionWithinAFewPercentAndIsHonestAboutIt) {
  int within = 0;
  constexpr int kTables = 200;
  for (std::uint64_t seed = 1; seed <= kTables; ++seed) {
    Slides table{seed};
    const double mu = table.random.uniform(0.15, 0.40);
    FrictionEstimate estimate{{.mean = 0.25, .factor = 1.6, .local_spread = 0.0}};
    for (int disc = 0; disc < 5; ++disc) table.slide(estimate, mu, {0.0, 0.0}, table.random.uniform(0.4, 1.0), 3e-5);
    const auto found = estimate.belief();
    EXPECT_GE(estimate.looks(), 5U);
    EXPECT_NEAR(found.mean, mu, 0.10 * mu) << "table " << seed;
    within += std::abs(found.mean - mu) <= 2.0 * found.sigma ? 1 : 0;
  }
  EXPECT_GE(within, kTables * 90 / 100);
  EXPECT_LE(within, kTables * 995 / 1000) << "less sure than it could be";
}

TEST(FrictionEstimate, IsNotFooledByImpactsOnTheWay) {
  Slides table{3};
  FrictionEstimate estimate{{.mean = 0.25, .factor = 1.6}};
  for (int disc = 0; disc < 8; ++disc) table.slide(estimate, 0.30, {0.0, 0.0}, 0.8, 3e-5, 0.02 + 0.015 * disc);
  EXPECT_NEAR(estimate.belief().mean, 0.30, 0.02);
}

TEST(FrictionEstimate, BelievesItsEyesOverAPriorThatIsFarOff) {
  for (const double factor : {0.6, 1.6}) {
    Slides table{5};
    FrictionEstimate estimate{{.mean = 0.25 * factor}};
    for (int disc = 0; disc < 4; ++disc) table.slide(estimate, 0.25, {0.0, 0.0}, 0.7, 3e-5);
    EXPECT_NEAR(estimate.belief().mean, 0.25, 0.02) << "prior " << 0.25 * factor;
  }
}

TEST(FrictionEstimate, SaysNothingNewOfDiscsAtRest) {
  Slides table{7};
  FrictionEstimate estimate{{.mean = 0.25}};
  table.slide(estimate, 0.25, {0.0, 0.0}, 0.0, 3e-5);
  EXPECT_EQ(estimate.looks(), 0U);
  EXPECT_NEAR(estimate.belief().mean, 0.25, 0.01);
}

TEST(FrictionEstimate, TakesNoDiscThatIsPushedForOneThatSlidesWithoutFriction) {
  FrictionEstimate estimate{{.mean = 0.25, .slowest = 1.3 * 0.15}};
  for (int frame = 0; frame < 60; ++frame) {
    Scene scene;
    scene.exposed = Time{std::chrono::milliseconds{1000 + 33 * frame}};
    SceneDisc disc;
    disc.id = 1;
    disc.p_WD = {0.15 * 0.033 * frame, 0.0};
    disc.covariance = 1e-9 * Matrix2::Identity();
    scene.discs = {disc};
    estimate.on_scene(scene);
  }
  EXPECT_NEAR(estimate.belief().mean, 0.25, 0.01);
}

TEST(FrictionEstimate, KnowsARougherCornerFromASmootherOne) {
  Slides table{9};
  FrictionEstimate estimate{{.mean = 0.25, .factor = 1.3, .local_spread = 0.10}};
  for (int disc = 0; disc < 12; ++disc) {
    table.slide(estimate, 0.28, {0.25, 0.25}, 0.5, 3e-5);
    table.slide(estimate, 0.22, {-0.25, -0.25}, 0.5, 3e-5);
  }
  EXPECT_NEAR(estimate.belief_at({0.25, 0.25}).mean, 0.28, 0.015);
  EXPECT_NEAR(estimate.belief_at({-0.25, -0.25}).mean, 0.22, 0.015);
  EXPECT_GT(estimate.belief_at({0.25, -0.25}).sigma, estimate.belief_at({0.25, 0.25}).sigma) << "where nothing slid it is less sure";
  // The virtual world is handed the same, as factors in steps of 2 %.
  const Vector2 middle{0.05, 0.0};
  const auto map = estimate.map_around(middle);
  for (const Vector2& p : {Vector2{0.25, 0.25}, Vector2{-0.25, -0.25}, Vector2{0.0, 0.2}, middle}) {
    EXPECT_NEAR(map->factor(p) * estimate.belief_at(middle).mean / estimate.belief_at(p).mean, 1.0, 0.03) << p.transpose();
  }
  EXPECT_GT(map->factor({0.25, 0.25}), 1.15 * map->factor({-0.25, -0.25}));
  EXPECT_EQ(FrictionEstimate{{}}.map_around(middle), nullptr) << "no look, no map";
}

/// Plays hits on a table whose discs have another restitution than the prior says.
strategy::Belief learnt_restitution(double truth, std::uint64_t seed) {
  const strategy::StrategySettings settings;
  RestitutionEstimate estimate{{.mean = 0.8, .sigma = 0.1}, settings};
  SplitMix64 random{seed};
  for (int stroke = 0; stroke < 6; ++stroke) {
    auto discs = test::formation("E");
    for (auto& disc : discs) disc.p_WD = 1.004 * disc.p_WD + 1e-4 * Vector2{random.normal(), random.normal()};
    world::part_overlaps(discs);
    test::TableTruth on_table;
    on_table.restitution = truth;
    test::TableSim table{discs, on_table, random.next()};
    ObservedHit hit;
    hit.before = table.scene();
    strategy::DecisionContext context;
    context.region = {{-0.3, -0.3}, {0.3, 0.3}};
    context.hits_left = 5;
    const auto decision = strategy::make_strategy("paper", settings)->decide(hit.before, context);
    EXPECT_FALSE(decision.options.empty());
    hit.stroke = decision.options.front().stroke;
    EXPECT_TRUE(table.run(hit.stroke));
    hit.after = table.scene();
    EXPECT_TRUE(estimate.on_hit(hit, {0.25, 0.005}, random.next()));
  }
  return estimate.belief();
}

TEST(RestitutionEstimate, MovesFromThePriorTowardsTheTruth) {
  for (const double truth : {0.65, 0.8, 0.95}) {
    const auto found = learnt_restitution(truth, 11);
    EXPECT_NEAR(found.mean, truth, 0.10 * truth);
    EXPECT_LT(found.sigma, 0.09) << "surer than before";
  }
}

TEST(RestitutionEstimate, LeavesOutHitsThatLostSightOfADisc) {
  RestitutionEstimate estimate{{}, {}};
  ObservedHit hit;
  hit.stroke.kind = StrokeKind::kHit;
  hit.stroke.speed = 0.5;
  hit.before.discs.resize(1);
  hit.before.discs[0].radius = 0.03;
  EXPECT_FALSE(estimate.on_hit(hit, {0.25, 0.01}, 1));
}

}  // namespace
}  // namespace breakshot::estimate
