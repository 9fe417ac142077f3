#include "planner/world/virtual_world.hpp"

#include "common/gap.hpp"
#include "planner/world/formation.hpp"
#include "tests/controller/loop/call_counter.hpp"
#include "tests/planner/cluster_trials.hpp"
#include "tests/planner/plain_integration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace breakshot::world {
namespace {

constexpr double kDeceleration = 0.25 * kGravity;

VirtualWorld world_of(const char* law = "paper_corrected", WorldSettings settings = {}) {
  return VirtualWorld{settings, make_impact_law(law)};
}

TEST(MeetingBounds, HoldAndHaveTheSameBitsForEveryWidth) {
  std::mt19937_64 random{31};
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  int near_the_meeting = 0, meetings = 0;
  for (int i = 0; i < 2000; ++i) {
    SlidingBodies bodies;
    const std::size_t n = 2 + static_cast<std::size_t>(i) % 19;
    bodies.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      bodies.place(k, {uniform(-0.2, 0.2), uniform(-0.2, 0.2)}, uniform(0.005, 0.02), 10.0);
      if (random() % 3 != 0) bodies.slide(k, {uniform(-1, 1), uniform(-1, 1)}, uniform(1.0, 5.0));
    }
    if (i % 4 == 0) bodies.drive(n - 1, {uniform(-1, 1), 0.3}, {0.1, 0.0}, 0.2);
    const double now = uniform(0.0, 1.0);
    bodies.advance(uniform(0.0, 0.1));
    std::vector<double> first;
    for (const BoundKernels& kernels : all_bound_kernels()) {
      std::vector<double> bounds(bodies.columns().size);
      kernels.bound_row(bodies.columns(), 0, now, bounds.data());
      if (first.empty()) first = bounds;
      EXPECT_EQ(bounds, first);
      EXPECT_EQ(kernels.count_near(bodies.columns(), 0, 1, 0.01), bound_kernels().count_near(bodies.columns(), 0, 1, 0.01));
      EXPECT_EQ(kernels.find_least(bounds.data(), bounds.size()), place_of_least(bounds.data(), bounds.size()));
    }
    for (std::size_t k = 1; k < n; ++k) {
      if (gap(Disc{bodies.position(0), {}, bodies.radius(0)}, Disc{bodies.position(k), {}, bodies.radius(k)}) < 0.0) continue;
      const double meets = now + next_collision(bodies.motion(0), bodies.motion(k), bodies.radius(0) + bodies.radius(k));
      EXPECT_LE(first[k], meets + 1e-12) << "case " << i << " body " << k;
      if (meets == kNever) continue;
      ++meetings;
      near_the_meeting += meets - first[k] < 0.02 ? 1 : 0;
    }
  }
  EXPECT_GT(meetings, 200);
  EXPECT_GT(near_the_meeting, meetings / 2);  // a bound that is always 0 would hold too
}

TEST(VirtualWorld, OneDiscSlidesAsFarAsCoulombLetsIt) {
  auto world = world_of();
  for (double bearing = 0.0; bearing < 6.3; bearing += 0.1) {
    Disc disc = test::disc_at(0.1, -0.2);
    disc.v_WD_W = 1.3 * Vector2{std::cos(bearing), std::sin(bearing)};
    const auto rollout = world.run(std::vector{disc});
    ASSERT_TRUE(rollout);
    EXPECT_NEAR((rollout->p_WD[0] - disc.p_WD).norm(), 1.3 * 1.3 / (2 * kDeceleration), 1e-12);
    EXPECT_NEAR(rollout->duration, 1.3 / kDeceleration, 1e-12);
  }
}

TEST(VirtualWorld, TwoDiscsMeetWhereTheirParabolasDo) {
  // Head-on with closed form: equal speeds, meeting half way, elastic in the mean.
  Disc left = test::disc_at(-0.1, 0.0), right = test::disc_at(0.1, 0.0);
  left.v_WD_W = {1.0, 0.0};
  right.v_WD_W = {-1.0, 0.0};
  auto world = world_of();
  const auto rollout = world.run(std::vector{left, right});
  ASSERT_TRUE(rollout);
  EXPECT_EQ(rollout->impacts, 1);
  const double v = 0.8 * std::sqrt(1.0 - 2 * kDeceleration * 0.07);
  EXPECT_NEAR(rollout->p_WD[0].x(), -0.03 - v * v / (2 * kDeceleration), 1e-12);
  EXPECT_NEAR(rollout->p_WD[1].x(), 0.03 + v * v / (2 * kDeceleration), 1e-12);
}

