// Perception on the pictures of the cell's own camera, with the cell's own configuration. The other tests of this folder use a renderer that
// shares no code with the simulator; figures over many more scenes come from `./breakshot bench perception`.

#include "common/config/camera_file.hpp"
#include "common/config/formation.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "perception/perceiver.hpp"
#include "perception/perception_config.hpp"
#include "sim_bridge/sim_bridge_config.hpp"
#include "tests/support/render_scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace breakshot::perception {
namespace {

using sim_bridge::DiscState;

constexpr double kDiscHeight = 0.020;  // m, as support::disc_at() has it

// Everything that a picture takes. Made once: GL takes a while to start.
struct Studio {
  ConfigDocument document = load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml");
  CellConfig cell = load_cell_config(document);
  PerceptionSettings settings = load_perception_config(document, cell).settings;
  CameraModel camera = load_camera(cell.camera_file);
  ArmDescription arm = load_cell_arm(cell);
  kinematics::ArmKinematics kinematics{arm, cell.arm.X_WB};
  support::SceneRenderer renderer{sim_bridge::load_sim_bridge_config(document, cell).camera, camera, arm, cell.arm.X_WB};
};

class Rendered : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { studio_ = std::make_unique<Studio>(); }
  static void TearDownTestSuite() { studio_.reset(); }

  static Perceiver perceiver() { return Perceiver{studio_->settings, studio_->camera, studio_->arm, studio_->cell.arm.X_WB}; }
  static std::vector<Pose> links(const JointVector& q) {
    std::vector<Pose> X_WL(studio_->arm.links.size());
    (void)studio_->kinematics.links_in_world(q, X_WL);
    return X_WL;
  }
  support::RenderedScene take(const std::vector<DiscState>& discs, std::span<const Pose> X_WL) {
    ++frame_;
    auto picture = studio_->renderer.take(discs, frame_, X_WL);
    picture.color.seq = picture.depth.seq = frame_;
    picture.color.exposed = picture.depth.exposed = time_from_ns(static_cast<std::int64_t>(frame_) * 33'333'333);
    return picture;
  }
  double uniform(double low, double high) { return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0); }

  // Discs that do not overlap, anywhere in the workspace.
  std::vector<DiscState> spread(std::size_t n) {
    std::vector<DiscState> discs;
    while (discs.size() < n) {
      const auto disc = support::disc_at(uniform(-0.28, 0.28), uniform(-0.27, 0.27), static_cast<std::uint8_t>(discs.size()));
      const bool free = std::all_of(discs.begin(), discs.end(), [&](const auto& d) { return (d.p_WD - disc.p_WD).norm() > 0.061; });
      if (free) discs.push_back(disc);
    }
    return discs;
  }
  // The arm somewhere over the discs, as in a stroke or on the way to one; nothing when it cannot get there.
  std::optional<std::vector<Pose>> arm_over_the_table() {
    Pose X_WT{Pose::Identity()};
    X_WT.translation() << uniform(-0.3, 0.3), uniform(-0.3, 0.3), uniform(0.03, 0.15);
    X_WT.linear() = (Eigen::AngleAxisd{uniform(-3.0, 3.0), Vector3::UnitZ()} * Eigen::AngleAxisd{std::numbers::pi, Vector3::UnitX()})
                        .toRotationMatrix();
    const auto solutions = kinematics::InverseKinematics{studio_->kinematics}.solve(X_WT, studio_->cell.arm.park);
    if (solutions.empty()) return std::nullopt;
    return links(*solutions.begin());
  }

  static std::unique_ptr<Studio> studio_;
  std::uint64_t frame_ = 0;
  std::mt19937 random_{9};
};

std::unique_ptr<Studio> Rendered::studio_;

const DiscState& truth_of(const SceneDisc& found, const std::vector<DiscState>& truth) {
  return *std::min_element(truth.begin(), truth.end(),
                           [&](const auto& a, const auto& b) { return (a.p_WD - found.p_WD).norm() < (b.p_WD - found.p_WD).norm(); });
}

