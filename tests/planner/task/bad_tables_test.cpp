#include "planner/task/crowd.hpp"
#include "tests/planner/task/task_cell.hpp"

#include <gtest/gtest.h>

#include <cstdio>

// Tables that are not the six discs in the middle which everybody thinks of: what comes of them, and what is said.

namespace breakshot::task {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::disc_at;
using test::TaskCell;

/// Runs an order to its end. @return its last status
TaskStatus end_of(TaskCell& cell, const TaskRequest& order = TaskCell::order()) {
  cell.runner.on_request(order, cell.now);
  EXPECT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.early_strokes, 0);
  return cell.runner.status();
}
bool says(const TaskStatus& status, const char* words) { return status.text.find(words) != std::string::npos; }
std::uint32_t strokes(const TaskStatus& status) { return status.hits + status.pushes; }

class EveryStrategysTable : public testing::TestWithParam<const char*> {};

TEST_P(EveryStrategysTable, WithNoDiscIsRefused) {
  TaskCell cell{{}, GetParam()};
  const TaskStatus status = end_of(cell);
  EXPECT_EQ(status.failure, TaskFailure::kWrongDiscCount);
  EXPECT_EQ(status.text, "no disc on the table");
}

TEST_P(EveryStrategysTable, WithOneDiscIsDoneWithoutAStroke) {
  TaskCell cell{{disc_at(0.1, 0.0)}, GetParam()};
  const TaskStatus status = end_of(cell);
  EXPECT_EQ(status.phase, TaskPhase::kSingulated);
  EXPECT_EQ(status.text, "singulated: one disc alone");
  EXPECT_EQ(strokes(status), 0U);
  EXPECT_TRUE(cell.questions.empty());
}

TEST_P(EveryStrategysTable, WithDiscsApartIsDoneWithoutAStroke) {
  TaskCell cell{{disc_at(0.0, 0.0), disc_at(0.1, 0.0), disc_at(0.0, -0.2)}, GetParam()};
  const TaskStatus status = end_of(cell);
  EXPECT_EQ(status.phase, TaskPhase::kSingulated);
  EXPECT_TRUE(says(status, "singulated: smallest gap 39.") || says(status, "singulated: smallest gap 40.")) << status.text;
  EXPECT_EQ(strokes(status), 0U);
  EXPECT_TRUE(cell.questions.empty());
}

TEST_P(EveryStrategysTable, WithTwoClustersIsSingulated) {
  auto discs = test::rack(2);
  for (auto& disc : discs) disc.p_WD.x() -= 0.12;
  for (auto disc : test::rack(2)) {
    disc.p_WD += Vector2{0.12, 0.05};
    discs.push_back(disc);
  }
  TaskCell cell{discs, GetParam()};
  const TaskStatus status = end_of(cell);
  EXPECT_EQ(status.phase, TaskPhase::kSingulated) << status.text;
  EXPECT_EQ(status.discs_singulated, 6U);
}

TEST_P(EveryStrategysTable, WithAnOverlapThatCannotBeIsRefused) {
  TaskCell cell{{disc_at(0.0, 0.0), disc_at(0.04, 0.0)}, GetParam()};
  const TaskStatus status = end_of(cell);
  EXPECT_EQ(status.failure, TaskFailure::kNoFeasibleStroke);
  EXPECT_TRUE(says(status, "the scene cannot be: ")) << status.text;
  EXPECT_EQ(strokes(status), 0U);
}

INSTANTIATE_TEST_SUITE_P(All, EveryStrategysTable, testing::Values("paper", "random_hybrid", "random_push", "robust"),
                         [](const auto& test) { return std::string{test.param}; });