TEST(VirtualWorld, AgreesWithAFineIntegration) {
  std::mt19937_64 random{11};
  auto world = world_of("sequential");
  std::vector<double> errors;
  for (int i = 0; i < 60; ++i) {
    const std::vector<Disc> discs = test::sliding_discs(random, 4);
    const auto rollout = world.run(discs);
    ASSERT_TRUE(rollout);
    const auto expected = test::integrated(
        discs, [](const Vector2&) { return kDeceleration; }, 0.8, 2e-6);
    for (std::size_t k = 0; k < discs.size(); ++k) errors.push_back((rollout->p_WD[k] - expected[k]).norm());
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 5e-6);
  EXPECT_LT(errors[errors.size() * 9 / 10], 5e-5);  // grazes multiply the integration's error
}

StrikerRun strike(const Disc& target, const Vector2& direction, double speed) {
  StrikerRun run;
  run.direction = direction.normalized();
  run.speed = speed;
  run.cruise = 0.02;
  run.p_WS = target.p_WD - (target.radius + run.radius + run.cruise) * run.direction;
  return run;
}

class EveryBoundedLaw : public testing::TestWithParam<const char*> {};

TEST_P(EveryBoundedLaw, RandomBreaksEndWithoutEnergyOrOverlapMade) {
  std::mt19937_64 random{5};
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  for (int i = 0; i < 4000; ++i) {
    WorldSettings settings{.audit = true};
    settings.restitution = i % 7 == 0 ? 0.0 : i % 7 == 1 ? 1.0 : uniform(0.0, 1.0);
    settings.friction = uniform(0.1, 0.5);
    auto world = world_of(GetParam(), settings);
    const int n = i % 100 == 0 ? 40 : 2 + i % 9;
    const double largest_gap = i % 3 == 0 ? 0.0 : i % 3 == 1 ? 2e-4 : 5e-3;
    const auto discs = test::random_cluster(random, n, largest_gap, 0.02, 0.045, i % 2 == 0);
    const double bearing = uniform(-std::numbers::pi, std::numbers::pi);
    Disc first = discs[0];  // the first one met from that side, so that the striker starts in the open
    const Vector2 direction{std::cos(bearing), std::sin(bearing)};
    for (const auto& disc : discs) {
      if (disc.p_WD.dot(direction) - disc.radius < first.p_WD.dot(direction) - first.radius) first = disc;
    }
    const StrikerRun run = strike(first, direction, uniform(0.2, 2.0));
    const auto rollout = world.run(discs, &run);
    ASSERT_TRUE(rollout) << rollout.error().text;
    EXPECT_EQ(rollout->status, Rollout::Status::kAtRest) << "case " << i << ", " << rollout->impacts << " impacts";
    EXPECT_LE(rollout->energy_gain, 1e-9) << "case " << i;
    EXPECT_LE(rollout->momentum_error, 1e-12) << "case " << i;
    EXPECT_GT(rollout->impacts, 0);
    EXPECT_GT(rollout->smallest_gap, -5e-4) << "case " << i << " e " << settings.restitution;
  }
}

TEST_P(EveryBoundedLaw, BreaksOf200DiscsEndWhetherTheyTouchOrOverlapByNoise) {
  std::mt19937_64 random{6};
  std::normal_distribution noise{0.0, 1e-4};
  auto world = world_of(GetParam(), {.audit = true});
  for (const bool overlapping : {false, true}) {
    auto discs = test::random_cluster(random, 200);
    if (overlapping) {
      for (auto& disc : discs) disc.p_WD += Vector2{noise(random), noise(random)};
      part_overlaps(discs);
    }
    discs[17].v_WD_W = {1.5, 0.3};
    const auto rollout = world.run(discs);
    ASSERT_TRUE(rollout) << rollout.error().text;
    EXPECT_EQ(rollout->status, Rollout::Status::kAtRest) << rollout->impacts << " impacts";
    EXPECT_LE(rollout->energy_gain, 1e-9);
    EXPECT_GT(rollout->smallest_gap, -5e-4);
  }
}

