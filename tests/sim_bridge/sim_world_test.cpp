#include "sim_bridge/world/sim_world.hpp"

#include "sim_bridge/arm/arm_dynamics.hpp"
#include "tests/sim_bridge/cell_arm.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

constexpr double kTick = 1e-3;  // s

SimSettings settings_at(const JointVector& q) {
  SimSettings settings;
  settings.X_WB = cell_base();
  settings.q_start = q;
  settings.start = time_from_ns(5'000'000'000);
  return settings;
}

/// Commands one joint-space motion tick by tick, as the controller does.
class Commander {
 public:
  explicit Commander(SimWorld& world) : world_{world} {}

  CommandVerdict send(const JointVector& q, const JointVector& qd, const JointVector& qdd) {
    JointCommand command{.seq = ++seq_, .session = 99, .state_seq = world_.joint_state().seq, .q = q, .qd = qd, .qdd = qdd};
    command.due = world_.now() + SimWorld::kTick;
    return world_.command(command);
  }
  void hold(const JointVector& q, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      ASSERT_EQ(send(q, JointVector::Zero(6), JointVector::Zero(6)), CommandVerdict::kTaken);
      world_.tick();
    }
  }

 private:
  SimWorld& world_;
  std::uint64_t seq_ = 0;
};

/// Speeds joint 1 up from rest to `speed` at `acceleration` and on at that speed for `cruise_s`.
void swing(SimWorld& world, Commander& commander, const JointVector& q, double speed, double acceleration, double cruise_s) {
  const JointVector axis = JointVector::Unit(6, 0) * (speed > 0 ? 1.0 : -1.0);
  const double ramp_s = std::abs(speed) / acceleration;
  const int ticks = static_cast<int>((ramp_s + cruise_s) / kTick);
  for (int i = 1; i <= ticks; ++i) {
    const double t = i * kTick;
    const double t_ramp = std::min(t, ramp_s);
    const double angle = 0.5 * acceleration * t_ramp * t_ramp + std::abs(speed) * (t - t_ramp);
    const CommandVerdict verdict = commander.send(q + angle * axis, acceleration * t_ramp * axis, (t < ramp_s ? acceleration : 0.0) * axis);
    ASSERT_EQ(verdict, CommandVerdict::kTaken);
    world.tick();
  }
}

