#include "sim_bridge/world/disc_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

constexpr double kStep = 62.5e-6;  // s, as in the cell
constexpr double kRadius = 0.030;

DiscState disc(const Vector2& p, const Vector2& v = {0.0, 0.0}) { return {.p_WD = p, .v_WD_W = v}; }
Vector2 towards(double bearing) { return {std::cos(bearing), std::sin(bearing)}; }

/// A table without arm; the rod hangs high above it unless a test lowers it.
class Bench {
 public:
  explicit Bench(const TablePhysics& physics, const std::vector<DiscState>& discs, std::vector<DiscTable::Post> posts = {})
      : table{physics, std::move(posts)} {
    table.place(discs);
  }

  void step() {
    table.step(rod, kStep);
    rod.p_W += rod.v_W * kStep;
  }
  void run(double seconds) {
    for (int i = 0; i < static_cast<int>(seconds / kStep); ++i) step();
  }
  void settle() {
    for (int i = 0; i < 200'000 && !table.at_rest(); ++i) step();
    ASSERT_TRUE(table.at_rest());
  }

  DiscTable table;
  StrikerRod rod;
};

TablePhysics frictionless() {
  TablePhysics physics;
  physics.friction = 0.0;
  return physics;
}

/// The six-disc rack of the paper's Fig. 11, one tip towards -x, touching but for `gap`.
std::vector<DiscState> rack(double gap) {
  std::vector<DiscState> discs;
  const double pitch = 2.0 * kRadius + gap;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k <= row; ++k) discs.push_back(disc({row * pitch * std::sqrt(0.75), (k - 0.5 * row) * pitch}));
  }
  return discs;
}

TEST(DiscTable, SlidesByCoulombsLawInEveryDirection) {
  for (const double speed : {0.05, 0.3, 1.0, 1.5}) {
    const double distance = speed * speed / (2.0 * 0.25 * kGravity);
    for (int degrees = 0; degrees < 360; degrees += 15) {
      const Vector2 direction = towards(degrees * std::numbers::pi / 180.0);
      Bench bench{TablePhysics{}, {disc({0.0, 0.0}, speed * direction)}};
      bench.settle();
      const Vector2 p = bench.table.state(0).p_WD;
      EXPECT_NEAR(p.dot(direction), distance, 0.005 * distance) << speed << " m/s, " << degrees << " deg";
      EXPECT_NEAR(p.dot(perpendicular(direction)), 0.0, 1e-9);
    }
  }
}

TEST(DiscTable, HeadOnImpactsKeepTheRestitution) {
  for (const double e : {0.0, 0.4, 0.8, 1.0}) {
    for (const double speed : {0.05, 0.5, 2.0}) {
      TablePhysics physics = frictionless();
      physics.restitution = e;
      Bench bench{physics, {disc({-0.1, 0.0}, {speed, 0.0}), disc({0.0, 0.0})}};
      bench.run(0.06 / speed);
      const double separation = bench.table.state(1).v_WD_W.x() - bench.table.state(0).v_WD_W.x();
      EXPECT_NEAR(separation / speed, e, 1e-6);
    }
  }
}

TEST(DiscTable, ObliqueImpactsKeepTheRestitutionAndTheTangentialSpeed) {
  std::mt19937 random{1};
  for (int i = 0; i < 200; ++i) {
    const double speed = std::uniform_real_distribution{0.2, 2.0}(random);
    const double offset = std::uniform_real_distribution{-0.055, 0.055}(random);
    Bench bench{frictionless(), {disc({-0.15, offset}, {speed, 0.0}), disc({0.0, 0.0})}};
    bench.run(0.16 / speed);
    // The line of centres when the rims meet, from geometry alone.
    const double sine = offset / (2.0 * kRadius);
    const Vector2 n{std::sqrt(1.0 - sine * sine), -sine};
    const Vector2 separation = bench.table.state(1).v_WD_W - bench.table.state(0).v_WD_W;
    EXPECT_NEAR(separation.dot(n) / (speed * n.x()), 0.8, 0.02);
    EXPECT_NEAR(bench.table.state(0).v_WD_W.dot(perpendicular(n)), speed * perpendicular(n).x(), 0.01 * speed);
  }
}

