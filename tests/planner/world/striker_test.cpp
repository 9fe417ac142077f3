// The striker of the virtual world: thrown back by what it strikes, brought back by its drives.

#include "planner/world/striker_motion.hpp"
#include "planner/world/virtual_world.hpp"
#include "tests/planner/clusters.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace breakshot::world {
namespace {

constexpr double kDeceleration = 0.25 * kGravity;

StrikerRun run_at(double speed, double bandwidth) {
  StrikerRun run;
  run.speed = speed;
  run.cruise = 0.02;
  run.p_WS = {-0.06, 0.0};  // meets a disc of 30 mm at the origin when the cruise ends
  run.braking = 0.5;
  run.lift = 0.12;
  run.mobility = Matrix2::Identity() / 1.2;
  run.bandwidth = bandwidth;
  return run;
}

/// Where the legs lead from `time` on.
struct Walk {
  Vector2 p;
  double time;
};
Walk walk(StrikerMotion& striker, Walk from, double to) {
  while (from.time < to) {
    const auto leg = striker.leg(from.time, from.p);
    const double lasts = std::min(leg.until, to) - from.time;
    from.p += lasts * (leg.v - 0.5 * lasts * leg.deceleration);
    from.time += lasts;
  }
  return from;
}

TEST(StrikerMotion, ComesBackToItsRunAsCriticallyDampedDrivesBringIt) {
  const StrikerRun run = run_at(0.6, 150.0);
  StrikerMotion struck, free;
  const auto both_begin = [&] {
    struck.begin(run);
    free.begin(run);
    return Walk{run.p_WS, 0.0};
  };
  const double contact = run.cruise / run.speed;
  const Vector2 change{-0.1, 0.03};
  double worst = 0.0, furthest = 0.0;
  for (const double t : {1e-4, 5e-4, 2e-3, 5e-3, 6.7e-3, 15e-3, 27e-3, 60e-3}) {
    const Walk at_contact = walk(struck, both_begin(), contact);
    const Walk without = walk(free, {run.p_WS, 0.0}, contact + t);
    ASSERT_TRUE(struck.throw_back(contact, at_contact.p, change));
    const Vector2 off = walk(struck, at_contact, contact + t).p - without.p;
    const Vector2 expected = change * t * std::exp(-run.bandwidth * t);
    worst = std::max(worst, (off - expected).norm());
    furthest = std::max(furthest, expected.norm());
  }
  EXPECT_GT(furthest, 0.2e-3);
  EXPECT_LT(worst, 0.25 * furthest);  // on a piece; at its ends it is exact
}

TEST(StrikerMotion, AddsUpWhatTwoImpactsTake) {
  const StrikerRun run = run_at(0.6, 150.0);
  const double first = run.cruise / run.speed, second = first + 1.5e-3, seen = second + 2e-3;
  StrikerMotion striker;
  striker.begin(run);
  Walk at = walk(striker, {run.p_WS, 0.0}, first);
  striker.throw_back(at.time, at.p, {-0.1, 0.0});
  at = walk(striker, at, second);
  striker.throw_back(at.time, at.p, {-0.05, 0.0});
  at = walk(striker, at, seen);
  const auto off = [&](double since) { return (seen - since) * std::exp(-run.bandwidth * (seen - since)); };
  const double on_run = run.cruise + (seen - first) * (run.speed - 0.5 * run.braking * (seen - first));
  EXPECT_NEAR(at.p.x() - run.p_WS.x(), on_run - 0.1 * off(first) - 0.05 * off(second), 4e-5);  // within a piece
}

TEST(StrikerMotion, IsBackAtOnceWithoutABandwidth) {
  StrikerMotion striker;
  striker.begin(run_at(0.6, 0.0));
  EXPECT_FALSE(striker.throw_back(0.02 / 0.6, {-0.04, 0.0}, {-0.1, 0.0}));
}

TEST(VirtualWorld, ADiscThatStopsAtItsNeighbourIsStruckAgainByTheStrikerThatWasThrownBack) {
  const std::vector<Disc> discs{test::disc_at(0.0, 0.0), test::disc_at(0.06005, 0.0)};
  const double e = 0.8, m = discs[0].mass, M = 1.2;
  const double share = (1.0 + e) / (M + m);  // of the approach speed: M of it goes to the disc, m off the striker
  for (const bool at_once : {true, false}) {
    StrikerRun run = run_at(0.6, at_once ? 0.0 : 150.0);
    run.lift = 0.05;
    VirtualWorld world{{}, make_impact_law("sequential")};
    const auto rollout = world.run(discs, &run);
    ASSERT_TRUE(rollout);
    const double first = share * M * run.speed;
    const double left = 0.5 * (1.0 - e) * first;
    // Some 0.1 ms pass between the two, in which the drives bring back a few hundredths of what the striker lost.
    const double striker = at_once ? run.speed : run.speed * (1.0 - 0.93 * share * m);
    const double second = left + share * M * (striker - left);
    const double neighbour = 0.5 * (1.0 + e) * first;
    // When it is faster than its neighbour then, the two meet once more.
    const double after = second > neighbour ? 0.5 * ((1.0 - e) * second + (1.0 + e) * neighbour) : second;
    EXPECT_EQ(second > neighbour, at_once);
    EXPECT_EQ(rollout->impacts, at_once ? 4 : 3);
    EXPECT_NEAR(rollout->p_WD[0].x(), after * after / (2.0 * kDeceleration), 2.5e-3);
  }
}

TEST(VirtualWorld, ADiscThatIsMetSlowlyStaysAtTheStrikerUntilThatRises) {
  const std::vector<Disc> discs{test::disc_at(0.0, 0.0)};
  const StrikerRun run = run_at(0.15, 150.0);
  for (const bool stays : {true, false}) {
    WorldSettings settings;
    settings.striker_bounce_speed = stays ? 0.2 : 0.0;
    VirtualWorld world{settings, make_impact_law("sequential")};
    const auto rollout = world.run(discs, &run);
    ASSERT_TRUE(rollout);
    const double driven = run.lift * (run.speed - 0.5 * run.braking * run.lift);
    const double v_end = run.speed - run.braking * run.lift;
    const double slid = v_end * v_end / (2.0 * kDeceleration);
    if (stays) {
      EXPECT_NEAR(rollout->p_WD[0].x(), driven + slid, 1e-3);
      EXPECT_LT(rollout->impacts, 40);
    } else {
      EXPECT_GT(std::abs(rollout->p_WD[0].x() - driven - slid), 1.5e-3);
    }
  }
}

TEST(VirtualWorld, TheStrikersMassIsThatAlongTheNormal) {
  const std::vector<Disc> discs{test::disc_at(0.0, 0.0)};
  StrikerRun run = run_at(0.6, 0.0);
  run.braking = 20.0;
  run.mobility << 1.0, 0.3, 0.3, 0.5;
  WorldSettings settings;
  VirtualWorld world{settings, make_impact_law("sequential")};
  for (const double bearing : {0.0, 1.0, 2.5}) {
    const Vector2 n{std::cos(bearing), std::sin(bearing)};
    run.direction = n;
    run.p_WS = -0.06 * n;
    const auto rollout = world.run(discs, &run);
    ASSERT_TRUE(rollout);
    const double v = 1.8 * run.speed / (1.0 + discs[0].mass * n.dot(run.mobility * n));
    EXPECT_NEAR(rollout->p_WD[0].norm(), v * v / (2.0 * kDeceleration), 1e-6);
  }
}

}  // namespace
}  // namespace breakshot::world
