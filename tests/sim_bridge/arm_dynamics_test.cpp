#include "sim_bridge/arm/arm_dynamics.hpp"

#include "sim_bridge/arm/arm_body.hpp"
#include "tests/sim_bridge/cell_arm.hpp"
#include "tests/support/arms.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

namespace breakshot::sim_bridge {
namespace {

constexpr double kRotor = 0.07;  // kg m^2

class Random {
 public:
  explicit Random(unsigned seed) : engine_{seed} {}
  JointVector joints(double size) {
    JointVector v(6);
    for (double& x : v) x = std::uniform_real_distribution{-size, size}(engine_);
    return v;
  }

 private:
  std::mt19937 engine_;
};

/// Kinetic energy from the velocities of the links, by finite differences of the posture: knows nothing of Newton-Euler.
double kinetic_energy(const ArmDescription& description, const ArmDynamics& arm, const JointVector& q, const JointVector& qd) {
  constexpr double kStep = 1e-6;
  const ArmPosture before = arm.posture(q - kStep * qd);
  const ArmPosture after = arm.posture(q + kStep * qd);
  double energy = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    const LinkDescription& link = description.links[i];
    const Vector3 v = (after.X_WL[i] * link.p_LCom - before.X_WL[i] * link.p_LCom) / (2.0 * kStep);
    const Eigen::AngleAxisd turn{Matrix3{before.X_WL[i].linear().transpose() * after.X_WL[i].linear()}};
    const Vector3 omega_L = turn.angle() * turn.axis() / (2.0 * kStep);
    energy += 0.5 * link.mass * v.squaredNorm() + 0.5 * omega_L.dot(link.I_Com_L * omega_L);
  }
  return energy + 0.5 * kRotor * qd.squaredNorm();
}

TEST(ArmDynamics, MassMatrixGivesTheLinksKineticEnergy) {
  const ArmDescription description = cell_arm();
  const ArmDynamics arm{description, cell_base(), kRotor};
  Random random{1};
  for (int i = 0; i < 100; ++i) {
    const JointVector q = random.joints(3.0);
    const JointVector qd = random.joints(3.0);
    const MassMatrix M = arm.mass_matrix(arm.posture(q));
    EXPECT_NEAR(0.5 * qd.dot(M * qd), kinetic_energy(description, arm, q, qd), 1e-6);
    EXPECT_LT((M - M.transpose()).norm(), 1e-12);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MassMatrix>{M}.eigenvalues().minCoeff(), 0.0);
  }
}

TEST(ArmDynamics, TipJacobianIsTheTipsVelocity) {
  const ArmDynamics arm{cell_arm(), cell_base(), kRotor};
  Random random{2};
  for (int i = 0; i < 100; ++i) {
    const JointVector q = random.joints(3.0);
    const JointVector qd = random.joints(1.0);
    const Vector3 moved = arm.posture(q + 1e-6 * qd).X_WT.translation() - arm.posture(q - 1e-6 * qd).X_WT.translation();
    EXPECT_LT((arm.tip_jacobian(arm.posture(q)) * qd - moved / 2e-6).norm(), 1e-8);
  }
}

/// ODE's bodies and hinges, started at some speed and left to the drives' torques, accelerate as Newton-Euler says they must.
TEST(ArmBody, MovesAsTheEquationsOfMotionSay) {
  Random random{3};
  constexpr double kDt = 1e-5;
  for (int i = 0; i < 20; ++i) {
    const JointVector q = random.joints(2.0);
    const JointVector qdd = random.joints(8.0);
    ArmBody body{cell_arm(), cell_base(), DriveSettings{}, q};
    // A reference that asks for the acceleration and agrees with the present state leaves only the feed-forward.
    body.step({q, JointVector::Zero(6), qdd}, Vector3::Zero(), kDt);
    if (body.peak_torque_share() >= 1.0) continue;
    EXPECT_LT((body.qd() / kDt - qdd).norm(), 1e-4 * qdd.norm());
  }
}

TEST(ArmBody, TakesAnImpulseAtTheTipByItsEffectiveMass) {
  const JointVector q = pose_over({0.05, -0.1, 0.008});
  const ArmDynamics dynamics{cell_arm(), cell_base(), DriveSettings{}.rotor_inertia};
  const Matrix2 mobility = dynamics.tip_mobility(dynamics.posture(q));
  for (const Vector2& impulse : {Vector2{0.18, 0.0}, Vector2{0.0, -0.18}, Vector2{0.1, 0.1}}) {
    constexpr double kDt = 2.5e-4;
    ArmBody body{cell_arm(), cell_base(), DriveSettings{}, q};
    Vector3 force = Vector3::Zero();
    force.head<2>() = impulse / kDt;
    body.step({q, JointVector::Zero(6), JointVector::Zero(6)}, force, kDt);
    EXPECT_LT((body.v_WT().head<2>() - mobility * impulse).norm(), 0.002 * (mobility * impulse).norm());
  }
  // A collaborative arm's tip weighs a few kg.
  EXPECT_GT(1.0 / mobility(0, 0), 1.0);
  EXPECT_LT(1.0 / mobility(0, 0), 20.0);
}

TEST(ArmDynamics, RefusesWhatIsNoArm) { EXPECT_THROW(ArmDynamics(ArmDescription{}, Pose::Identity(), kRotor), std::invalid_argument); }

}  // namespace
}  // namespace breakshot::sim_bridge