TEST(DiscTable, ImpactsKeepMomentum) {
  std::mt19937 random{2};
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  for (int i = 0; i < 50; ++i) {
    std::vector<DiscState> discs = rack(i % 2 == 0 ? 0.0 : 1e-4);
    for (DiscState& d : discs) d.mass = uniform(0.05, 0.3);
    discs.push_back(disc({-0.1, uniform(-0.02, 0.02)}, {uniform(0.3, 1.5), 0.0}));
    const Vector2 before = discs.back().mass * discs.back().v_WD_W;
    Bench bench{frictionless(), discs};
    bench.run(0.3);
    Vector2 after = Vector2::Zero();
    for (std::size_t k = 0; k < bench.table.size(); ++k) after += bench.table.state(k).mass * bench.table.state(k).v_WD_W;
    EXPECT_LT((after - before).norm(), 1e-9);
  }
}

class Break : public testing::TestWithParam<double> {};

TEST_P(Break, NeverGainsEnergy) {
  for (const double friction : {0.0, 0.25}) {
    for (const double e : {0.7, 0.8, 1.0}) {
      for (const double aim : {0.0, 0.004, 0.013}) {
        TablePhysics physics;
        physics.friction = friction;
        physics.restitution = e;
        std::vector<DiscState> discs = rack(GetParam());
        discs.push_back(disc({-0.1, aim}, {1.4, 0.0}));
        Bench bench{physics, discs};
        double energy = bench.table.kinetic_energy();
        for (int i = 0; i < 8000; ++i) {
          bench.step();
          const double now = bench.table.kinetic_energy();
          ASSERT_LE(now, energy * (1.0 + 1e-9)) << "step " << i << ", e " << e << ", aim " << aim;
          energy = now;
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Gaps, Break, testing::Values(0.0, 1e-9, 1e-6, 2e-4));

TEST(DiscTable, ASymmetricBreakStaysSymmetric) {
  std::vector<DiscState> discs = rack(0.0);
  discs.push_back(disc({-0.1, 0.0}, {1.2, 0.0}));
  Bench bench{TablePhysics{}, discs};
  bench.settle();
  const auto mirrored = [](const Vector2& p) { return Vector2{p.x(), -p.y()}; };
  EXPECT_LT((bench.table.state(1).p_WD - mirrored(bench.table.state(2).p_WD)).norm(), 1e-6);
  EXPECT_LT((bench.table.state(3).p_WD - mirrored(bench.table.state(5).p_WD)).norm(), 1e-6);
}

TEST(DiscTable, RestIsExact) {
  // Touching discs, one of them still sliding into the pack until it stops: no creep, no jitter, no reversal.
  std::vector<DiscState> discs = rack(0.0);
  discs.push_back(disc({-0.07, 0.003}, {0.3, 0.0}));
  Bench bench{TablePhysics{}, discs};
  bench.settle();
  std::vector<Vector2> rest;
  for (std::size_t i = 0; i < bench.table.size(); ++i) rest.push_back(bench.table.state(i).p_WD);
  bench.run(10.0);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    EXPECT_EQ(bench.table.state(i).p_WD, rest[i]);
    EXPECT_EQ(bench.table.state(i).v_WD_W, Vector2::Zero());
  }
}

TEST(DiscTable, FrictionStopsButNeverReverses) {
  Bench bench{TablePhysics{}, {disc({0.0, 0.0}, {0.4, -0.3})}};
  const Vector2 direction = Vector2{0.4, -0.3}.normalized();
  double speed = 0.5;
  while (!bench.table.at_rest()) {
    bench.step();
    const double now = bench.table.state(0).v_WD_W.dot(direction);
    ASSERT_GE(now, 0.0);
    ASSERT_LT(now, speed);
    speed = now;
  }
}

TEST(DiscTable, RimFrictionSpinsADiscAndTheTableStopsTheSpin) {
  TablePhysics physics;
  physics.contact_friction = 0.2;
  Bench bench{physics, {disc({-0.08, 0.03}, {0.8, 0.0}), disc({0.0, 0.0})}};
  bench.settle();
  EXPECT_GT(std::abs(bench.table.state(1).yaw), 0.01);
  EXPECT_EQ(bench.table.kinetic_energy(), 0.0);
}

TEST(DiscTable, OverlapsCloseUpOnceAndSlowly) {
  // A heavy slow rod drives one disc against another, again and again: whatever overlap the sub-steps leave must not throw them apart, so
  // nothing ever moves faster than one impact explains.
  Bench bench{TablePhysics{}, {disc({0.0, 0.0}), disc({2.0 * kRadius, 0.0})}};
  bench.rod = {.p_W = {-kRadius - 0.01, 0.0}, .v_W = {0.1, 0.0}, .tip_z = 0.008, .mobility = 0.01 * Matrix2::Identity()};
  for (int i = 0; i < 8000; ++i) {
    bench.rod.v_W = {0.1, 0.0};  // the drives hold the speed
    bench.step();
    ASSERT_LT(bench.table.state(0).v_WD_W.norm(), 0.1001);
    ASSERT_LT(bench.table.state(1).v_WD_W.norm(), 0.1801);
    ASSERT_GT(bench.table.state(1).p_WD.x() - bench.table.state(0).p_WD.x(), 2.0 * kRadius - 2e-5);
  }
  EXPECT_NEAR(bench.table.state(0).p_WD.x() - bench.rod.p_W.x(), kRadius + 0.01, 2e-5);
  EXPECT_EQ(bench.table.strikes(), 1U);
}

TEST(DiscTable, APushAlongTheTangentOpensTheGapToTheRodsDiameter) {
  // reference/singulation.md, own fact 1: R = 30, r = 10 mm gives 20.0 mm.
  for (const double aim : {0.0, 0.002, -0.003}) {
    Bench bench{TablePhysics{}, {disc({0.0, kRadius}), disc({0.0, -kRadius})}};
    const double start = -0.045;
    bench.rod = {.p_W = {start, aim}, .tip_z = 0.008, .mobility = 0.3 * Matrix2::Identity()};
    while (bench.rod.p_W.x() < 0.06) {
      bench.rod.v_W = {0.1, 0.0};
      bench.step();
    }
    bench.rod.tip_z = 1.0;
    bench.settle();
    const double gap = (bench.table.state(0).p_WD - bench.table.state(1).p_WD).norm() - 2.0 * kRadius;
    EXPECT_NEAR(gap, 0.020, 0.0006) << "aim " << aim;
  }
}

TEST(DiscTable, AStruckDiscLeavesByTheEffectiveMassOfTheRod) {
  for (const double mass : {0.5, 2.0, 10.0}) {
    Bench bench{frictionless(), {disc({0.0, 0.0})}};
    bench.rod = {.p_W = {-0.045, 0.0}, .v_W = {1.0, 0.0}, .tip_z = 0.008, .mobility = Matrix2::Identity() / mass};
    bench.run(0.02);
    EXPECT_NEAR(bench.table.state(0).v_WD_W.x(), 1.8 * mass / (mass + 0.1), 1e-6);
    EXPECT_NEAR(bench.rod.v_W.x(), 1.0 - 0.1 * bench.table.state(0).v_WD_W.x() / mass, 1e-6);
    EXPECT_NEAR(bench.rod.impulse_W.x(), -0.1 * bench.table.state(0).v_WD_W.x(), 1e-9);
    EXPECT_EQ(bench.table.strikes(), 1U);
  }
}

TEST(DiscTable, ARodAboveADiscPassesAndOneOnItStandsOnIt) {
  Bench bench{TablePhysics{}, {disc({0.0, 0.0})}};
  bench.rod = {.p_W = {-0.06, 0.0}, .v_W = {1.0, 0.0}, .tip_z = 0.021, .mobility = Matrix2::Identity()};
  bench.run(0.1);
  EXPECT_EQ(bench.table.state(0).p_WD, Vector2::Zero());
  bench.rod.p_W.setZero();
  bench.rod.tip_z = 0.0199;
  const auto below = bench.table.below(bench.rod);
  ASSERT_TRUE(below);
  EXPECT_DOUBLE_EQ(below->height, 0.020);
  bench.run(0.01);
  EXPECT_EQ(bench.table.strikes(), 0U);
}

TEST(DiscTable, DiscsFallOffTheEdgeAndAreGone) {
  Bench bench{TablePhysics{}, {disc({0.65, 0.0}, {1.5, 0.0}), disc({0.0, 0.0})}};
  bench.settle();
  EXPECT_FALSE(bench.table.state(0).on_table);
  EXPECT_TRUE(bench.table.state(1).on_table);
}

TEST(DiscTable, PostsStopDiscs) {
  Bench bench{frictionless(), {disc({-0.2, 0.0}, {-1.0, 0.0})}, {{{-0.5, 0.0}, 0.075}}};
  bench.run(0.5);
  EXPECT_NEAR(bench.table.state(0).v_WD_W.x(), 0.8, 1e-9);
}

TEST(DiscTable, SameInputsGiveTheSameBits) {
  std::vector<Vector2> first;
  for (int run = 0; run < 2; ++run) {
    std::vector<DiscState> discs = rack(0.0);
    discs.push_back(disc({-0.1, 0.0037}, {1.4, 0.0}));
    Bench bench{TablePhysics{}, discs};
    if (run == 1) dRandSetSeed(987654);
    bench.settle();
    for (std::size_t i = 0; i < bench.table.size(); ++i) {
      if (run == 0) {
        first.push_back(bench.table.state(i).p_WD);
      } else {
        EXPECT_EQ(first[i], bench.table.state(i).p_WD);
      }
    }
  }
}

TEST(DiscTable, ManyDiscsInATightPackNeverGainEnergy) {
  std::vector<DiscState> discs;
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 8; ++column) {
      discs.push_back(disc({(column + 0.5 * (row % 2)) * 0.06, row * 0.06 * std::sqrt(0.75)}));
    }
  }
  discs.pop_back();
  discs.insert(discs.begin(), disc({-0.062, 0.001}, {2.0, 0.4}));
  Bench bench{TablePhysics{}, discs};
  double energy = bench.table.kinetic_energy();
  for (int i = 0; i < 4000; ++i) {
    bench.step();
    ASSERT_LE(bench.table.kinetic_energy(), energy * (1.0 + 1e-9));
    energy = bench.table.kinetic_energy();
  }
}

TablePhysics compliant(double contact_time) {
  TablePhysics physics;
  physics.contact_time = contact_time;
  return physics;
}

TEST(CompliantTable, ImpactsOfTwoKeepRestitutionAndMomentum) {
  for (const double e : {0.7, 0.8, 1.0}) {
    TablePhysics physics = compliant(3e-4);
    physics.friction = 0.0;
    physics.restitution = e;
    Bench bench{physics, {disc({0.0, 0.0}, {1.0, 0.0}), disc({0.0605, 0.01})}};
    bench.run(0.01);
    const Vector2 n = (bench.table.state(1).p_WD - bench.table.state(0).p_WD).normalized();
    const Vector2 v = bench.table.state(1).v_WD_W - bench.table.state(0).v_WD_W;
    EXPECT_NEAR(v.dot(n), e * std::sqrt(1.0 - 1.0 / 36.0), 0.02);
    EXPECT_NEAR((bench.table.state(0).v_WD_W + bench.table.state(1).v_WD_W - Vector2{1.0, 0.0}).norm(), 0.0, 1e-9);
  }
}

TEST(CompliantTable, ABreakNeverGainsEnergyAndComesToRest) {
  for (const double gap : {0.0, 5e-5, 2e-4}) {
    auto discs = rack(gap);
    discs.push_back(disc({-0.10, 0.0}, {1.2, 0.0}));
    Bench bench{compliant(3e-4), discs};
    double energy = bench.table.kinetic_energy();
    for (int i = 0; i < 200'000 && !bench.table.at_rest(); ++i) {
      bench.step();
      // What the springs hold in mid-impact comes back, so the bound is what there was at the start.
      EXPECT_LE(bench.table.kinetic_energy(), 1.001 * energy);
    }
    EXPECT_TRUE(bench.table.at_rest());
  }
}

// physics.md section 2: with gaps far above speed x contact time the order of impacts is all that counts, and both laws agree.
TEST(CompliantTable, AgreesWithInstantsWhereGapsAreWide) {
  const auto rest_of = [](const TablePhysics& physics) {
    auto discs = rack(4e-3);
    discs.push_back(disc({-0.11, 0.004}, {0.9, 0.0}));
    Bench bench{physics, discs};
    bench.settle();
    std::vector<Vector2> p;
    for (std::size_t i = 0; i < bench.table.size(); ++i) p.push_back(bench.table.state(i).p_WD);
    return p;
  };
  const auto instants = rest_of({});
  const auto springs = rest_of(compliant(2e-5));
  for (std::size_t i = 0; i < instants.size(); ++i) EXPECT_NEAR((instants[i] - springs[i]).norm(), 0.0, 2e-3) << "disc " << i;
}

TEST(CompliantTable, APushAlongTheTangentOpensTheGapToTheRodsDiameter) {
  Bench bench{compliant(3e-4), {disc({0.0, kRadius}), disc({0.0, -kRadius})}};
  bench.rod.tip_z = 0.008;
  bench.rod.mobility = Matrix2::Zero();  // driven, whatever it meets
  bench.rod.p_W = {-0.03, 0.0};
  bench.rod.v_W = {0.05, 0.0};
  bench.run(1.4);
  const double gap = (bench.table.state(0).p_WD - bench.table.state(1).p_WD).norm() - 2.0 * kRadius;
  EXPECT_NEAR(gap, 0.020, 0.001);
}

TEST(FrictionMap, VariesWithinItsSpreadAndIsSmooth) {
  const FrictionMap even{0.25, 0.0, 1};
  const FrictionMap map{0.25, 0.3, 7};
  double low = 1.0, high = 0.0;
  for (double x = -0.5; x < 0.5; x += 0.01) {
    EXPECT_EQ(even.at({x, 0.1}), 0.25);
    const double mu = map.at({x, 0.1});
    EXPECT_LE(std::abs(mu / 0.25 - 1.0), 0.3);
    EXPECT_LT(std::abs(map.at({x + 1e-3, 0.1}) - mu), 0.003);
    low = std::min(low, mu);
    high = std::max(high, mu);
  }
  EXPECT_GT(high - low, 0.01);
}

TEST(CheckDiscs, SaysWhatIsWrong) {
  const Rect table{{-0.7, -0.6}, {0.7, 0.6}};
  EXPECT_EQ(check_discs(rack(0.0), table), "");
  EXPECT_THAT(check_discs(std::vector{disc({0, 0}), disc({0.05, 0})}, table), testing::HasSubstr("discs 0 and 1 overlap by 10 mm"));
  EXPECT_NE(check_discs(std::vector{disc({0.71, 0})}, table), "");
  EXPECT_NE(check_discs(std::vector{disc({std::nan(""), 0})}, table), "");
  DiscState massless = disc({0, 0});
  massless.mass = 0.0;
  EXPECT_NE(check_discs(std::vector{massless}, table), "");
}

}  // namespace
}  // namespace breakshot::sim_bridge