// Whether the camera sees any of a disc's top face: by the depth there, which the arm is well above of.
bool in_view(const DiscState& disc, const support::RenderedScene& picture) {
  for (int ring = 0; ring <= 8; ++ring) {
    for (int k = 0; k < 48; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / 48.0;
      const Vector2 p = disc.p_WD + disc.radius * ring / 8.0 * Vector2{std::cos(angle), std::sin(angle)};
      const auto pixel = picture.camera.project({p.x(), p.y(), kDiscHeight});
      const auto x = std::lround(pixel->x()), y = std::lround(pixel->y());
      if (x < 0 || y < 0 || x >= picture.camera.width || y >= picture.camera.height) continue;
      const double range = 1e-4 * picture.depth.depth[static_cast<std::size_t>(y * picture.camera.width + x)];
      if (range > picture.camera.X_WC.translation().z() - kDiscHeight - 0.015) return true;
    }
  }
  return false;
}

// How soon rest can be told hangs on how far places jump from frame to frame.
TEST_F(Rendered, DiscsAtRestHardlyJumpFromFrameToFrameSoTwoFramesTellTheirRest) {
  const auto parked = links(studio_->cell.arm.park);
  double squares = 0.0;
  int jumps = 0;
  for (int table = 0; table < 8; ++table) {
    Perceiver eyes = perceiver();
    const auto discs = spread(8);
    std::vector<Vector2> before;
    for (int frame = 0; frame < 3; ++frame) {
      const auto picture = take(discs, parked);
      const Scene scene = eyes.process(picture.color, &picture.depth, parked);
      ASSERT_EQ(scene.discs.size(), discs.size());
      for (std::size_t i = 0; i < before.size(); ++i) {
        squares += (scene.discs[i].p_WD - before[i]).squaredNorm();
        ++jumps;
      }
      before.clear();
      for (const auto& disc : scene.discs) before.push_back(disc.p_WD);
      EXPECT_EQ(scene.at_rest, frame > 0) << "frame " << frame;
    }
  }
  const double per_axis = std::sqrt(squares / jumps / 4.0);
  std::printf("  a place varies by %.1f um per axis from frame to frame\n", 1e6 * per_axis);
  EXPECT_LT(per_axis, 8e-6);
}

TEST_F(Rendered, EveryFormationIsSeenAsItLies) {
  Perceiver eyes = perceiver();
  const auto parked = links(studio_->cell.arm.park);
  for (const std::string& name : formation_names(studio_->cell)) {
    const Formation formation = load_formation(name, studio_->cell);
    std::vector<DiscState> discs;
    for (const auto& d : formation.discs) discs.push_back(support::disc_at(d.p_WD.x(), d.p_WD.y(), d.colour, d.radius));
    const auto picture = take(discs, parked);
    const Scene scene = eyes.process(picture.color, &picture.depth, parked);
    ASSERT_EQ(scene.discs.size(), discs.size()) << name;
    EXPECT_TRUE(scene.foreign.empty()) << name << ": " << describe(scene.foreign.front());
    std::size_t touching = 0;
    for (const auto& disc : scene.discs) {
      const DiscState& truth = truth_of(disc, discs);
      EXPECT_EQ(disc.colour, truth.colour) << name;
      EXPECT_LT((disc.p_WD - truth.p_WD).norm(), 0.15e-3) << name;
      EXPECT_NEAR(disc.radius, truth.radius, 0.15e-3) << name;
      EXPECT_TRUE(disc.complete) << name;
    }
    for (std::size_t i = 0; i < discs.size(); ++i) {
      for (std::size_t j = i + 1; j < discs.size(); ++j) {
        touching += (discs[i].p_WD - discs[j].p_WD).norm() - discs[i].radius - discs[j].radius < 0.1e-3 ? 1 : 0;
      }
    }
    const auto seen = std::count_if(scene.contacts.begin(), scene.contacts.end(), [](const SceneContact& c) { return c.p_touch > 0.5; });
    EXPECT_EQ(static_cast<std::size_t>(seen), touching) << name;
  }
}