TEST_P(EveryBoundedLaw, ARolloutAllocatesNothing) {
  if (!control::test::counting_works()) GTEST_SKIP() << "a sanitizer counts allocations itself";
  std::mt19937_64 random{7};
  auto world = world_of(GetParam());
  for (int i = 0; i < 50; ++i) {
    const auto discs = test::random_cluster(random, 10, i % 2 == 0 ? 0.0 : 2e-4);
    const StrikerRun run =
        strike(*std::min_element(discs.begin(), discs.end(), [](const auto& a, const auto& b) { return a.p_WD.x() < b.p_WD.x(); }),
               {1.0, 0.0}, 1.0);
    ASSERT_TRUE(world.run(discs, &run));  // buffers grow to this cluster's needs
    control::test::start_counting();
    const auto rollout = world.run(discs, &run);
    const auto counts = control::test::stop_counting();
    EXPECT_TRUE(rollout);
    EXPECT_EQ(counts.heap, 0U) << "case " << i;
  }
}

TEST_P(EveryBoundedLaw, EndsAndKeepsEnergyAndMomentumWhateverTheCluster) {
  // `bench world --clusters 1000000` runs as many as are asked for.
  const auto trials = test::run_cluster_trials(GetParam(), 3000, 9);
  EXPECT_EQ(trials.wrongly_refused, 0);
  EXPECT_EQ(trials.overlaps, 60);
  EXPECT_EQ(trials.overlaps_refused, trials.overlaps);
  EXPECT_EQ(trials.at_rest, trials.rollouts - trials.overlaps);
  EXPECT_LE(trials.energy_gain, 1e-9);
  EXPECT_LE(trials.momentum_error, 1e-12);
  EXPECT_GT(trials.smallest_gap, -5e-4);
}

INSTANTIATE_TEST_SUITE_P(Laws, EveryBoundedLaw, testing::Values("paper_corrected", "sequential", "simultaneous", "generalised_reflections"),
                         [](const auto& test) { return std::string{test.param}; });

TEST(VirtualWorld, DoesNotKnowDirectionsAndRepeatsItself) {
  auto world = world_of();
  const std::vector start{test::disc_at(-0.1, 0.0), test::disc_at(0.0, 0.02, 0.04), test::disc_at(0.02, -0.06, 0.025)};
  std::vector<Vector2> first;
  for (const double turn : {0.0, 0.3, 1.0, 2.0, 4.0}) {
    const Eigen::Rotation2Dd R{turn};
    std::vector<Disc> discs = start;
    for (auto& disc : discs) disc.p_WD = R * disc.p_WD;
    discs[0].v_WD_W = R * Vector2{1.2, 0.1};
    const auto once = world.run(discs);
    ASSERT_TRUE(once);
    const std::vector<Vector2> rest{once->p_WD.begin(), once->p_WD.end()};
    const auto again = world.run(discs);
    for (std::size_t k = 0; k < rest.size(); ++k) EXPECT_EQ(rest[k], again->p_WD[k]);
    if (first.empty()) first = rest;
    for (std::size_t k = 0; k < rest.size(); ++k) EXPECT_LT((R.inverse() * rest[k] - first[k]).norm(), 1e-9);
  }
}

TEST(VirtualWorld, ASymmetricRackStaysSymmetricUnderTheCorrectedLaw) {
  const auto discs = test::rack(3);
  const StrikerRun run = strike(discs[0], {0.0, 1.0}, 1.2);
  auto world = world_of();
  const auto rollout = world.run(discs, &run);
  ASSERT_TRUE(rollout);
  EXPECT_NEAR(rollout->p_WD[4].x(), 0.0, 1e-6);
  EXPECT_NEAR(rollout->p_WD[1].x(), -rollout->p_WD[2].x(), 1e-6);
  EXPECT_NEAR(rollout->p_WD[3].y(), rollout->p_WD[5].y(), 1e-6);
}