TEST(BadTable, APairAtTheEdgeOrInACornerIsPartedInwards) {
  for (const auto& [a, b] :
       {std::pair{Vector2{0.29, 0.0}, Vector2{0.29, 0.061}}, std::pair{Vector2{0.295, 0.0}, Vector2{0.234, 0.0}},
        std::pair{Vector2{0.29, 0.29}, Vector2{0.29, 0.229}}, std::pair{Vector2{-0.29, -0.29}, Vector2{-0.247, -0.247}}}) {
    TaskCell cell{{disc_at(a.x(), a.y()), disc_at(b.x(), b.y()), disc_at(0.0, 0.1)}, "robust"};
    const TaskStatus status = end_of(cell);
    EXPECT_EQ(status.phase, TaskPhase::kSingulated) << a.transpose() << ": " << status.text;
    EXPECT_EQ(cell.table.outside(TaskCell::order().region), 0) << a.transpose();
  }
}

/// An arm that reaches so far from its base.
class ShortArm final : public strategy::StrokeFilter {
 public:
  Result<strategy::StrokeForecast, strategy::StrokeRefusal> forecast(const StrokeRequest& stroke) override {
    if ((stroke.p_WS - strategy::CellKnowledge{}.p_WB).norm() < 0.6) return strategy::StrokeForecast{};
    char text[80];
    std::snprintf(text, sizeof text, "no joint positions put the striker at (%.3f, %.3f) m", stroke.p_WS.x(), stroke.p_WS.y());
    return strategy::StrokeRefusal{RefusalReason::kUnreachable, text};
  }
};

TEST(BadTable, APairOutOfReachIsNamedAfterTheOthersHaveBeenParted) {
  for (const char* strategy : {"paper", "robust"}) {
    TaskCell cell{{disc_at(-0.1, 0.0), disc_at(-0.039, 0.0), disc_at(0.25, 0.1), disc_at(0.25, 0.161)}, strategy};
    ShortArm arm;
    cell.arm = &arm;
    const TaskStatus status = end_of(cell);
    EXPECT_EQ(status.failure, TaskFailure::kNoFeasibleStroke) << strategy;
    EXPECT_TRUE(says(status, "no joint positions put the striker at (0.2")) << strategy << ": " << status.text;
    EXPECT_EQ(status.discs_singulated, 2U) << strategy;
    EXPECT_GE(strokes(status), 1U) << strategy;
  }
}

TEST(BadTable, ADiscOutsideAndOutOfReachIsLost) {
  TaskCell cell{{disc_at(0.0, 0.0), disc_at(0.1, 0.0), disc_at(0.35, 0.0)}, "robust"};
  ShortArm arm;
  cell.arm = &arm;
  const TaskStatus status = end_of(cell);
  EXPECT_EQ(status.failure, TaskFailure::kDiscLost);
  EXPECT_EQ(status.discs_lost, 1U);
  EXPECT_TRUE(says(status, "disc 3 at (0.35") || says(status, "disc 3 at (0.34")) << status.text;
  EXPECT_TRUE(says(status, "no joint positions")) << status.text;
}

TEST(BadTable, FitsNoMoreDiscsThanGeometryAllows) {
  const Rect region{{-0.3, -0.3}, {0.3, 0.3}};
  // In a square of side a, hexagonal rows of discs d apart: 7 x 9 of them, or fewer, for a = 8 d. The bound is above what fits, and not far.
  const std::uint32_t most = most_that_fit(region, 0.030, 0.015);
  EXPECT_GE(most, 85U);
  EXPECT_LE(most, 95U);
  EXPECT_EQ(most_that_fit({{0.0, 0.0}, {0.0, 0.0}}, 0.030, 0.015), 1U);
  EXPECT_EQ(most_that_fit({{0.0, 0.0}, {0.15, 0.0}}, 0.030, 0.015), 3U) << "a line of two pitches holds three";
}