// The arm works anywhere over the discs. What it leaves of them in view is measured or left out, and no part of it becomes a disc: known from
// its joints, or from depth when no joint states came, or from neither.
TEST_F(Rendered, TheArmHidesDiscsButBendsNone) {
  enum Knowledge { kJoints, kDepth, kNothing, kKnowledges };
  struct Tally {
    int reported = 0, partial = 0, invented = 0, wrong_colour = 0, resurrected = 0;
    double worst = 0.0, nees = 0.0, nees_partial = 0.0;
  };
  std::array<Tally, kKnowledges> tallies;
  std::array<Perceiver, kKnowledges> eyes{perceiver(), perceiver(), perceiver()};  // each takes a picture seen before for a frozen camera
  Perceiver eyes_of_both = perceiver();
  int in_sight = 0, out_of_sight = 0;
  for (int i = 0; i < 40; ++i) {
    const auto discs = spread(8);
    const auto X_WL = arm_over_the_table();
    if (!X_WL) continue;
    const auto picture = take(discs, *X_WL);
    for (const auto& disc : discs) ++(in_view(disc, picture) ? in_sight : out_of_sight);
    for (int known = kJoints; known < kKnowledges; ++known) {
      Tally& tally = tallies[static_cast<std::size_t>(known)];
      // Not asked of kJoints alone: with depth there are heights to misread, too.
      const auto scene_with_both = known == kNothing ? eyes_of_both.process(picture.color, &picture.depth, *X_WL) : Scene{};
      EXPECT_TRUE(scene_with_both.foreign.empty()) << describe(scene_with_both.foreign.front());
      const Scene scene =
          eyes[static_cast<std::size_t>(known)].process(picture.color, known == kDepth ? &picture.depth : nullptr,
                                                        known == kJoints ? std::span<const Pose>{*X_WL} : std::span<const Pose>{});
      for (const auto& disc : scene.discs) {
        const DiscState& truth = truth_of(disc, discs);
        const Vector2 error = disc.p_WD - truth.p_WD;
        if (error.norm() > 5e-3) {
          ++tally.invented;
          continue;
        }
        ++tally.reported;
        tally.wrong_colour += disc.colour == truth.colour ? 0 : 1;
        tally.resurrected += in_view(truth, picture) ? 0 : 1;
        tally.worst = std::max(tally.worst, error.norm());
        const double nees = error.dot(disc.covariance.inverse() * error);
        tally.nees += nees;
        if (!disc.complete) {
          ++tally.partial;
          tally.nees_partial += nees;
        }
      }
    }
  }
  EXPECT_GT(out_of_sight, 5);
  for (int known = kJoints; known < kKnowledges; ++known) {
    const Tally& tally = tallies[static_cast<std::size_t>(known)];
    const char* name = known == kJoints ? "joints" : known == kDepth ? "depth" : "nothing";
    std::printf("  %s: %d of %d in sight reported, %d of them partial; worst %.3f mm, NEES %.2f, of partial ones %.2f (2 is right)\n", name,
                tally.reported, in_sight, tally.partial, 1e3 * tally.worst, tally.nees / tally.reported,
                tally.nees_partial / tally.partial);
    EXPECT_EQ(tally.invented, 0) << name;
    EXPECT_EQ(tally.wrong_colour, 0) << name;
    EXPECT_EQ(tally.resurrected, 0) << name;
    EXPECT_GT(tally.reported, 0.9 * in_sight) << name;
    EXPECT_GT(tally.partial, 20) << name;
    EXPECT_LT(tally.worst, 0.4e-3) << name;
    EXPECT_LT(tally.nees / tally.reported, 3.0) << name;
    EXPECT_LT(tally.nees_partial / tally.partial, 4.0) << name;
  }
}