TEST(VirtualWorld, TheStrikerGivesADiscTheSpeedOfTwoBodies) {
  // (19) with the normal components: v_a' = v_I (1 + e) M / (M + m); infinite mass first.
  for (const double mass : {1e300, 4.0, 1.0}) {
    const Disc disc = test::disc_at(0.0, 0.0);
    StrikerRun run = strike(disc, {1.0, 0.0}, 0.5);
    run.mobility = Matrix2::Identity() / mass;
    auto world = world_of();
    const auto rollout = world.run(std::vector{disc}, &run);
    ASSERT_TRUE(rollout);
    const double v = 0.5 * 1.8 / (1.0 + disc.mass / mass);
    EXPECT_NEAR(rollout->p_WD[0].x(), v * v / (2 * kDeceleration), 1e-9);
  }
}

TEST(VirtualWorld, AStrikerThatBrakesTooGentlyStrikesAgain) {
  const Disc disc = test::disc_at(0.0, 0.0);
  StrikerRun run = strike(disc, {1.0, 0.0}, 1.0);
  auto world = world_of();
  EXPECT_EQ(world.run(std::vector{disc}, &run)->impacts, 1);
  run.braking = 0.5;  // below mu g: the disc slows down faster than the striker (errata.md)
  EXPECT_GT(world.run(std::vector{disc}, &run)->impacts, 1);
}

TEST(VirtualWorld, SaysThatThePaperAsPrintedCannotRunAPair) {
  const std::vector discs{test::disc_at(0.0, 0.0), test::disc_at(0.1, 0.0)};
  StrikerRun run = strike(discs[0], {1.0, 0.0}, 1.0);
  auto printed = world_of("paper_as_printed");
  EXPECT_EQ(printed.run(discs, &run)->status, Rollout::Status::kLawFailed);
  auto sum_rule = world_of("paper_sum_rule");
  EXPECT_EQ(sum_rule.run(discs, &run)->status, Rollout::Status::kAtRest);
}

TEST(VirtualWorld, ReportsTheEnergyThatTheSumRuleMakes) {
  WorldSettings elastic{.audit = true};
  elastic.restitution = 1.0;
  auto discs = test::rack(4);
  discs[0].v_WD_W = {0.0, 1.0};
  auto world = world_of("paper_sum_rule", elastic);
  EXPECT_NEAR(world.run(discs)->energy_gain, 0.111, 2e-3);
}

TEST(VirtualWorld, RefusesWhatIsNoFormation) {
  auto world = world_of();
  auto discs = test::rack(2);
  discs[2].p_WD.x() -= 0.001;
  auto refused = world.run(discs);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().text, "discs 0 and 2 overlap by 0.494 mm; allowed: 0.010 mm");
  discs = test::rack(2);
  discs[1].p_WD.y() = std::nan("");
  EXPECT_FALSE(world.run(discs));
  discs = test::rack(2);
  discs[1].mass = 0.0;
  EXPECT_FALSE(world.run(discs));
  discs = test::rack(2);
  StrikerRun run = strike(discs[0], {0.0, 1.0}, 1.0);
  run.p_WS = discs[0].p_WD;
  EXPECT_FALSE(world.run(discs, &run));
  run = strike(discs[0], {0.0, 1.0}, 1.0);
  run.direction = {1.0, 1.0};
  EXPECT_FALSE(world.run(discs, &run));
  EXPECT_THROW(world_of("sequential", {.friction = 0.0}), std::invalid_argument);
}

TEST(VirtualWorld, NothingMovesThatNothingTouches) {
  auto world = world_of();
  EXPECT_TRUE(world.run({}));
  const auto rollout = world.run(test::rack(4));
  ASSERT_TRUE(rollout);
  EXPECT_EQ(rollout->impacts, 0);
  EXPECT_EQ(rollout->duration, 0.0);
  EXPECT_NEAR(rollout->smallest_gap, 0.0, 1e-12);
}

TEST(Formation, PartsTheOverlapsOfNoise) {
  std::mt19937_64 random{23};
  std::normal_distribution noise{0.0, 5e-4};
  for (int i = 0; i < 300; ++i) {
    auto discs = test::random_cluster(random, 6);
    for (auto& disc : discs) disc.p_WD += Vector2{noise(random), noise(random)};
    const auto seen = discs;
    part_overlaps(discs);
    EXPECT_FALSE(check_formation(discs, 2e-9));
    for (std::size_t k = 0; k < discs.size(); ++k) EXPECT_LT((discs[k].p_WD - seen[k].p_WD).norm(), 5e-3);
  }
}

}  // namespace
}  // namespace breakshot::world
