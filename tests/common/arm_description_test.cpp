#include "common/urdf/arm_description.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <Eigen/Eigenvalues>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace breakshot {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kPi = std::numbers::pi;
const std::filesystem::path kShipped = BREAKSHOT_SOURCE_DIR "/config/arms/ur5e_striker.urdf";

/// Two revolute joints, with something fixed to the base, to the first link and at the tip.
const std::string kSmallArm = R"(<robot name="small">
  <link name="base"/>
  <joint name="j1" type="revolute">
    <parent link="base"/>
    <child link="l1"/>
    <origin xyz="0 0 0.3" rpy="0 0 0"/>
    <axis xyz="0 0 2"/>
    <limit lower="-1" upper="2" velocity="3" effort="40"/>
  </joint>
  <link name="l1">
    <inertial>
      <origin xyz="0.1 0 0" rpy="0 0 0"/>
      <mass value="2"/>
      <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual>
      <geometry><sphere radius="0.05"/></geometry>
      <material name="orange"><color rgba="1 0.5 0 1"/></material>
    </visual>
    <collision>
      <geometry><box size="0.1 0.2 0.3"/></geometry>
    </collision>
  </link>
  <joint name="f1" type="fixed">
    <parent link="l1"/>
    <child link="l1b"/>
    <origin xyz="0.4 0 0" rpy="0 0 1.5707963267948966"/>
  </joint>
  <link name="l1b">
    <inertial>
      <origin xyz="0 0.1 0" rpy="0 0 0"/>
      <mass value="1"/>
      <inertia ixx="0.01" iyy="0.02" izz="0.03" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision>
      <origin xyz="0 0 0.2" rpy="0 0 0"/>
      <geometry><cylinder radius="0.03" length="0.4"/></geometry>
    </collision>
  </link>
  <joint name="j2" type="revolute">
    <parent link="l1b"/>
    <child link="l2"/>
    <origin xyz="0.1 0 0" rpy="0 0 0"/>
    <axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" velocity="1" effort="10"/>
  </joint>
  <link name="l2">
    <inertial>
      <mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="f2" type="fixed">
    <parent link="l2"/>
    <child link="tip"/>
    <origin xyz="0 0 0.5" rpy="0 0 0"/>
  </joint>
  <link name="tip"/>
</robot>
)";

ArmDescription load_text(const std::string& text, const std::string& base = "base", const std::string& tip = "tip") {
  const std::filesystem::path file = std::filesystem::path{testing::TempDir()} / ("breakshot_" + std::to_string(getpid()) + "_arm.urdf");
  std::ofstream{file, std::ios::binary} << text;
  return load_arm(file, base, tip);
}

std::string error_of(const std::string& text, const std::string& base = "base", const std::string& tip = "tip") {
  try {
    (void)load_text(text, base, tip);
  } catch (const ArmDescriptionError& error) {
    return error.what();
  }
  return "no error";
}

