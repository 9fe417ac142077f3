#include "planner/strategy/strategy.hpp"

#include "planner/strategy/sampled_worlds.hpp"
#include "planner/strategy/stroke_room.hpp"
#include "planner/strategy/strokes.hpp"
#include "planner/strategy/table_model.hpp"
#include "tests/planner/decision_scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <stdexcept>

namespace breakshot::strategy {
namespace {

using test::decision_context;
using test::scene_of;

TEST(Strategy, IsFoundByNameOrRefused) {
  for (const auto& name : strategy_names()) EXPECT_EQ(make_strategy(name, {})->name(), name);
  EXPECT_THROW(make_strategy("clairvoyant", {}), std::invalid_argument);
}

/// Properties that every offered stroke has, whatever the strategy and the table.
class EveryStrategy : public testing::TestWithParam<const char*> {};

TEST_P(EveryStrategy, OffersOnlyStrokesThatHaveRoom) {
  StrategySettings settings;
  settings.robust.rollouts = 1000;
  settings.robust.worlds = 8;
  const auto strategy = make_strategy(GetParam(), settings);
  std::mt19937_64 random{3};
  const int cases = GetParam() == std::string{"robust"} ? 50 : 200;  // it takes some ten milliseconds for each
  for (int i = 0; i < cases; ++i) {
    auto discs = test::random_cluster(random, 2 + i % 9, i % 2 == 0 ? 5e-4 : 1e-2, 0.025, 0.035);
    const Vector2 shift{std::uniform_real_distribution{-0.12, 0.12}(random), std::uniform_real_distribution{-0.12, 0.12}(random)};
    for (auto& disc : discs) disc.p_WD += shift;
    auto ctx = decision_context();
    ctx.seed = random();
    ctx.speed_scale = 0.7;
    ctx.hits_left = i % 3 == 0 ? 0 : 3;
    const Decision decision = strategy->decide(scene_of(discs), ctx);
    if (decision.kind != Decision::Kind::kStroke) continue;
    EXPECT_LE(decision.options.size(), 6U);
    for (const auto& option : decision.options) {
      const StrokeRequest& stroke = option.stroke;
      EXPECT_NEAR(stroke.direction_W.norm(), 1.0, 1e-9);
      EXPECT_TRUE(stroke.park_after);
      EXPECT_EQ(option.predicted_p_WD.size(), discs.size());
      for (const auto& p : option.predicted_p_WD) EXPECT_TRUE(ctx.region.contains(p));
      EXPECT_FALSE(option.why.empty());
      const bool hit = stroke.kind == StrokeKind::kHit;
      const Vector2 begin =
          hit ? Vector2{stroke.p_WS - std::max(stroke.run_in, settings.cell.hit_fall * stroke.speed) * stroke.direction_W} : stroke.p_WS;
      const Vector2 end = hit ? stroke.p_WS : Vector2{stroke.p_WS + stroke.length * stroke.direction_W};
      EXPECT_TRUE(settings.cell.striker_area.contains(begin) && settings.cell.striker_area.contains(end));
      for (const auto& disc : discs) {
        const double distance = hit ? distance_to_segment(disc.p_WD, begin, end) : (disc.p_WD - begin).norm();
        EXPECT_GT(distance - disc.radius - settings.cell.striker_radius, hit ? -1e-6 : 0.002) << option.why;
      }
      if (hit) {
        EXPECT_GT(ctx.hits_left, 0U);
        EXPECT_LE(stroke.speed, 0.7 * settings.rules.hit_speed_max + 1e-9);
      }
    }
  }
}

TEST_P(EveryStrategy, DecidesTheSameAgain) {
  const auto first = make_strategy(GetParam(), {});
  const auto second = make_strategy(GetParam(), {});
  auto ctx = decision_context();
  ctx.seed = 99;
  const Scene scene = scene_of(test::formation("F"));
  first->decide(scene_of(test::formation("D")), ctx);  // nothing is remembered from other scenes
  const Decision a = first->decide(scene, ctx);
  const Decision b = second->decide(scene, ctx);
  ASSERT_EQ(a.options.size(), b.options.size());
  for (std::size_t k = 0; k < a.options.size(); ++k) {
    EXPECT_EQ(a.options[k].stroke.p_WS, b.options[k].stroke.p_WS);
    EXPECT_EQ(a.options[k].stroke.speed, b.options[k].stroke.speed);
    EXPECT_EQ(a.options[k].why, b.options[k].why);
  }
}

TEST_P(EveryStrategy, KnowsWhenThereIsNothingToDoOrNothingToDoItWith) {
  const auto strategy = make_strategy(GetParam(), {});
  EXPECT_EQ(strategy->decide(scene_of({}), decision_context()).kind, Decision::Kind::kSingulated);
  EXPECT_EQ(strategy->decide(scene_of({test::disc_at(0, 0)}), decision_context()).kind, Decision::Kind::kSingulated);
  EXPECT_EQ(strategy->decide(scene_of({test::disc_at(0, 0), test::disc_at(0.076, 0)}), decision_context()).kind,
            Decision::Kind::kSingulated);
  EXPECT_EQ(strategy->decide(scene_of({test::disc_at(0, 0), test::disc_at(0.074, 0)}), decision_context()).kind, Decision::Kind::kStroke);
  auto none = decision_context();
  none.pushes_left = 0;
  none.hits_left = 0;
  const Decision decision = strategy->decide(scene_of(test::formation("E")), none);
  EXPECT_EQ(decision.kind, Decision::Kind::kNoStroke);
  EXPECT_FALSE(decision.why.empty());
}

TEST_P(EveryStrategy, SaysThatAnOverlapCannotBe) {
  const auto strategy = make_strategy(GetParam(), {});
  const Decision decision = strategy->decide(scene_of({test::disc_at(0, 0), test::disc_at(0.04, 0)}), decision_context());
  EXPECT_EQ(decision.kind, Decision::Kind::kNoStroke);
  EXPECT_NE(decision.why.find("overlap by 20.000 mm"), std::string::npos) << decision.why;
}

/// Refuses the first so many strokes that it is asked about.
class Refusing final : public StrokeFilter {
 public:
  explicit Refusing(int refusals) : left_{refusals} {}
  Result<StrokeForecast, StrokeRefusal> forecast(const StrokeRequest&) override {
    ++asked;
    if (left_-- > 0) return StrokeRefusal{RefusalReason::kUnreachable, "out of reach"};
    return StrokeForecast{};
  }
  int asked = 0;