TEST(BadTable, WithMoreDiscsThanFitIsSaidAndTheBestSubsetIsSetApart) {
  auto order = TaskCell::order();
  order.min_gap = 0.100;
  order.region = {{-0.15, -0.15}, {0.15, 0.15}};
  auto discs = test::rack(4);
  for (auto& disc : discs) disc.p_WD.y() -= 0.08;
  TaskCell cell{discs, "robust"};
  const Spacing before = spacing_of(cell.table.scene(), order.min_gap);
  const TaskStatus status = end_of(cell, order);
  EXPECT_EQ(status.failure, TaskFailure::kNoFeasibleStroke) << status.text;
  EXPECT_TRUE(says(status, "10 discs, of which at most 8 fit the region with gaps of 100.0 mm")) << status.text;
  EXPECT_TRUE(says(status, "stand apart")) << status.text;
  EXPECT_GE(strokes(status), 1U);
  EXPECT_TRUE(spacing_of(cell.table.scene(), order.min_gap).better_than(before)) << status.text;
}

// In lockstep the cell clock may pass settle_limit long before a camera has been out of use for as long as others are given by their clocks.
TEST(BadTable, BehindACameraThatIsOutOfUseIsNotCalledRestless) {
  const TaskSettings settings;
  SceneWatch watch{settings};
  const Time start{};
  watch.start(start);
  EXPECT_FALSE(watch.restless(start + 2 * settings.settle_limit)) << "nothing came: nobody saw anything move";
  Scene scene;
  scene.exposed = start + milliseconds{33};
  scene.max_speed = 0.05;
  scene.discs.resize(1);
  EXPECT_EQ(watch.on_scene(scene), SceneWatch::Verdict::kMoving);
  EXPECT_TRUE(watch.restless(start + 2 * settings.settle_limit));
  scene.exposed += milliseconds{33};
  scene.quality = SceneQuality::kMisplaced;
  EXPECT_EQ(watch.on_scene(scene), SceneWatch::Verdict::kUnusable);
  EXPECT_FALSE(watch.restless(start + 2 * settings.settle_limit));
  EXPECT_FALSE(watch.trouble().empty());
}

TEST(BadTable, ThatNeverSettlesIsGivenUpWithWhatMoves) {
  TaskCell cell{test::formation("C"), "robust"};
  cell.noise_speed = 0.05;
  const TaskStatus status = end_of(cell);
  EXPECT_EQ(status.failure, TaskFailure::kNoScene);
  EXPECT_TRUE(says(status, "the discs do not come to rest: disc 1 at (")) << status.text;
  EXPECT_TRUE(says(status, "moves at 0.050 m/s")) << status.text;
  EXPECT_EQ(strokes(status), 0U);
}

TEST(BadTable, ThatContradictsWhatIsBeingDecidedOnIsLookedAtAgain) {
  TaskCell cell{{disc_at(0.0, 0.0), disc_at(0.061, 0.0)}, "paper"};
  cell.think = seconds{1};
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_until(TaskPhase::kDeciding));
  const auto ticket = cell.questions.back().ticket;
  cell.shift(0, {-0.006, -0.01});
  cell.play_for(milliseconds{100});
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kLooking);
  EXPECT_TRUE(says(cell.runner.status(), "looks again: a disc moved by ")) << cell.runner.status().text;
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated) << cell.runner.status().text;
  EXPECT_GT(cell.questions.at(1).ticket, ticket);
  EXPECT_EQ(cell.early_strokes, 0);
}

TEST(BadTable, WithADiscThatIsPutThereWhileAStrokeIsBeingChosenIsLookedAtAgain) {
  auto discs = test::formation("C");
  discs.push_back(disc_at(0.2, 0.2));
  TaskCell cell{discs, "paper"};
  cell.think = seconds{1};
  cell.hidden = discs.size() - 1;
  cell.runner.on_request(TaskCell::order(), cell.now);
  ASSERT_TRUE(cell.play_until(TaskPhase::kDeciding));
  cell.hidden.reset();
  cell.play_for(milliseconds{100});
  EXPECT_EQ(cell.runner.status().text, "looks again: 5 discs instead of 4");
  ASSERT_TRUE(cell.play_to_end());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated) << cell.runner.status().text;
  EXPECT_EQ(cell.runner.status().discs_seen, 5U);
}

}  // namespace
}  // namespace breakshot::task
