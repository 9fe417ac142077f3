// Impacts at the same instant under `sequential`: one impact, symmetric where the formation is, and nothing made.

#include "planner/world/virtual_world.hpp"
#include "tests/planner/clusters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace breakshot::world {
namespace {

constexpr double kDeceleration = 0.25 * kGravity;
constexpr double kRestitution = 0.8;

VirtualWorld sequential() { return VirtualWorld{{.restitution = kRestitution, .audit = true}, make_impact_law("sequential")}; }

/// A disc that runs along +x at 1 m/s into two that rest `bearing` off its way on both sides once it has gone 0.1 m; the second one lies `later` further back.
std::vector<Disc> fork(double bearing, double later = 0.0) {
  std::vector<Disc> discs{test::disc_at(0.0, 0.0)};
  discs[0].v_WD_W = {1.0, 0.0};
  for (const double side : {1.0, -1.0}) {
    const double x = 0.1 + 0.06 * std::cos(bearing) + (side < 0.0 ? later : 0.0);
    discs.push_back(test::disc_at(x, side * 0.06 * std::sin(bearing)));
  }
  return discs;
}

TEST(Tie, OneDiscInTwoThatTouchNobodyIsTheTripleOfThePaper) {
  // (11)-(13) for any angle between the two, by symmetry: P (2 + cos 2 bearing) / m = (1 + e) v cos bearing. At 30 degrees the two would touch.
  for (const double bearing : {0.53, 0.7, 0.9, 1.2}) {
    const auto discs = fork(bearing);
    auto world = sequential();
    const auto rollout = world.run(discs);
    ASSERT_TRUE(rollout);
    const double v = std::sqrt(1.0 - 2.0 * kDeceleration * 0.1);
    const double P = (1.0 + kRestitution) * v * std::cos(bearing) / (2.0 + std::cos(2.0 * bearing));
    const double way = P * P / (2.0 * kDeceleration);
    for (const int side : {1, 2}) {
      const Vector2 n{std::cos(bearing), side == 1 ? std::sin(bearing) : -std::sin(bearing)};
      EXPECT_NEAR((rollout->p_WD[static_cast<std::size_t>(side)] - discs[static_cast<std::size_t>(side)].p_WD - way * n).norm(), 0.0, 1e-9);
    }
    const double v_on = v - 2.0 * P * std::cos(bearing);
    EXPECT_NEAR(rollout->p_WD[0].x(), 0.1 + v_on * std::abs(v_on) / (2.0 * kDeceleration), 1e-9);
    EXPECT_EQ(rollout->impacts, 1);
    EXPECT_LE(rollout->energy_gain, 0.0);
    EXPECT_LE(rollout->momentum_error, 1e-12);
  }
}

TEST(Tie, IsOneToRoundingAndNoFurther) {
  const auto asymmetry = [](double later) {
    auto world = sequential();
    const auto rollout = world.run(fork(0.7, later));
    return std::abs(rollout->p_WD[1].y() + rollout->p_WD[2].y());
  };
  EXPECT_LT(asymmetry(0.5e-9), 1e-8);
  // The first takes its full share of two bodies before the second is met.
  EXPECT_GT(asymmetry(1e-8), 0.005);
}

/// Where the discs of a formation come to rest when a cue disc runs along +x into its middle, with the formation and the run turned by `turn`; turned back.
std::vector<Vector2> broken(std::vector<Disc> discs, double gap, double turn, Rollout& rollout) {
  for (Disc& disc : discs) disc.p_WD *= 1.0 + gap / 0.06;
  double leftmost = std::numeric_limits<double>::infinity();
  for (const Disc& disc : discs) leftmost = std::min(leftmost, disc.p_WD.x());
  Disc cue = test::disc_at(leftmost - 0.1, 0.0);
  cue.v_WD_W = {1.2, 0.0};
  discs.push_back(cue);
  const Eigen::Rotation2Dd R{turn};
  for (Disc& disc : discs) disc = {R * disc.p_WD, R * disc.v_WD_W, disc.radius, disc.mass};
  auto world = sequential();
  rollout = *world.run(discs);
  std::vector<Vector2> rest;
  for (const Vector2& p : rollout.p_WD) rest.push_back(R.inverse() * p);
  return rest;
}

TEST(Tie, ASymmetricFormationBreaksSymmetrically) {
  // Those of the paper's formations that are their own mirror image in the x axis.
  for (const char* name : {"A", "B", "C", "D", "E"}) {
    const auto start = test::formation(name);
    for (const double gap : {0.0, 1e-5, 2e-4, 5e-3}) {
      for (const double turn : {0.0, 0.4, 2.5}) {
        Rollout rollout;
        const auto rest = broken(start, gap, turn, rollout);
        EXPECT_EQ(rollout.status, Rollout::Status::kAtRest);
        EXPECT_LE(rollout.energy_gain, 1e-12);
        EXPECT_LE(rollout.momentum_error, 1e-12);
        for (std::size_t i = 0; i < start.size(); ++i) {
          for (std::size_t k = 0; k < start.size(); ++k) {
            if ((start[i].p_WD - Vector2{start[k].p_WD.x(), -start[k].p_WD.y()}).norm() > 1e-12) continue;
            EXPECT_LT((rest[i] - Vector2{rest[k].x(), -rest[k].y()}).norm(), 1e-6)
                << name << ", gap " << gap << ", turned by " << turn << ": discs " << i << " and " << k;
          }
        }
        EXPECT_NEAR(rest.back().y(), 0.0, 1e-6);
      }
    }
  }
}

TEST(Tie, TwoImpactsThatShareNoDiscStayTwo) {
  // Twice the same pair, far apart: each as if alone.
  std::vector<Disc> discs{test::disc_at(0.0, 0.0), test::disc_at(0.1, 0.0), test::disc_at(0.0, 0.4), test::disc_at(0.1, 0.4)};
  discs[0].v_WD_W = discs[2].v_WD_W = {1.0, 0.0};
  auto world = sequential();
  const auto rollout = world.run(discs);
  ASSERT_TRUE(rollout);
  EXPECT_EQ(rollout->impacts, 2);
  EXPECT_NEAR(rollout->p_WD[1].x(), rollout->p_WD[3].x(), 1e-12);
  EXPECT_NEAR(rollout->p_WD[3].y(), 0.4, 1e-12);
}

}  // namespace
}  // namespace breakshot::world