 private:
  int left_;
};

TEST_P(EveryStrategy, TakesTheNextBestWhenTheArmCannotAndSaysWhy) {
  const auto strategy = make_strategy(GetParam(), {});
  auto ctx = decision_context();
  const Scene scene = scene_of(test::formation("A"));
  const Decision free = strategy->decide(scene, ctx);
  Refusing one{1};
  ctx.filter = &one;
  const Decision second = strategy->decide(scene, ctx);
  ASSERT_FALSE(second.options.empty());
  EXPECT_EQ(second.options[0].stroke.p_WS, free.options[1].stroke.p_WS);
  EXPECT_LE(one.asked, 5) << "asking takes the arm's planner a while";
  EXPECT_NE(second.options[0].why.find("out of reach"), std::string::npos) << second.options[0].why;
  Refusing all{1000};
  ctx.filter = &all;
  EXPECT_EQ(strategy->decide(scene, ctx).kind, Decision::Kind::kNoStroke);
}

INSTANTIATE_TEST_SUITE_P(All, EveryStrategy, testing::Values("paper", "random_hybrid", "random_push", "robust"),
                         [](const auto& test) { return std::string{test.param}; });

TEST(Paper, PushesAlongTheTangentFromTheArmsSide) {
  const auto paper = make_strategy("paper", {});
  const Decision decision = paper->decide(scene_of(test::formation("A")), decision_context());
  ASSERT_EQ(decision.kind, Decision::Kind::kStroke);
  const StrokeRequest& stroke = decision.options[0].stroke;
  EXPECT_EQ(stroke.kind, StrokeKind::kPush);
  EXPECT_NEAR(stroke.direction_W.x(), 1.0, 1e-6);  // A stands across the arm's view: the tangent leads away from the arm
  EXPECT_NEAR(stroke.p_WS.y(), 0.0, 1e-6);
  EXPECT_LT(stroke.p_WS.x(), -0.0264);  // off the two discs
  EXPECT_NEAR(decision.options[0].predicted_gap, 0.020, 2e-4);
  EXPECT_LT(decision.options[1].stroke.direction_W.x(), -0.99);  // the far side is the next best
}

TEST(Paper, HitsTheNearestDiscBetweenItsTwoNeighbours) {
  const auto paper = make_strategy("paper", {});
  for (const char* name : {"E", "fig11"}) {
    const Decision decision = paper->decide(scene_of(test::formation(name)), decision_context());
    ASSERT_EQ(decision.kind, Decision::Kind::kStroke);
    const StrokeRequest& stroke = decision.options[0].stroke;
    EXPECT_EQ(stroke.kind, StrokeKind::kHit) << name;
    EXPECT_NEAR(stroke.direction_W.x(), 1.0, 1e-5) << name;
    EXPECT_NEAR(stroke.p_WS.y(), 0.0, 1e-6) << name;
    EXPECT_NE(decision.options[0].why.find("disc 1 between 2 and 3 (simultaneous impact)"), std::string::npos) << decision.options[0].why;
  }
}

TEST(Paper, RaisesTheSpeedOnlyAsFarAsTheArmAttains) {
  const auto paper = make_strategy("paper", {});
  auto ctx = decision_context();
  ctx.hit_speed_cap = 0.45;
  const Decision decision = paper->decide(scene_of(test::formation("E")), ctx);
  ASSERT_EQ(decision.options[0].stroke.kind, StrokeKind::kHit);
  EXPECT_LE(decision.options[0].stroke.speed, 0.45);
  ctx.hit_speed_cap = 0.1;
  EXPECT_EQ(paper->decide(scene_of(test::formation("E")), ctx).options[0].stroke.kind, StrokeKind::kPush);
}

/// An arm that attains only so much.
class Slow final : public StrokeFilter {
 public:
  Result<StrokeForecast, StrokeRefusal> forecast(const StrokeRequest& stroke) override {
    ++asked;
    if (stroke.speed > 0.37) return StrokeRefusal{RefusalReason::kTooFast, "too fast"};
    return StrokeForecast{};
  }
  int asked = 0;
};

TEST(Paper, FindsTheFastestHitThatTheArmDoesByHalving) {
  const auto paper = make_strategy("paper", {});
  auto ctx = decision_context();
  const StrokeOption free = paper->decide(scene_of(test::formation("E")), ctx).options[0];
  ASSERT_GT(free.stroke.speed, 0.40) << "else there is nothing for the slow arm to refuse";
  Slow slow;
  ctx.filter = &slow;
  const StrokeOption slower = paper->decide(scene_of(test::formation("E")), ctx).options[0];
  EXPECT_EQ(slower.stroke.kind, StrokeKind::kHit);
  EXPECT_EQ(slower.stroke.p_WS, free.stroke.p_WS);
  EXPECT_LE(slower.stroke.speed, 0.37);
  EXPECT_LE(slow.asked, 7);
}

TEST(Paper, TakesTheOtherSideWhenDiscsWouldLeave) {
  // The pair lies at the far border; a push away from the arm would carry it out.
  auto discs = test::formation("A");
  for (auto& disc : discs) disc.p_WD.x() += 0.297;
  const Decision decision = make_strategy("paper", {})->decide(scene_of(discs), decision_context());
  ASSERT_EQ(decision.kind, Decision::Kind::kStroke);
  EXPECT_LT(decision.options[0].stroke.direction_W.x(), 0.0);
  EXPECT_NE(decision.options[0].why.find("would leave"), std::string::npos) << decision.options[0].why;
}

TEST(Paper, FollowsPerceptionsPushLineButNotAFalseOne) {
  const auto paper = make_strategy("paper", {});
  Scene scene = scene_of(test::formation("A"));
  SceneContact contact;
  contact.a = 0;
  contact.b = 1;
  contact.p_touch = 1.0;
  contact.push_direction_W = {std::cos(0.1), std::sin(0.1)};
  contact.contour_length = 0.040;
  scene.contacts = {contact};
  const auto followed = paper->decide(scene, decision_context()).options[0].stroke;
  EXPECT_NEAR((followed.direction_W - contact.push_direction_W).norm(), 0.0, 1e-9);
  EXPECT_NEAR(followed.length, (Vector2{0.0, 0.0} - followed.p_WS).norm() + 0.020 + 0.020, 1e-6);
  scene.contacts[0].push_direction_W = {std::cos(1.0), std::sin(1.0)};
  EXPECT_NEAR(paper->decide(scene, decision_context()).options[0].stroke.direction_W.x(), 1.0, 1e-6);
}

TEST(Robust, SaysHowLikelyItIsToFinishAndToLoseADisc) {
  const Decision decision = make_strategy("robust", {})->decide(scene_of(test::formation("fig11")), decision_context());
  ASSERT_EQ(decision.kind, Decision::Kind::kStroke);
  double best = 0.0;
  for (const auto& option : decision.options) {
    EXPECT_GE(option.cost_s, best) << "the one that is expected to finish soonest comes first";
    best = option.cost_s;
    EXPECT_TRUE(option.p_singulated >= 0.0 && option.p_singulated <= 1.0);
    EXPECT_LE(option.p_lost, 0.05);
  }
  EXPECT_NE(decision.options[0].why.find("P(singulated)"), std::string::npos) << decision.options[0].why;
}

TEST(Robust, IsLessSureTheLessItSees) {
  Scene scene = scene_of(test::formation("E"));
  const auto robust = make_strategy("robust", {});
  const double sharp = robust->decide(scene, decision_context()).options.at(0).p_singulated;
  for (auto& disc : scene.discs) disc.covariance = 4e-6 * Matrix2::Identity();  // 2 mm
  const double blurred = robust->decide(scene, decision_context()).options.at(0).p_singulated;
  EXPECT_LT(blurred, sharp);
}

TEST(Robust, KeepsDiscsAwayFromABorderThatIsNear) {
  auto ctx = decision_context();
  auto discs = test::formation("E");
  for (auto& disc : discs) disc.p_WD.y() += 0.20;  // 40 mm from the border for the outermost
  const Decision decision = make_strategy("robust", {})->decide(scene_of(discs), ctx);
  ASSERT_FALSE(decision.options.empty());
  EXPECT_LE(decision.options[0].p_lost, 0.02);
}

/// What a hit of the disc that is nearest to the arm, away from it, leaves in each of so many worlds: `measure` of where the discs rest.
template <typename Measure>
std::vector<double> in_worlds(const std::vector<world::Disc>& discs, const StrategySettings& settings, std::optional<TableBelief> belief,
                              Measure measure) {
  const Scene scene = scene_of(discs);
  auto ctx = decision_context();
  ctx.belief = belief;
  std::string why;
  const auto model = model_of(scene, ctx.min_gap, settings, why);
  SampledWorlds worlds{*model, scene, ctx, settings};
  const auto& struck = *std::min_element(discs.begin(), discs.end(), [](const auto& a, const auto& b) { return a.p_WD.x() < b.p_WD.x(); });
  const Vector2 direction{1.0, 0.0};
  const StrokeRequest hit = hit_stroke(central_contact(struck, direction, settings.cell.striker_radius), direction, 0.7, settings.rules);
  std::vector<double> found;
  for (std::size_t world = 0; world < 96; ++world) {
    const Aftermath aftermath = worlds.run(hit, {}, world);
    EXPECT_TRUE(aftermath.valid) << world;
    found.push_back(measure(aftermath));
  }
  return found;
}

TEST(SampledWorlds, LeaveOpenWhetherContactsLast) {
  const auto gap = [](const Aftermath& aftermath) { return aftermath.smallest_gap; };
  StrategySettings settings;
  settings.robust.compliant_share = 0.0;
  const auto instants = in_worlds(test::formation("E"), settings, std::nullopt, gap);
  settings.robust.compliant_share = 0.25;
  const auto mixed = in_worlds(test::formation("E"), settings, std::nullopt, gap);
  int others = 0;
  for (std::size_t world = 0; world < instants.size(); ++world) {
    if (world < 16) {
      EXPECT_EQ(instants[world], mixed[world]) << world;
    }
    others += instants[world] != mixed[world] ? 1 : 0;
  }
  EXPECT_NEAR(others, 24, 10);  // a quarter of all, within two and a half standard deviations
}

TEST(SampledWorlds, AreAsWideAsWhatIsBelievedOfFriction) {
  const std::vector<world::Disc> discs{test::disc_at(0.0, 0.0), test::disc_at(0.001, 0.07)};
  const auto spread = [&](double sigma) {
    const auto ways = in_worlds(discs, {}, TableBelief{{0.25, sigma}, {0.8, 0.01}},
                                [&](const Aftermath& aftermath) { return (aftermath.p_WD[0] - discs[0].p_WD).norm(); });
    return *std::max_element(ways.begin(), ways.end()) / *std::min_element(ways.begin(), ways.end());
  };
  EXPECT_LT(spread(0.001), 1.5);  // speed and striker alone
  EXPECT_GT(spread(0.08), 2.0);   // mu from 0.14 to 0.43
}

TEST(TableModel, JoinsContactsToClustersAndListsEveryPairBelowG) {
  auto discs = test::formation("E");
  discs.push_back(test::disc_at(0.2, 0.2));
  discs.push_back(test::disc_at(0.2, 0.27));  // 10 mm apart: too near, not in contact
  std::string why;
  const auto model = model_of(scene_of(discs), 0.015, {}, why);
  ASSERT_TRUE(model) << why;
  EXPECT_EQ(model->cluster_size.size(), 3U);
  EXPECT_EQ(model->cluster_size[0], 6);
  EXPECT_EQ(model->pairs.size(), 10U);  // nine contacts of the rack, and the pair
  EXPECT_FALSE(model->pairs.back().contact);
}

}  // namespace
}  // namespace breakshot::strategy
