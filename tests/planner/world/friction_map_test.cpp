#include "planner/world/friction_map.hpp"

#include "common/gap.hpp"
#include "tests/controller/loop/call_counter.hpp"
#include "tests/planner/cluster_trials.hpp"
#include "tests/planner/plain_integration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace breakshot::world {
namespace {

constexpr double kFriction = 0.25;
const Vector2 kCorner{-0.2, -0.2};

/// A map of 0.4 m x 0.4 m about the origin with factors drawn from 1 +- `spread`.
std::shared_ptr<const FrictionMap> patchwork(std::mt19937_64& random, double cell, double spread) {
  const auto side = static_cast<std::size_t>(std::lround(0.4 / cell));
  std::vector<double> factors(side * side);
  for (double& factor : factors) factor = std::uniform_real_distribution{1.0 - spread, 1.0 + spread}(random);
  return std::make_shared<const FrictionMap>(kCorner, cell, side, factors);
}

VirtualWorld world_on(std::shared_ptr<const FrictionMap> map) {
  return VirtualWorld{{.friction = kFriction, .friction_map = std::move(map), .audit = true}, make_impact_law("sequential")};
}

TEST(FrictionMap, SlidesEndWhereFrictionHasDoneItsWork) {
  // Across borders, along them, through corners, and out of the map: whatever way, v^2 / 2 = sum of mu g ds.
  std::mt19937_64 random{3};
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  for (int i = 0; i < 200; ++i) {
    const auto map = patchwork(random, i % 2 == 0 ? 0.02 : 0.1, 0.5);
    const bool from_corner = i % 4 == 0;
    Disc disc = from_corner ? test::disc_at(0.0, 0.1) : test::disc_at(uniform(-0.25, 0.25), uniform(-0.25, 0.25));
    const double bearing = from_corner ? 0.25 * std::numbers::pi * static_cast<double>(i / 4 % 8) : uniform(-3.0, 3.0);
    disc.v_WD_W = uniform(0.2, 1.5) * Vector2{std::cos(bearing), std::sin(bearing)};
    auto world = world_on(map);
    const auto rollout = world.run(std::vector{disc});
    ASSERT_TRUE(rollout);
    const Vector2 way = rollout->p_WD[0] - disc.p_WD;
    EXPECT_NEAR(way.normalized().dot(disc.v_WD_W.normalized()), 1.0, 1e-12);
    constexpr int kParts = 20'000;
    double work = 0.0;
    for (int k = 0; k < kParts; ++k) work += map->factor(disc.p_WD + (k + 0.5) / kParts * way) * kFriction * kGravity * way.norm() / kParts;
    if (from_corner) continue;  // what runs along a border may take either side's factor
    EXPECT_NEAR(work / (0.5 * disc.v_WD_W.squaredNorm()), 1.0, 2e-4) << "case " << i;
  }
}

TEST(FrictionMap, ADiscCrossesABorderInClosedForm) {
  // Factor 1 for x < 0, 2 beyond.
  const auto map = std::make_shared<const FrictionMap>(Vector2{-1.0, -1.0}, 1.0, 2, std::vector{1.0, 2.0, 1.0, 2.0});
  const double a = kFriction * kGravity;
  Disc disc = test::disc_at(-0.1, 0.02);
  disc.v_WD_W = {1.0, 0.0};
  auto world = world_on(map);
  const auto there = world.run(std::vector{disc});
  const double then = std::sqrt(1.0 - 2.0 * a * 0.1);
  EXPECT_NEAR(there->p_WD[0].x(), then * then / (4.0 * a), 1e-12);
  EXPECT_NEAR(there->p_WD[0].y(), 0.02, 1e-15);
  EXPECT_NEAR(there->duration, (1.0 - then) / a + then / (2.0 * a), 1e-12);
  disc.p_WD.x() = 0.05;
  disc.v_WD_W = {-1.0, 0.0};
  const auto back = world.run(std::vector{disc});
  EXPECT_NEAR(back->p_WD[0].x(), -(1.0 - 4.0 * a * 0.05) / (2.0 * a), 1e-12);
}

TEST(FrictionMap, DiscsMeetOnItWhereAFineIntegrationSays) {
  std::mt19937_64 random{11};
  std::vector<double> errors;
  for (int i = 0; i < 15; ++i) {
    const auto map = patchwork(random, 0.05, 0.3);
    const std::vector<Disc> discs = test::sliding_discs(random, 4);
    auto world = world_on(map);
    const auto rollout = world.run(discs);
    ASSERT_TRUE(rollout);
    const auto expected = test::integrated(
        discs, [&](const Vector2& p) { return map->factor(p) * kFriction * kGravity; }, 0.8, 2e-6);
    for (std::size_t k = 0; k < discs.size(); ++k) errors.push_back((rollout->p_WD[k] - expected[k]).norm());
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 1e-5);
  EXPECT_LT(errors[errors.size() * 9 / 10], 1e-4);  // grazes multiply the integration's error
}

TEST(FrictionMap, OfOneFactorChangesNoBit) {
  std::mt19937_64 random{4};
  auto plain = world_on(nullptr);
  auto mapped = world_on(std::make_shared<const FrictionMap>(kCorner, 0.01, 40, std::vector<double>(1600, 1.0)));
  for (int i = 0; i < 200; ++i) {
    auto discs = test::random_cluster(random, 8, i % 2 == 0 ? 0.0 : 1e-3);
    discs[0].v_WD_W = {1.0, 0.4};
    const auto expected = plain.run(discs), found = mapped.run(discs);
    EXPECT_EQ(expected->impacts, found->impacts);
    for (std::size_t k = 0; k < discs.size(); ++k) EXPECT_EQ(expected->p_WD[k], found->p_WD[k]);
  }
}

TEST(FrictionMap, HardClustersEndOnARoughTable) {
  std::mt19937_64 random{5};
  const auto trials = test::run_cluster_trials("sequential", 2000, 9, patchwork(random, 0.01, 0.6));
  EXPECT_EQ(trials.at_rest, trials.rollouts - trials.overlaps);
  EXPECT_LE(trials.energy_gain, 1e-9);
  EXPECT_LE(trials.momentum_error, 1e-12);
  EXPECT_GT(trials.smallest_gap, -5e-4);
}

TEST(FrictionMap, ARolloutOnItAllocatesNothing) {
  if (!control::test::counting_works()) GTEST_SKIP() << "a sanitizer counts allocations itself";
  std::mt19937_64 random{7};
  auto world = world_on(patchwork(random, 0.02, 0.3));
  auto discs = test::random_cluster(random, 10, 2e-4);
  discs[0].v_WD_W = {1.0, 0.4};
  ASSERT_TRUE(world.run(discs));
  control::test::start_counting();
  const auto rollout = world.run(discs);
  EXPECT_EQ(control::test::stop_counting().heap, 0U);
  EXPECT_TRUE(rollout);
}

TEST(FrictionMap, RefusesWhatIsNoMap) {
  const auto message = [](const Vector2& corner, double cell, std::size_t columns, const std::vector<double>& factors) {
    try {
      const FrictionMap map{corner, cell, columns, factors};
    } catch (const std::invalid_argument& error) {
      return std::string{error.what()};
    }
    return std::string{};
  };
  EXPECT_EQ(message(kCorner, 0.1, 2, {1.0, 1.0, 1.0}), "friction map: 3 cells do not fill rows of 2");
  EXPECT_EQ(message(kCorner, 0.1, 0, {1.0}), "friction map: 1 cells do not fill rows of 0");
  EXPECT_EQ(message(kCorner, 0.1, 1, {}), "friction map: 0 cells do not fill rows of 1");
  EXPECT_EQ(message(kCorner, 0.0, 1, {1.0}), "friction map: cells must be wider than 0");
  EXPECT_EQ(message(kCorner, 0.1, 1, {0.0}), "friction map: factors must be above 0");
  EXPECT_EQ(message(kCorner, 0.1, 1, {std::nan("")}), "friction map: factors must be above 0");
  EXPECT_EQ(message({std::nan(""), 0.0}, 0.1, 1, {1.0}), "friction map: its corner is not finite");
  EXPECT_EQ(message(kCorner, 0.1, 2, {1.0, 1.2}), "");
}

}  // namespace
}  // namespace breakshot::world