std::string replaced(const std::string& from, const std::string& to) {
  std::string text = kSmallArm;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST(ArmDescription, ReadsJointsLinksAndShapes) {
  const ArmDescription arm = load_text(kSmallArm);
  EXPECT_EQ(arm.name, "small");
  EXPECT_EQ(arm.base.name, "base");
  ASSERT_EQ(arm.joints.size(), 2U);
  ASSERT_EQ(arm.links.size(), 2U);
  EXPECT_EQ(arm.joints[0].name, "j1");
  EXPECT_EQ(arm.joints[0].axis_L, Vector3(0, 0, 1));
  EXPECT_EQ(arm.joints[0].lower, -1);
  EXPECT_EQ(arm.joints[0].upper, 2);
  EXPECT_EQ(arm.joints[0].max_speed, 3);
  EXPECT_EQ(arm.joints[0].max_torque, 40);
  EXPECT_EQ(arm.joints[0].X_PL.translation(), Vector3(0, 0, 0.3));
  const LinkDescription& l1 = arm.links[0];
  ASSERT_EQ(l1.visuals.size(), 1U);
  EXPECT_EQ(l1.visuals[0].kind, Shape::Kind::kSphere);
  EXPECT_EQ(l1.visuals[0].size, Vector3(0.05, 0, 0));
  EXPECT_EQ(l1.visuals[0].rgb[1], 0.5F);
  ASSERT_EQ(l1.collisions.size(), 2U);
  EXPECT_EQ(l1.collisions[0].size, Vector3(0.1, 0.2, 0.3));
  EXPECT_EQ(arm.X_LT.translation(), Vector3(0, 0, 0.5));
}

TEST(ArmDescription, MergesWhatFixedJointsHold) {
  const ArmDescription arm = load_text(kSmallArm);
  const LinkDescription& l1 = arm.links[0];
  // l1b sits at (0.4, 0, 0), turned by 90 degrees about z, so its centre of mass (0, 0.1, 0) is at (0.3, 0, 0) in l1.
  EXPECT_DOUBLE_EQ(l1.mass, 3.0);
  EXPECT_NEAR(l1.p_LCom.x(), (2 * 0.1 + 1 * 0.3) / 3, 1e-12);
  EXPECT_NEAR(l1.p_LCom.y(), 0.0, 1e-12);
  // Huygens-Steiner by the reduced mass 2/3 kg at a distance of 0.2 m; ixx and iyy of l1b change places.
  const double steiner = 2.0 / 3.0 * 0.2 * 0.2;
  EXPECT_NEAR(l1.I_Com_L(0, 0), 0.02 + 0.02, 1e-12);
  EXPECT_NEAR(l1.I_Com_L(1, 1), 0.03 + 0.01 + steiner, 1e-12);
  EXPECT_NEAR(l1.I_Com_L(2, 2), 0.04 + 0.03 + steiner, 1e-12);
  // Its cylinder and the next joint come along.
  EXPECT_EQ(l1.collisions[1].kind, Shape::Kind::kCylinder);
  EXPECT_EQ(l1.collisions[1].size, Vector3(0.03, 0.4, 0));
  EXPECT_TRUE(l1.collisions[1].X_LS.translation().isApprox(Vector3(0.4, 0, 0.2)));
  EXPECT_TRUE(arm.joints[1].X_PL.translation().isApprox(Vector3(0.4, 0.1, 0)));
  EXPECT_TRUE((arm.joints[1].X_PL.linear() * Vector3::UnitX()).isApprox(Vector3::UnitY()));
}

TEST(ArmDescription, TheBaseMayBeAnyLinkAndTheTipTheLastMovingOne) {
  const ArmDescription arm = load_text(kSmallArm, "l1", "l2");
  ASSERT_EQ(arm.joints.size(), 1U);
  EXPECT_EQ(arm.joints[0].name, "j2");
  EXPECT_DOUBLE_EQ(arm.base.mass, 3.0);
  EXPECT_TRUE(arm.X_LT.isApprox(Pose::Identity()));
}

TEST(ArmDescription, RefusesWithFileLineFoundAndAllowed) {
  const std::vector<std::pair<std::string, std::string>> cases{
      // malformed
      {"", "found an empty or unreadable file"},
      {"<robot", ":1: found malformed XML"},
      {"hello", ":1: found malformed XML"},
      {replaced("</joint>", ""), "found malformed XML"},
      {"<model/>", ":1: found <model> at the root; allowed: <robot>"},
      {"<robot name=\"x\"/>", "urdfdom: found No link elements found in urdf file"},
      {replaced("mass value=\"2\"", "mass value=\"two\""), "found"},
      {replaced("mass value=\"2\"", "mass value=\"nan\""), "found"},
      {replaced("upper=\"2\" velocity=\"3\"", "upper=\"inf\" velocity=\"3\""), "found"},
      {replaced("xyz=\"0 0 0.3\"", "xyz=\"0 0\""), "found"},
      {replaced("link name=\"l2\"", "link name=\"l1\""),
       ":47: link l1: found the name a second time; allowed: each name once; the first is at line 10"},
      {replaced("child link=\"l2\"", "child link=\"l3\""), "found"},
      // joints
      {replaced("    <limit lower=\"-1\" upper=\"2\" velocity=\"3\" effort=\"40\"/>\n", ""), ":3: "},
      {replaced("lower=\"-1\" upper=\"2\"", "lower=\"2\" upper=\"-1\""),
       ":8: joint j1: found lower 2.000000 and upper -1.000000; allowed: lower < upper, rad"},
      {replaced("lower=\"-1\" upper=\"2\" ", ""), ":8: joint j1: found lower 0.000000 and upper 0.000000"},
      {replaced("velocity=\"3\"", "velocity=\"0\""), ":8: joint j1: found velocity 0.000000; allowed: a speed above zero, rad/s"},
      {replaced("velocity=\"3\" ", ""), ":3: urdfdom: found joint limit: no velocity"},
      {replaced("effort=\"40\"", "effort=\"-1\""), ":8: joint j1: found effort -1.000000; allowed: a torque above zero, N m"},
      {replaced("type=\"revolute\"", "type=\"continuous\""), ":3: joint j1: found a continuous joint, which has no limits"},
      {replaced("type=\"revolute\"", "type=\"prismatic\""), ":3: joint j1: found a prismatic joint"},
      {replaced("type=\"revolute\"", "type=\"floating\""), ":3: joint j1: found a floating joint"},
      {replaced("type=\"revolute\"", "type=\"planar\""), ":3: joint j1: found a planar joint"},
      {replaced("type=\"revolute\"", "type=\"screw\""), ":3: urdfdom: found"},
      {replaced("<axis xyz=\"0 0 2\"/>", "<axis xyz=\"0 0 0\"/>"), ":3: joint j1: found an axis of length zero"},
      {replaced("<axis xyz=\"1 0 0\"/>", "<axis xyz=\"1 0 0\"/><mimic joint=\"j1\"/>"), ":40: joint j2: found a joint that mimics j1"},
      {replaced("type=\"fixed\"", "type=\"revolute\""), "found"},
      // bodies
      {replaced("<mass value=\"2\"/>", "<mass value=\"-2\"/>"), ":10: link l1: found a mass below zero"},
      {replaced("ixx=\"0.02\"", "ixx=\"-0.02\""), ":10: link l1: found an inertia that is not positive definite"},
      {replaced("ixx=\"0.02\"", "ixx=\"0.2\""), ":10: link l1: found an inertia that no body has"},
      {replaced("<mass value=\"1\"/>\n      <inertia ixx=\"0.01\" iyy=\"0.01\"",
                "<mass value=\"0\"/>\n      <inertia ixx=\"0.01\" iyy=\"0.01\""),
       ":47: link l2: found no mass"},
      {replaced("<sphere radius=\"0.05\"/>", "<mesh filename=\"a.stl\"/>"), ":10: link l1, visual: found a mesh"},
      {replaced("<sphere radius=\"0.05\"/>", "<sphere radius=\"0\"/>"), ":10: link l1, visual: found a size that is not above zero"},
      {replaced("<box size=\"0.1 0.2 0.3\"/>", "<box size=\"0.1 -0.2 0.3\"/>"), ":10: link l1, collision: found a size"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string message = error_of(text);
    EXPECT_THAT(message, HasSubstr(expected)) << text.substr(0, 300);
    EXPECT_THAT(message, HasSubstr("_arm.urdf"));
    EXPECT_THAT(message, HasSubstr("; allowed: "));
  }
}

TEST(ArmDescription, RefusesChainsThatAreNotThere) {
  EXPECT_THAT(error_of(kSmallArm, "base", "tool"), HasSubstr("link tool: found no such link; allowed: base, l1, l1b, l2, tip"));
  EXPECT_THAT(error_of(kSmallArm, "root", "tip"), HasSubstr("link root: found no such link"));
  EXPECT_THAT(error_of(kSmallArm, "tip", "base"), HasSubstr(":2: link base: found no chain of joints to it from tip"));
  EXPECT_THAT(error_of(kSmallArm, "l2", "tip"), HasSubstr("link tip: found no revolute joint between it and l2"));
  EXPECT_THAT(error_of(kSmallArm, "base", "l1"), HasSubstr(":40: joint j2: found a moving joint off the chain to l1"));
  try {
    (void)load_arm("/nowhere/arm.urdf", "base", "tip");
    FAIL();
  } catch (const ArmDescriptionError& error) {
    EXPECT_THAT(error.what(), StartsWith("/nowhere/arm.urdf: arm: found no such file"));
  }
}

TEST(ArmDescription, RefusesMoreJointsThanFit) {
  std::ostringstream text;
  text << R"(<robot name="long"><link name="l0"/>)";
  for (int i = 1; i <= 8; ++i) {
    text << R"(<link name="l)" << i << R"("><inertial><mass value="1"/>)"
         << R"(<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>)"
         << R"(<joint name="j)" << i << R"(" type="revolute"><parent link="l)" << i - 1 << R"("/><child link="l)" << i << R"("/>)"
         << R"(<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>)";
  }
  text << "</robot>";
  EXPECT_NO_THROW((void)load_text(text.str(), "l1", "l8"));
  EXPECT_THAT(error_of(text.str(), "l0", "l8"),
              HasSubstr("joint j8: found one more moving joint than the arm may have; allowed: at most 7"));
}

/// Damages a good file at random places: it either still reads or throws ArmDescriptionError, and never anything else.
TEST(ArmDescription, DamagedFilesThrowOnlyArmDescriptionErrors) {
  std::mt19937 random{11};
  const std::string alphabet = "<>/\"= a0.-e9\n&;!-\x80";
  for (int i = 0; i < 1'000; ++i) {
    std::string text = kSmallArm;
    const auto edits = 1 + random() % 3;
    for (unsigned e = 0; e < edits; ++e) {
      const std::size_t at = random() % text.size();
      if (random() % 2 == 0) {
        text[at] = alphabet[random() % alphabet.size()];
      } else {
        text.erase(at, 1 + random() % 8);
      }
    }
    try {
      (void)load_text(text);
    } catch (const ArmDescriptionError& error) {
      EXPECT_THAT(error.what(), HasSubstr("found "));
    }
  }
}

TEST(ShippedArm, HasTheUr5esPublishedFigures) {
  const ArmDescription arm = load_arm(kShipped, "base_link", "striker_tip");
  ASSERT_EQ(arm.joints.size(), 6U);
  const std::vector<double> torques{150, 150, 150, 28, 28, 28};
  const std::vector<double> masses{3.761, 8.058, 2.846, 1.37, 1.3, 0.365 + 0.17};  // the last one with the striker
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(arm.joints[i].max_speed, kPi, 1e-9);
    EXPECT_EQ(arm.joints[i].max_torque, torques[i]);
    EXPECT_NEAR(arm.joints[i].upper, i == 2 ? kPi : 2 * kPi, 1e-9);
    EXPECT_EQ(arm.joints[i].lower, -arm.joints[i].upper);
    EXPECT_NEAR(arm.links[i].mass, masses[i], 1e-9);
    EXPECT_FALSE(arm.links[i].visuals.empty());
    EXPECT_FALSE(arm.links[i].collisions.empty());
    for (const Shape& shape : arm.links[i].visuals) {
      const auto [low, high] = std::minmax({shape.rgb[0], shape.rgb[1], shape.rgb[2]});
      EXPECT_LE(high - low, 0.03F) << "perception takes colours for discs; the arm has none";
    }
  }
}

/// The standard Denavit-Hartenberg product of the published parameters, and the chain of the file, give the same tip.
TEST(ShippedArm, FollowsThePublishedDenavitHartenbergParameters) {
  const ArmDescription arm = load_arm(kShipped, "base_link", "striker_tip");
  struct Row {
    double d, a, alpha;
  };
  const std::vector<Row> rows{{0.1625, 0, kPi / 2}, {0, -0.425, 0},        {0, -0.3922, 0},
                              {0.1333, 0, kPi / 2}, {0.0997, 0, -kPi / 2}, {0.0996, 0, 0}};
  std::mt19937 random{1};
  std::uniform_real_distribution<double> angle{-kPi, kPi};
  for (int i = 0; i < 1'000; ++i) {
    Pose published{Pose::Identity()};
    Pose ours{Pose::Identity()};
    for (std::size_t j = 0; j < 6; ++j) {
      const double q = angle(random);
      published = published * Eigen::AngleAxisd{q, Vector3::UnitZ()} * Eigen::Translation3d{rows[j].a, 0, rows[j].d} *
                  Eigen::AngleAxisd{rows[j].alpha, Vector3::UnitX()};
      ours = ours * arm.joints[j].X_PL * Eigen::AngleAxisd{q, arm.joints[j].axis_L};
    }
    published = published * Eigen::Translation3d{0, 0, 0.2};  // the striker
    ours = ours * arm.X_LT;
    EXPECT_TRUE(ours.isApprox(published, 1e-12)) << ours.matrix() << "\n" << published.matrix();
  }
}

}  // namespace
}  // namespace breakshot