TEST(SimWorld, GravityDoesNotMoveAnUncommandedArm) {
  const JointVector q = pose_over({0.1, 0.1, 0.2});
  SimWorld world{cell_arm(), settings_at(q)};
  for (int i = 0; i < 2000; ++i) world.tick();
  EXPECT_LT((world.joint_state().q - q).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT(world.joint_state().tau.cwiseAbs().maxCoeff(), 5.0);  // the drives carry it
  EXPECT_TRUE(world.joint_state().braked);
  EXPECT_EQ(world.joint_state().seq, 2001U);
  EXPECT_EQ(to_ns(world.now()), 7'000'000'000);
}

TEST(SimWorld, FollowsAFastMotionOfAllJointsWithinItsTorques) {
  const JointVector q = pose_over({0.0, 0.0, 0.3});
  SimWorld world{cell_arm(), settings_at(q)};
  Commander commander{world};
  JointVector amplitude(6);
  amplitude << 0.5, 0.15, -0.2, 0.3, 0.3, 0.6;
  const double omega = 2.0 * M_PI * 0.6;  // up to 2.3 rad/s and 8.5 rad/s^2
  const double lag = to_seconds(DriveSettings{}.lag);
  double worst = 0.0;
  double drift = 0.0;
  const ArmDynamics model{cell_arm(), cell_base(), DriveSettings{}.rotor_inertia};
  for (int i = 1; i <= 4000; ++i) {
    const auto at = [&](double t) { return JointVector{q + amplitude * (1.0 - std::cos(omega * t)) * 0.5}; };
    const double t = i * kTick;
    ASSERT_EQ(
        commander.send(at(t), amplitude * (0.5 * omega * std::sin(omega * t)), amplitude * (0.5 * omega * omega * std::cos(omega * t))),
        CommandVerdict::kTaken);
    world.tick();
    if (i > 20) worst = std::max(worst, (world.joint_state().q - at(t - lag)).cwiseAbs().maxCoeff());
    drift = std::max(drift, (world.p_WT() - model.posture(world.joint_state().q).X_WT.translation()).norm());
  }
  EXPECT_LT(worst, 2e-4);  // rad from the lagged set-point
  EXPECT_LT(drift, 2e-6);  // m between ODE's last body and its joint angles: the hinges hold together
  EXPECT_LT(world.peak_torque_share(), 1.0);
  RecordProperty("tracking_error_urad", static_cast<int>(worst * 1e6));
  RecordProperty("hinge_drift_nm", static_cast<int>(drift * 1e9));
}

TEST(SimWorld, TorqueStaysAtItsLimitWhateverIsAsked) {
  ArmDescription weak = cell_arm();
  weak.joints[0].max_torque = 4.0;
  const JointVector q = pose_over({0.2, 0.0, 0.2});
  SimWorld world{weak, settings_at(q)};
  Commander commander{world};
  double peak = 0.0;
  for (int i = 1; i <= 300; ++i) {
    const double t = i * kTick;
    commander.send(q + 5.0 * t * t * JointVector::Unit(6, 0), 10.0 * t * JointVector::Unit(6, 0), 10.0 * JointVector::Unit(6, 0));
    world.tick();
    peak = std::max(peak, std::abs(world.joint_state().tau[0]));
  }
  EXPECT_DOUBLE_EQ(peak, 4.0);
  EXPECT_LT(world.joint_state().q[0] - q[0], 0.3);  // it lags behind instead of being put where it was asked to be
}

TEST(SimWorld, StopsWithinAQuarterOfASecondWhenCommandsStop) {
  const JointVector q = pose_over({0.2, 0.1, 0.2});
  SimWorld world{cell_arm(), settings_at(q)};
  Commander commander{world};
  swing(world, commander, q, 3.1, 10.0, 0.05);
  EXPECT_NEAR(world.joint_state().qd[0], 3.1, 0.02);
  // 20 ms of silence, 3.1 / 15 s of braking, a few ms for the drives' lag.
  for (int i = 0; i < 240; ++i) world.tick();
  EXPECT_LT(world.joint_state().qd.cwiseAbs().maxCoeff(), 0.01);
  EXPECT_TRUE(world.joint_state().braked);
}

/// A hit by the real arm: swings joint 1 so that the tip passes a disc's rim at `speed`.
struct Hit {
  double disc_speed = 0.0, tip_before = 0.0, tip_after = 0.0, effective_mass = 0.0;
  std::uint32_t strikes = 0;
};
Hit hit(double speed) {
  const Vector3 start{0.05, -0.15, 0.008};
  const JointVector q = pose_over(start);
  SimSettings settings = settings_at(q);
  settings.physics.friction = 0.0;
  SimWorld world{cell_arm(), settings};
  // The tip runs on a circle round the base; the disc lies on it, 0.2 rad after the place where the tip reaches its speed.
  const Vector2 p_BT = start.head<2>() - cell_base().translation().head<2>();
  const double radius = p_BT.norm();
  const double rate = speed / radius;
  const double ramp = rate * rate / (2.0 * 10.0);
  const double bearing = std::atan2(p_BT.y(), p_BT.x()) + ramp + 0.2;
  const Vector2 p_contact = cell_base().translation().head<2>() + radius * Vector2{std::cos(bearing), std::sin(bearing)};
  const Vector2 n{-std::sin(bearing), std::cos(bearing)};
  const std::vector<SimDisc> discs{SimDisc{.p_WD = p_contact + 0.040 * n}};
  world.place(discs);
  Commander commander{world};
  Hit hit;
  const ArmDynamics model{cell_arm(), cell_base(), DriveSettings{}.rotor_inertia};
  const JointVector axis = JointVector::Unit(6, 0);
  const double ramp_s = rate / 10.0;
  for (int i = 1; i < 2000 && hit.strikes == 0; ++i) {
    const double t = i * kTick;
    const double t_ramp = std::min(t, ramp_s);
    hit.tip_before = world.v_WT().head<2>().dot(n);
    hit.effective_mass = 1.0 / n.dot(model.tip_mobility(model.posture(world.joint_state().q)) * n);
    EXPECT_EQ(
        commander.send(q + (5.0 * t_ramp * t_ramp + rate * (t - t_ramp)) * axis, 10.0 * t_ramp * axis, (t < ramp_s ? 10.0 : 0.0) * axis),
        CommandVerdict::kTaken);
    world.tick();
    hit.strikes = world.truth().strikes;
  }
  hit.disc_speed = world.truth().discs[0].v_WD_W.dot(n);
  hit.tip_after = world.v_WT().head<2>().dot(n);
  return hit;
}

TEST(SimWorld, AHitGivesTheDiscTheSpeedOfAnImpactWithTheArmsEffectiveMass) {
  for (const double speed : {0.3, 0.6, 1.0, 1.5}) {
    const Hit hit = sim_bridge::hit(speed);
    ASSERT_EQ(hit.strikes, 1U) << speed;
    const double M = hit.effective_mass;
    EXPECT_NEAR(hit.tip_before, speed, 0.005 * speed);
    EXPECT_NEAR(hit.disc_speed, 1.8 * hit.tip_before * M / (M + 0.1), 0.01 * speed);
    // What the disc took, the arm lost; its drives have had at most a tick to bring it back.
    EXPECT_LT(hit.tip_after, hit.tip_before);
    RecordProperty("effective_mass_g", static_cast<int>(M * 1e3));
  }
}

TEST(SimWorld, APushWithTheArmPartsTwoDiscsByTheRodsDiameter) {
  // The tip moves along y of W when joint 1 turns at a point straight ahead of the base.
  const double reach = 0.55;
  const JointVector q = pose_over({reach - 0.5, 0.0, 0.008});
  const double from = -0.055 / reach;
  SimSettings settings = settings_at(q + from * JointVector::Unit(6, 0));
  SimWorld world{cell_arm(), settings};
  const std::vector<SimDisc> discs{SimDisc{.p_WD = {reach - 0.5 - 0.03, 0.0}}, SimDisc{.p_WD = {reach - 0.5 + 0.03, 0.0}}};
  world.place(discs);
  Commander commander{world};
  swing(world, commander, settings.q_start, 0.1 / reach, 2.0, 1.1);
  const SimTruth truth = world.truth();
  EXPECT_GT(truth.p_WT.y(), 0.05);
  const double gap = (truth.discs[0].p_WD - truth.discs[1].p_WD).norm() - 0.060;
  EXPECT_NEAR(gap, 0.020, 0.0015);  // the path is an arc here
  EXPECT_EQ(truth.strikes, 2U);
  EXPECT_TRUE(world.discs_at_rest());
}

TEST(SimWorld, TheTableStopsAStrikerThatIsDrivenIntoIt) {
  const JointVector above = pose_over({0.0, 0.0, 0.010});
  const JointVector inside = pose_over({0.0, 0.0, -0.005});
  SimWorld world{cell_arm(), settings_at(above)};
  Commander commander{world};
  for (int i = 1; i <= 500; ++i) {
    ASSERT_EQ(commander.send(above + (inside - above) * (i / 500.0), (inside - above) / 0.5, JointVector::Zero(6)), CommandVerdict::kTaken);
    world.tick();
  }
  commander.hold(inside, 500);
  EXPECT_GT(world.p_WT().z(), -0.002);
  EXPECT_LT(world.v_WT().norm(), 1e-3);
}

TEST(SimWorld, SettlesExactlyAndStartsAgain) {
  const JointVector q = pose_over({0.0, 0.0, 0.2});
  SimWorld world{cell_arm(), settings_at(q)};
  Commander commander{world};
  swing(world, commander, q, 0.5, 5.0, 0.1);
  for (int i = 0; i < 300; ++i) world.tick();
  const JointState rest = world.joint_state();
  EXPECT_TRUE(rest.qd.isZero(0.0));
  for (int i = 0; i < 300; ++i) world.tick();
  EXPECT_EQ(world.joint_state().q, rest.q);
  swing(world, commander, rest.q, -0.5, 5.0, 0.1);
  EXPECT_NEAR(world.joint_state().qd[0], -0.5, 0.01);
}

TEST(SimWorld, EqualInputsGiveEqualBits) {
  std::vector<JointState> states;
  std::vector<SimTruth> truths;
  for (int run = 0; run < 2; ++run) {
    const JointVector q = pose_over({0.0, -0.12, 0.008});
    SimWorld world{cell_arm(), settings_at(q)};
    const std::vector<SimDisc> discs{SimDisc{.p_WD = {0.0, 0.0}}, SimDisc{.p_WD = {0.03, 0.052}}, SimDisc{.p_WD = {-0.03, 0.052}}};
    world.place(discs);
    Commander commander{world};
    swing(world, commander, q, 1.5, 10.0, 0.2);
    states.push_back(world.joint_state());
    truths.push_back(world.truth());
  }
  EXPECT_EQ(states[0].q, states[1].q);
  EXPECT_EQ(states[0].qd, states[1].qd);
  ASSERT_GT(truths[0].strikes, 0U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(truths[0].discs[i].p_WD, truths[1].discs[i].p_WD);
    EXPECT_EQ(truths[0].discs[i].v_WD_W, truths[1].discs[i].v_WD_W);
  }
}

TEST(SimWorld, RefusesBadCommandsAndCountsThem) {
  const JointVector q = pose_over({0.0, 0.0, 0.2});
  SimWorld world{cell_arm(), settings_at(q)};
  Commander commander{world};
  const JointVector zero = JointVector::Zero(6);
  EXPECT_EQ(commander.send(q * std::numeric_limits<double>::quiet_NaN(), zero, zero), CommandVerdict::kMalformed);
  EXPECT_EQ(commander.send(q + JointVector::Constant(6, 0.1), zero, zero), CommandVerdict::kJump);
  EXPECT_EQ(world.verdicts()[static_cast<std::size_t>(CommandVerdict::kMalformed)], 1U);
  EXPECT_EQ(world.verdicts()[static_cast<std::size_t>(CommandVerdict::kJump)], 1U);
  EXPECT_TRUE(world.joint_state().braked);
}

TEST(SimWorld, RefusesDiscsThatCannotBeThere) {
  const JointVector q = pose_over({0.0, 0.0, 0.008});
  SimWorld world{cell_arm(), settings_at(q)};
  const auto place = [&](std::vector<SimDisc> discs) { world.place(discs); };
  place({SimDisc{.p_WD = {0.1, 0.0}}});
  try {
    place({SimDisc{.p_WD = {0.02, 0.0}}});
    ADD_FAILURE() << "placed a disc under the striker";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "disc 0 overlaps the striker");
  }
  EXPECT_THROW(place({SimDisc{.p_WD = {0.1, 0.0}}, SimDisc{.p_WD = {0.1, 0.05}}}), std::invalid_argument);
  ASSERT_EQ(world.truth().discs.size(), 1U);  // as before the refused ones
}

TEST(SimWorld, RefusesAbsurdSettings) {
  const JointVector q = pose_over({0.0, 0.0, 0.2});
  SimSettings coarse = settings_at(q);
  coarse.arm_step = std::chrono::milliseconds{1};
  EXPECT_THROW(SimWorld(cell_arm(), coarse), std::invalid_argument);
  SimSettings sticky = settings_at(q);
  sticky.physics.friction = -0.1;
  EXPECT_THROW(SimWorld(cell_arm(), sticky), std::invalid_argument);
  EXPECT_THROW(SimWorld(cell_arm(), settings_at(JointVector::Constant(6, 7.0))), std::invalid_argument);
}

}  // namespace
}  // namespace breakshot::sim_bridge
