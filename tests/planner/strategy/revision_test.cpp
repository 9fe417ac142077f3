#include "planner/strategy/revision.hpp"

#include "tests/planner/decision_scene.hpp"

#include <gtest/gtest.h>

namespace breakshot::strategy {
namespace {

// Decisions that are corrected for a scene that settled a little elsewhere, and decisions that nobody waits for any more.

using test::decision_context;

Scene scene_of(const std::vector<world::Disc>& discs) { return test::scene_of(discs, 5e-5); }

/// An arm that can run every stroke, and counts how often it is asked.
class Willing final : public StrokeFilter {
 public:
  Result<StrokeForecast, StrokeRefusal> forecast(const StrokeRequest&) override {
    ++asked;
    if (gives_up != nullptr) gives_up->request_stop();
    return StrokeForecast{};
  }
  int asked = 0;
  std::stop_source* gives_up = nullptr;
};

class Revision : public testing::TestWithParam<const char*> {};

TEST_P(Revision, MovesTheStrokeWithTheDisc) {
  for (const char* name : {"B", "E", "fig11"}) {
    const auto strategy = make_strategy(GetParam(), {});
    auto ctx = decision_context();
    ctx.seed = 5;
    Scene scene = scene_of(test::formation(name));
    const Decision before = strategy->decide(scene, ctx);
    ASSERT_EQ(before.kind, Decision::Kind::kStroke) << name;
    const Vector2 moved{4e-4, -3e-4};
    for (auto& disc : scene.discs) disc.p_WD += moved;
    const Decision after = strategy->revise(scene, ctx, before.options);
    ASSERT_EQ(after.kind, Decision::Kind::kStroke) << name;
    EXPECT_TRUE(is_near_any(after.options[0].stroke, before.options)) << name << ": " << after.options[0].why;
    EXPECT_EQ(after.options[0].predicted_p_WD.size(), scene.discs.size());
    // All moved alike, so what was best is best, and moves with them.
    EXPECT_NEAR((after.options[0].stroke.p_WS - before.options[0].stroke.p_WS - moved).norm(), 0.0, 1e-6)
        << name << ": " << after.options[0].why;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Revision, testing::Values("paper", "random_hybrid", "random_push"),
                         [](const auto& test) { return std::string{test.param}; });

TEST(RobustRevision, IsNearlyAsGoodAsAFreshDecision) {
  const auto robust = make_strategy("robust", {});
  std::mt19937_64 random{11};
  double fresh_cost = 0.0, revised_cost = 0.0;
  for (int i = 0; i < 6; ++i) {
    auto ctx = decision_context();
    ctx.seed = random();
    Scene scene = scene_of(test::random_cluster(random, 6, 5e-4));
    const Decision before = robust->decide(scene, ctx);
    ASSERT_EQ(before.kind, Decision::Kind::kStroke);
    std::normal_distribution noise{0.0, 3e-4};
    for (auto& disc : scene.discs) disc.p_WD += Vector2{noise(random), noise(random)};
    const Decision fresh = robust->decide(scene, ctx);
    const Decision revised = robust->revise(scene, ctx, before.options);
    ASSERT_EQ(revised.kind, Decision::Kind::kStroke);
    EXPECT_TRUE(is_near_any(revised.options[0].stroke, before.options)) << revised.options[0].why;
    fresh_cost += fresh.options[0].cost_s;
    revised_cost += revised.options[0].cost_s;
  }
  EXPECT_LT(revised_cost, 1.15 * fresh_cost);
}

TEST(RobustRevision, FindsNothingWhereNothingOfTheEarlierDecisionIsLeft) {
  const auto robust = make_strategy("robust", {});
  const Decision before = robust->decide(scene_of(test::formation("E")), decision_context());
  auto elsewhere = test::formation("E");
  for (auto& disc : elsewhere) disc.p_WD += Vector2{0.15, -0.10};
  EXPECT_EQ(robust->revise(scene_of(elsewhere), decision_context(), before.options).kind, Decision::Kind::kNoStroke);
}

TEST(RobustDecision, EndsAtOnceWhenNobodyWaitsForItAnyMore) {
  const auto robust = make_strategy("robust", {});
  const Scene scene = scene_of(test::rack(5));
  auto ctx = decision_context();
  std::stop_source gives_up;
  ctx.stop = gives_up.get_token();
  Willing arm;
  ctx.filter = &arm;
  arm.gives_up = &gives_up;
  EXPECT_EQ(robust->decide(scene, ctx).kind, Decision::Kind::kNoStroke);
  EXPECT_EQ(arm.asked, 1) << "given up at the arm's first answer";
  EXPECT_EQ(robust->decide(scene, ctx).kind, Decision::Kind::kNoStroke);
  EXPECT_EQ(arm.asked, 1) << "and before any, when it was given up before it began";
  arm.gives_up = nullptr;
  ctx.stop = {};
  EXPECT_EQ(robust->decide(scene, ctx).kind, Decision::Kind::kStroke) << "the next one is as good as ever";
}

}  // namespace
}  // namespace breakshot::strategy