// The image is 0.62 m high on the table: a disc whose centre is near the workspace's edge in y is seen in part. It is measured all the same,
// and says that less of it was seen.
TEST_F(Rendered, DiscsThatTheBorderCutsAreMeasuredWithLargerCovariance) {
  const auto parked = links(studio_->cell.arm.park);
  Perceiver eyes = perceiver();
  double nees = 0.0, radius_nees = 0.0, worst = 0.0, worst_radius = 0.0, least_sigma = 1.0, whole_sigma = 0.0;
  int cut = 0;
  for (int i = 0; i < 8; ++i) {
    std::vector<DiscState> discs{support::disc_at(0.0, 0.0, 7)};
    for (std::uint8_t k = 0; k < 7; ++k) {
      discs.push_back(support::disc_at(-0.27 + 0.09 * k, (k % 2 == 0 ? 1.0 : -1.0) * uniform(0.285, 0.30), k));
    }
    const auto picture = take(discs, parked);
    const Scene scene = eyes.process(picture.color, &picture.depth, parked);
    ASSERT_EQ(scene.discs.size(), discs.size());
    for (const auto& disc : scene.discs) {
      const DiscState& truth = truth_of(disc, discs);
      EXPECT_EQ(disc.colour, truth.colour);
      const Vector2 error = disc.p_WD - truth.p_WD;
      const double sigma = std::sqrt(disc.covariance.trace());
      if (disc.complete) {
        whole_sigma = std::max(whole_sigma, sigma);
        continue;
      }
      ++cut;
      least_sigma = std::min(least_sigma, sigma);
      worst = std::max(worst, error.norm());
      worst_radius = std::max(worst_radius, std::abs(disc.radius - truth.radius));
      nees += error.dot(disc.covariance.inverse() * error);
      radius_nees += std::pow((disc.radius - truth.radius) / disc.radius_sigma, 2);
    }
  }
  std::printf(
      "  %d cut discs: worst %.3f mm, radius %.3f mm, NEES %.2f (2 is right), of radii %.2f (1 is right); least sigma %.3f mm, whole %.3f "
      "mm\n",
      cut, 1e3 * worst, 1e3 * worst_radius, nees / cut, radius_nees / cut, 1e3 * least_sigma, 1e3 * whole_sigma);
  EXPECT_EQ(cut, 56);
  EXPECT_LT(worst, 0.4e-3);
  EXPECT_LT(worst_radius, 0.4e-3);
  EXPECT_LT(nees / cut, 3.5);
  EXPECT_LT(radius_nees / cut, 2.5);
  EXPECT_GT(least_sigma, 1.1 * whole_sigma);
}

// From a third of the light to twice, from 2700 K to 10000 K: the table says what light it is.
TEST_F(Rendered, LightOfAnyStrengthAndColourChangesNothing) {
  const auto parked = links(studio_->cell.arm.park);
  using Lamp = std::array<double, 3>;
  const std::pair<double, Lamp> lights[] = {{0.3, {1.0, 1.0, 1.0}},     {2.0, {1.0, 1.0, 1.0}},     {1.0, {1.0, 0.405, 0.094}},
                                            {0.3, {1.0, 0.405, 0.094}}, {2.0, {1.0, 0.405, 0.094}}, {1.0, {1.0, 0.626, 0.389}},
                                            {0.5, {0.72, 0.80, 1.0}}};
  for (const auto& [brightness, lamp] : lights) {
    sim_bridge::Exposure exposure;
    exposure.brightness = brightness;
    exposure.white_balance = lamp;
    studio_->renderer.set_exposure(exposure);
    SCOPED_TRACE(std::to_string(brightness) + " of the light, blue " + std::to_string(lamp[2]));
    std::vector<DiscState> discs;
    for (std::uint8_t k = 0; k < 8; ++k) discs.push_back(support::disc_at(-0.24 + 0.068 * k, 0.2 * std::sin(2.0 * k), k));
    const auto picture = take(discs, parked);
    const Scene scene = perceiver().process(picture.color, &picture.depth, parked);
    EXPECT_EQ(scene.discs.size(), discs.size());
    EXPECT_TRUE(scene.foreign.empty());
    for (const auto& disc : scene.discs) {
      EXPECT_EQ(disc.colour, truth_of(disc, discs).colour);
      EXPECT_LT((disc.p_WD - truth_of(disc, discs).p_WD).norm(), 0.2e-3);
    }
  }
  studio_->renderer.set_exposure({});
}

}  // namespace
}  // namespace breakshot::perception
