#include "controller/kinematics/arm_kinematics.hpp"
#include "controller/kinematics/general_ik.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "tests/support/arms.hpp"
#include "tests/support/random_pose.hpp"

#include <gtest/gtest.h>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>

#include <cmath>
#include <numbers>
#include <random>

namespace breakshot::kinematics {
namespace {

using support::difference;
using support::random_joints;

constexpr int kPoses = 10'000;  // issue 3

Pose base_in_world() {
  Pose X_WB{Eigen::Translation3d{-0.5, 0.1, 0.02}};
  X_WB.rotate(Eigen::AngleAxisd{0.3, Vector3{0.1, 0.2, 1.0}.normalized()});
  return X_WB;
}

class EveryArm : public testing::TestWithParam<ArmDescription (*)()> {
 protected:
  EveryArm() : description{GetParam()()}, arm{description, base_in_world()} {}

  ArmDescription description;
  ArmKinematics arm;
  std::mt19937 random{1};
};

INSTANTIATE_TEST_SUITE_P(Arms, EveryArm, testing::Values(&support::ur5e, &support::panda, &support::irb2400, &support::xarm7),
                         [](const auto& instance) { return instance.param().name; });

TEST_P(EveryArm, TipIsTheProductOfTheDescribedPoses) {
  for (int i = 0; i < 100; ++i) {
    const JointVector q = random_joints(arm, random);
    Pose X = base_in_world();
    std::vector<Pose> X_WL(description.joints.size());
    const Pose tip = arm.links_in_world(q, X_WL);
    for (std::size_t j = 0; j < description.joints.size(); ++j) {
      X = X * description.joints[j].X_PL * Pose{Eigen::AngleAxisd{q[static_cast<int>(j)], description.joints[j].axis_L}};
      EXPECT_TRUE(X.isApprox(X_WL[j], 1e-12));
    }
    EXPECT_TRUE((X * description.X_LT).isApprox(tip, 1e-12));
    EXPECT_TRUE(tip.isApprox(arm.tip_in_world(q), 1e-12));
  }
}

TEST_P(EveryArm, AgreesWithKdlsOwnSolvers) {
  KDL::ChainFkSolverPos_recursive fk{arm.chain()};
  KDL::ChainJntToJacSolver jacobian{arm.chain()};
  KDL::JntArray q_kdl(static_cast<unsigned>(arm.joints()));
  KDL::Jacobian J_kdl(static_cast<unsigned>(arm.joints()));
  Matrix3 R_WB = base_in_world().linear();
  for (int i = 0; i < 100; ++i) {
    const JointVector q = random_joints(arm, random);
    q_kdl.data = q;
    KDL::Frame X;
    ASSERT_EQ(fk.JntToCart(q_kdl, X), 0);
    const Pose X_BT = arm.tip_in_base(q);
    EXPECT_NEAR(X.p.x(), X_BT.translation().x(), 1e-13);
    EXPECT_NEAR(X.p.z(), X_BT.translation().z(), 1e-13);
    EXPECT_NEAR(X.M(0, 1), X_BT.linear()(0, 1), 1e-13);

    ASSERT_EQ(jacobian.JntToJac(q_kdl, J_kdl), 0);
    Jacobian J_W;
    arm.tip_in_world(q, J_W);
    EXPECT_TRUE((R_WB * J_kdl.data.topRows<3>()).isApprox(J_W.topRows<3>(), 1e-10));
    EXPECT_TRUE((R_WB * J_kdl.data.bottomRows<3>()).isApprox(J_W.bottomRows<3>(), 1e-10));
  }
}

TEST_P(EveryArm, GeneralSolverReachesReachablePoses) {
  const GeneralIk ik{arm};
  const JointVector near = 0.5 * (arm.lower() + arm.upper());
  int solved = 0;
  for (int i = 0; i < kPoses; ++i) {
    const Pose X_WT = arm.tip_in_world(random_joints(arm, random));
    const GeneralIkResult result = ik.solve(X_WT, near);
    if (!result.solved) continue;
    const auto error = difference(arm.tip_in_world(result.q), X_WT);
    ASSERT_LT(error.position, 1e-6);
    ASSERT_LT(error.rotation, 1e-6);
    ASSERT_TRUE(arm.within_limits(result.q));
    ++solved;
  }
  EXPECT_GE(solved, 0.999 * kPoses);
}

TEST_P(EveryArm, GeneralSolverGivesUpOnWhatIsOutOfReach) {
  const InverseKinematics ik{arm};
  Pose far = Pose::Identity();
  far.translation() = Vector3{10.0, 0.0, 0.0};
  EXPECT_TRUE(ik.solve(far, JointVector::Zero(arm.joints())).empty());
}

TEST(ParallelAxesIk, IsRecognisedByGeometryAlone) {
  const auto recognised = [](const ArmDescription& description) {
    return ParallelAxesIk::recognise(ArmKinematics{description, Pose::Identity()}).has_value();
  };
  EXPECT_TRUE(recognised(support::ur5e()));
  EXPECT_FALSE(recognised(support::panda()));
  EXPECT_FALSE(recognised(support::irb2400()));

  // The same arm with one axis turned round and frames placed elsewhere is still of the class; one bent by a milliradian is not.
  ArmDescription other = support::ur5e();
  const Pose shift = Eigen::Translation3d{0.0, 0.0, 0.07} * Pose{Eigen::AngleAxisd{std::numbers::pi, Vector3::UnitX()}};
  other.joints[2].X_PL = other.joints[2].X_PL * shift;
  other.joints[3].X_PL = shift.inverse() * other.joints[3].X_PL;
  other.joints[4].axis_L = -other.joints[4].axis_L;
  const ArmKinematics arm{other, base_in_world()};
  const InverseKinematics ik{arm};
  ASSERT_TRUE(ik.has_closed_form());
  std::mt19937 random{3};
  for (int i = 0; i < 1000; ++i) {
    const Pose X_WT = arm.tip_in_world(random_joints(arm, random));
    const IkSolutions solutions = ik.solve(X_WT, JointVector::Zero(6));
    ASSERT_FALSE(solutions.empty());
    for (const JointVector& q : solutions) EXPECT_LT(difference(arm.tip_in_world(q), X_WT).position, 1e-8);
  }
  other.joints[3].X_PL.rotate(Eigen::AngleAxisd{1e-3, Vector3::UnitX()});
  EXPECT_FALSE(recognised(other));
}

TEST(SphericalWristIk, IsRecognisedByGeometryAlone) {
  const auto recognised = [](const ArmDescription& description) {
    return SphericalWristIk::recognise(ArmKinematics{description, Pose::Identity()}).has_value();
  };
  EXPECT_TRUE(recognised(support::irb2400()));
  EXPECT_FALSE(recognised(support::ur5e()));
  EXPECT_FALSE(recognised(support::panda()));

  ArmDescription bent = support::irb2400();
  bent.joints[4].X_PL.translation().y() += 1e-3;
  EXPECT_FALSE(recognised(bent));
}

/// Arms with a closed form. The last one has its elbow and wrist turned round, an offset shoulder and a slanted wrist: still of the class.
ArmDescription odd_spherical_wrist() {
  ArmDescription arm = support::irb2400();
  arm.joints[2].axis_L = -arm.joints[2].axis_L;
  arm.joints[4].axis_L = -arm.joints[4].axis_L;
  arm.joints[2].X_PL.translation().y() += 0.1;
  arm.joints[3].X_PL.rotate(Eigen::AngleAxisd{0.3, Vector3{1.0, 2.0, 3.0}.normalized()});
  return arm;
}

class ClosedFormArms : public testing::TestWithParam<ArmDescription (*)()> {};
INSTANTIATE_TEST_SUITE_P(Arms, ClosedFormArms, testing::Values(&support::ur5e, &support::irb2400, &odd_spherical_wrist));

TEST_P(ClosedFormArms, FindsEveryReachablePoseAndTheVeryJointsItWasMadeFrom) {
  const ArmKinematics arm{GetParam()(), base_in_world()};
  const InverseKinematics ik{arm};
  ASSERT_TRUE(ik.has_closed_form());
  std::mt19937 random{2};
  for (int i = 0; i < kPoses; ++i) {
    const JointVector truth = random_joints(arm, random);
    const Pose X_WT = arm.tip_in_world(truth);
    const IkSolutions solutions = ik.solve(X_WT, truth);
    ASSERT_FALSE(solutions.empty());
    double last = 0.0;
    for (const JointVector& q : solutions) {
      const auto error = difference(arm.tip_in_world(q), X_WT);
      EXPECT_LT(error.position, 1e-8);
      EXPECT_LT(error.rotation, 1e-8);
      EXPECT_TRUE(arm.within_limits(q));
      const double way = (q - truth).cwiseAbs().maxCoeff();
      EXPECT_GE(way, last);  // nearest first
      last = way;
    }
    // With the truth as reference, its own branch at its own turns comes first.
    EXPECT_LT((solutions.q[0] - truth).cwiseAbs().maxCoeff(), 1e-5);
  }
}

TEST(ClosedForm, KeepsTheJointThatIsFreeWhereAxesFallTogether) {
  for (const auto description : {&support::ur5e, &support::irb2400}) {
    const ArmKinematics arm{description(), base_in_world()};
    const InverseKinematics ik{arm};
    std::mt19937 random{5};
    for (int i = 0; i < 100; ++i) {
      JointVector truth = random_joints(arm, random);
      truth[4] = 0.0;  // axis 6 along axis 4
      const IkSolutions solutions = ik.solve(arm.tip_in_world(truth), truth);
      ASSERT_FALSE(solutions.empty());
      EXPECT_LT((solutions.q[0] - truth).cwiseAbs().maxCoeff(), 1e-5);
    }
  }
}

TEST(NearestTurns, StaysWithinLimitsAndNear) {
  const ArmKinematics arm{support::ur5e(), Pose::Identity()};
  const double pi = std::numbers::pi;
  JointVector q = JointVector::Zero(6);
  JointVector near = JointVector::Zero(6);
  q << 3.0, -3.0, 3.0, 0.0, 0.0, 0.0;
  near << -3.0, 3.0, -3.0, 6.0, -9.0, 0.0;
  const auto turned = nearest_turns(arm, q, near);
  ASSERT_TRUE(turned);
  JointVector expected(6);
  expected << 3.0 - 2 * pi, -3.0 + 2 * pi, 3.0, 2 * pi, -2 * pi, 0.0;  // the elbow (+-pi) cannot turn over
  EXPECT_LT((*turned - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ArmKinematics, RefusesArmsWithoutUsableLimits) {
  ArmDescription arm = support::ur5e();
  arm.joints[2].upper = arm.joints[2].lower;
  EXPECT_THROW((ArmKinematics{arm, Pose::Identity()}), std::invalid_argument);
  EXPECT_THROW((ArmKinematics{ArmDescription{}, Pose::Identity()}), std::invalid_argument);
}

}  // namespace
}  // namespace breakshot::kinematics
