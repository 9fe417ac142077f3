#include "tests/planner/task/task_cell.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

// Planning ahead: a decision is begun while the arm still moves or discs still slide, and corrected when the scene settles.

namespace breakshot::task {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::TaskCell;
using Verb = TaskRequest::Verb;

constexpr Duration kFrame = milliseconds{33};
constexpr double kDeceleration = 0.25 * kGravity;  // m/s^2; what StrategySettings believe
constexpr double kCameraSigma = 5e-5;              // m

/// A disc that slides freely from p_WD at time zero of the table.
struct Slider {
  Vector2 p_WD, v_WD_W{0.0, 0.0};

  Vector2 at(double t) const {
    const double speed = v_WD_W.norm();
    if (speed == 0.0) return p_WD;
    const double slid = std::clamp(t, 0.0, speed / kDeceleration);
    return p_WD + (speed * slid - 0.5 * kDeceleration * slid * slid) * v_WD_W / speed;
  }
  Vector2 rest() const { return at(1e3); }
};

/// A camera over sliding discs.
struct Table {
  std::vector<Slider> discs;
  std::uint64_t frames = 0;

  Scene scene(double t, Time exposed) {
    Scene scene;
    scene.seq = ++frames;
    scene.exposed = exposed;
    if (frames == 1) scene.max_speed = std::numeric_limits<double>::infinity();  // nobody knows yet
    for (std::size_t i = 0; i < discs.size(); ++i) {
      SceneDisc disc;
      disc.id = static_cast<std::uint32_t>(i + 1);
      disc.p_WD = discs[i].at(t);
      disc.radius = 0.030;
      disc.covariance = kCameraSigma * kCameraSigma * Matrix2::Identity();
      scene.discs.push_back(disc);
      scene.max_speed = std::max(scene.max_speed, (discs[i].at(t) - discs[i].at(t - to_seconds(kFrame))).norm() / to_seconds(kFrame));
    }
    return scene;
  }
};

strategy::TableBelief belief(double friction_sigma = 0.0) { return {{0.25, friction_sigma}, {0.8, 0.0}}; }

/// What a forecast says at a time after a start at time zero, frame by frame.
std::optional<RestForecast::Forecast> forecast_at(Table table, double t, const strategy::TableBelief& known,
                                                  const std::function<void(Scene&)>& change = {}) {
  RestForecast forecast{{}, 0.02};
  forecast.start();
  double now = 0.0;
  for (Time stamp{seconds{1}}; now < t; now += to_seconds(kFrame), stamp += kFrame) {
    Scene scene = table.scene(now, stamp);
    if (change) change(scene);
    forecast.on_scene(scene);
  }
  return forecast.forecast(table.discs.size(), known);
}

TEST(RestForecast, SaysWhereFreeDiscsStop) {
  const Table table{{{{0.0, 0.0}, {0.5, 0.2}}, {{0.0, -0.1}, {0.1, -0.2}}, {{-0.2, 0.1}}}};
  const auto forecast = forecast_at(table, 0.08, belief());
  ASSERT_TRUE(forecast);
  EXPECT_TRUE(forecast->slid);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((forecast->scene.discs[i].p_WD - table.discs[i].rest()).norm(), 1e-6) << i;
    EXPECT_EQ(forecast->scene.discs[i].v_WD_W.norm(), 0.0);
  }
}

TEST(RestForecast, IsTheSurerTheLessWayIsLeftAndTheBetterFrictionIsKnown) {
  const Table table{{{{0.0, 0.0}, {0.6, 0.0}}, {{-0.2, 0.1}}}};
  const auto early = forecast_at(table, 0.08, belief(0.0125));
  const auto late = forecast_at(table, 0.20, belief(0.0125));
  const auto known = forecast_at(table, 0.08, belief());
  ASSERT_TRUE(early && late && known);
  // 56 mm are left, and mu is known to 5 %; along the way, for the direction is known.
  EXPECT_NEAR(early->sigma, 0.05 * 0.046, 0.0012);
  EXPECT_LT(late->sigma, 0.5 * early->sigma);
  EXPECT_LT(known->sigma, 0.5 * early->sigma);
  EXPECT_LT(early->scene.discs[0].covariance(1, 1), 0.1 * early->scene.discs[0].covariance(0, 0));
  EXPECT_LT(early->scene.discs[1].covariance(0, 0), 4.0 * kCameraSigma * kCameraSigma) << "a disc at rest stays";
}

TEST(RestForecast, RunsIntoWhatLiesInTheWay) {
  // Head on, 62 mm before the contact at which 0.3 m/s are left: equal discs hand on (1 + e) / 2 of it.
  const Table table{{{{0.0, 0.0}, {0.6, 0.0}}, {{0.10, 0.0}}}};
  const double v = std::sqrt(0.6 * 0.6 - 2.0 * kDeceleration * 0.04);
  const auto forecast = forecast_at(table, 0.04, belief());
  ASSERT_TRUE(forecast);
  EXPECT_NEAR(forecast->scene.discs[0].p_WD.x(), 0.04 + std::pow(0.1 * v, 2) / (2.0 * kDeceleration), 2e-4);
  EXPECT_NEAR(forecast->scene.discs[1].p_WD.x(), 0.10 + std::pow(0.9 * v, 2) / (2.0 * kDeceleration), 2e-4);
  EXPECT_TRUE(forecast->scene.contacts.empty());
}

TEST(RestForecast, WaitsUntilItKnowsOfEveryDisc) {
  const Table table{{{{0.0, 0.0}, {0.5, 0.0}}, {{0.0, -0.1}}}};
  EXPECT_FALSE(forecast_at(table, 0.01, belief())) << "one frame tells no velocity";
  EXPECT_FALSE(forecast_at(table, 0.08, belief(), [](Scene& scene) { scene.discs.erase(scene.discs.begin()); })) << "never seen";
  int frame = 0;
  const auto rests_behind_the_arm = [&](Scene& scene) {
    if (++frame > 2) scene.discs.pop_back();
  };
  const auto hidden = forecast_at(table, 0.11, belief(), rests_behind_the_arm);
  ASSERT_TRUE(hidden) << "it rested when the arm came before it";
  EXPECT_EQ(hidden->scene.discs[1].id, 2U);
  frame = 0;
  const auto slides_behind_the_arm = [&](Scene& scene) {
    if (++frame > 2) scene.discs.erase(scene.discs.begin());
  };
  EXPECT_FALSE(forecast_at(table, 0.11, belief(), slides_behind_the_arm)) << "who knows what it met there";
}

/// A task after its first stroke, played by hand: frames, controller and strategy come from the test.
class Aftermath {
 public:
  explicit Aftermath(std::vector<Slider> discs, const TaskSettings& settings = ahead_settings())
      : table{std::move(discs)}, runner{settings, "robust"} {
    TaskRequest order = TaskCell::order();
    runner.on_request(order, now);
    Table before{{{{0.0, 0.0}}, {{0.061, 0.0}}}};
    if (table.discs.size() == 3) before.discs.push_back({{0.0, 0.061}});
    for (int i = 0; i < 4 && runner.status().phase != TaskPhase::kDeciding; ++i) show(before.scene(0.0, step()));
    answer();
    stroke = sent.back();
    say(StrokePhase::kRunIn);
    say(StrokePhase::kParking);
    began = now;
    sent.clear();
    questions.clear();
    first = runner.ahead_counts();
  }

  static TaskSettings ahead_settings() {
    TaskSettings settings;
    settings.park_first = false;
    return settings;
  }
  Time step() { return now += kFrame; }
  void show(const Scene& scene) {
    runner.on_scene(scene, now);
    take();
  }
  /// Shows what the table looks like for so many frames.
  void watch(int frames) {
    for (int i = 0; i < frames; ++i) {
      const Time exposed = step();
      show(table.scene(to_seconds(exposed - began), exposed));
    }
  }
  void say(StrokePhase phase) {
    StrokeStatus status;
    status.id = stroke.id;
    status.phase = phase;
    status.stamp = now;
    runner.on_stroke_status(status, now);
    take();
  }
  /// Answers the newest question with a push at its first disc.
  void answer(strategy::Decision::Kind kind = strategy::Decision::Kind::kStroke) {
    strategy::Decision decision;
    decision.kind = kind;
    strategy::StrokeOption option;
    option.stroke.kind = StrokeKind::kPush;
    option.stroke.p_WS = questions.back().scene.discs[0].p_WD;
    option.why = "push";
    if (kind == strategy::Decision::Kind::kStroke) decision.options = {option};
    runner.on_decision(questions.back().ticket, decision, milliseconds{60}, now);
    take();
  }
  void request(Verb verb) {
    TaskRequest request = TaskCell::order(++requests);
    request.verb = verb;
    runner.on_request(request, now);
    take();
  }

  Time now{seconds{5}};
  Time began{};       // of the discs' sliding
  AheadCounts first;  // of the first stroke's decision
  Table table;
  TaskRunner runner;
  StrokeRequest stroke;
  std::uint64_t requests = 1;
  std::vector<RunStrategy> questions;
  std::vector<StrokeRequest> sent;
  std::vector<Plan> plans;

 private:
  void take() {
    for (Action& action : runner.take_actions()) {
      if (auto* ask = std::get_if<RunStrategy>(&action)) questions.push_back(*ask);
      if (auto* send = std::get_if<SendStroke>(&action)) sent.push_back(send->stroke);
      if (auto* plan = std::get_if<Plan>(&action)) plans.push_back(*plan);
    }
  }
};

/// Two discs that come to rest 5 mm apart after 0.12 s, while the arm parks.
std::vector<Slider> near_each_other() { return {{{0.0, 0.0}, {0.3, 0.0}}, {{0.0833, 0.0}}}; }

TEST(PlanAhead, BeginsWhileDiscsSlideAndIsCorrectedWhileTheArmStillMoves) {
  Aftermath cell{near_each_other()};
  cell.watch(3);
  ASSERT_EQ(cell.questions.size(), 1U) << "discs still slide, the arm still moves";
  EXPECT_LT((cell.questions[0].scene.discs[0].p_WD - cell.table.discs[0].rest()).norm(), 2e-4);
  EXPECT_TRUE(cell.questions[0].earlier.empty());
  cell.answer();
  EXPECT_TRUE(cell.sent.empty()) << "nothing is sent before the scene has settled";
  cell.watch(4);
  ASSERT_EQ(cell.questions.size(), 2U) << "the discs rest, the arm still moves";
  EXPECT_FALSE(cell.questions[1].earlier.empty());
  cell.answer();
  cell.watch(2);
  EXPECT_TRUE(cell.sent.empty());
  cell.say(StrokePhase::kDone);
  cell.watch(1);
  EXPECT_TRUE(cell.sent.empty()) << "one scene at rest does not settle it";
  cell.watch(1);
  EXPECT_EQ(cell.questions.size(), 2U);
  ASSERT_EQ(cell.sent.size(), 1U) << "without a moment's thought";
  EXPECT_EQ(cell.plans.back().why.find("push; planned ahead, discs 0.00 mm off"), 0U) << cell.plans.back().why;
  EXPECT_EQ(cell.plans.back().think, milliseconds{120});
  EXPECT_EQ(cell.runner.ahead_counts().kept - cell.first.kept, 1U);
}

TEST(PlanAhead, BeginsAnOrdersFirstDecisionBeforeTheSecondLook) {
  TaskRunner runner{Aftermath::ahead_settings(), "robust"};
  Table table{{{{0.0, 0.0}}, {{0.061, 0.0}}}};
  Time now{seconds{5}};
  const auto shown = [&] {
    now += kFrame;
    runner.on_scene(table.scene(0.0, now - milliseconds{66}), now);
    const auto actions = runner.take_actions();
    return std::any_of(actions.begin(), actions.end(), [](const Action& action) { return std::holds_alternative<RunStrategy>(action); });
  };
  EXPECT_FALSE(shown());
  runner.on_request(TaskCell::order(), now);
  EXPECT_TRUE(shown()) << "a picture from just before the order, on which nothing moved";
  EXPECT_NE(runner.status().phase, TaskPhase::kDeciding);
  EXPECT_FALSE(shown() || shown() || shown()) << "the looks that the order waits for show the same";
  EXPECT_EQ(runner.status().phase, TaskPhase::kDeciding);
}

TEST(PlanAhead, IsCorrectedOnTheSettledSceneWhenTheAnswerIsLate) {
  Aftermath cell{near_each_other()};
  cell.watch(6);
  cell.say(StrokePhase::kDone);
  cell.watch(2);
  ASSERT_EQ(cell.questions.size(), 1U) << "the forecast holds, so its decision is waited for";
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kDeciding);
  cell.answer();
  ASSERT_EQ(cell.questions.size(), 2U);
  EXPECT_FALSE(cell.questions[1].earlier.empty());
  EXPECT_TRUE(cell.sent.empty());
  cell.answer();
  ASSERT_EQ(cell.sent.size(), 1U);
  EXPECT_NE(cell.plans.back().why.find("stroke moved by 0."), std::string::npos) << cell.plans.back().why;
  EXPECT_EQ(cell.runner.ahead_counts().corrected, 1U);
}

TEST(PlanAhead, DecidesAnewWhenNothingOfItHolds) {
  Aftermath cell{near_each_other()};
  cell.watch(6);
  cell.say(StrokePhase::kDone);
  cell.watch(2);
  cell.answer();
  cell.answer(strategy::Decision::Kind::kNoStroke);
  ASSERT_EQ(cell.questions.size(), 3U);
  EXPECT_TRUE(cell.questions[2].earlier.empty());
  EXPECT_TRUE(cell.runner.running()) << "no task ends by what was found of a forecast";
}

TEST(PlanAhead, DecidesAnewOnASceneThatContradictsTheForecast) {
  TaskSettings settings = Aftermath::ahead_settings();
  settings.settled_scenes = 1;
  Aftermath cell{near_each_other(), settings};
  cell.watch(6);
  cell.say(StrokePhase::kDone);
  const auto begun = cell.questions.back();
  cell.table.discs[1].p_WD.y() += 0.003;  // by hand, between two frames
  const Time exposed = cell.step();
  Scene moved = cell.table.scene(1.0, exposed);
  moved.max_speed = 0.0;
  cell.show(moved);
  ASSERT_EQ(cell.questions.size(), 2U);
  EXPECT_TRUE(cell.questions[1].earlier.empty());
  EXPECT_NEAR(cell.questions[1].scene.discs[1].p_WD.y(), 0.003, 1e-9);
  strategy::Decision late;
  late.kind = strategy::Decision::Kind::kStroke;
  late.options.resize(1);
  cell.runner.on_decision(begun.ticket, late, {}, cell.now);
  EXPECT_TRUE(cell.runner.take_actions().empty()) << "nobody waits for the old one";
  EXPECT_EQ(cell.runner.ahead_counts().dropped, 1U);
  cell.answer();
  EXPECT_EQ(cell.plans.back().why, "push");
}

TEST(PlanAhead, BeginsAnewWhenTheForecastTurnsOutWrongInTime) {
  Aftermath cell{near_each_other()};
  cell.watch(6);
  ASSERT_EQ(cell.questions.size(), 1U);
  cell.table.discs[1].p_WD.y() += 0.003;
  cell.watch(3);
  ASSERT_EQ(cell.questions.size(), 2U);
  EXPECT_TRUE(cell.questions[1].earlier.empty());
  cell.answer();
  cell.watch(1);
  cell.answer();
  cell.say(StrokePhase::kDone);
  cell.watch(2);
  EXPECT_EQ(cell.sent.size(), 1U);
  EXPECT_EQ(cell.runner.ahead_counts().renewed, 1U);
  EXPECT_EQ(cell.runner.ahead_counts().kept - cell.first.kept, 1U);
}

TEST(PlanAhead, BeginsNothingWhereNothingWillBeLeftToDo) {
  Aftermath cell{{{{0.0, 0.0}, {-0.3, 0.0}}, {{0.065, 0.0}}}};  // 23 mm apart
  cell.watch(6);
  cell.say(StrokePhase::kDone);
  cell.watch(2);
  EXPECT_TRUE(cell.questions.empty());
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
}

TEST(PlanAhead, DropsWhatItBeganWhenTheDiscsAreApartAfterAll) {
  TaskSettings settings = Aftermath::ahead_settings();
  settings.settled_scenes = 1;
  Aftermath cell{near_each_other(), settings};
  cell.watch(6);
  cell.answer();
  cell.say(StrokePhase::kDone);
  cell.table.discs[1].p_WD.x() += 0.015;
  Scene apart = cell.table.scene(1.0, cell.step());
  apart.max_speed = 0.0;
  cell.show(apart);
  EXPECT_EQ(cell.runner.status().phase, TaskPhase::kSingulated);
  EXPECT_TRUE(cell.sent.empty());
  EXPECT_EQ(cell.runner.ahead_counts().dropped, 1U);
}

TEST(PlanAhead, IsForgottenByACancelAPauseAndAStop) {
  Aftermath cancelled{near_each_other()};
  cancelled.watch(6);
  cancelled.request(Verb::kCancel);
  cancelled.answer();
  cancelled.say(StrokePhase::kDone);
  cancelled.watch(3);
  EXPECT_EQ(cancelled.runner.status().phase, TaskPhase::kCancelled);
  EXPECT_TRUE(cancelled.sent.empty());

  Aftermath paused{near_each_other()};
  paused.watch(6);
  paused.answer();
  paused.request(Verb::kPause);
  paused.say(StrokePhase::kDone);
  paused.watch(3);
  EXPECT_EQ(paused.runner.status().phase, TaskPhase::kPaused);
  EXPECT_TRUE(paused.sent.empty());
  const auto asked = paused.questions.size();
  paused.request(Verb::kResume);
  paused.watch(3);
  EXPECT_GT(paused.questions.size(), asked) << "the table is looked at again: who knows what happened to it";
  EXPECT_TRUE(paused.sent.empty());

  Aftermath stopped{near_each_other()};
  stopped.watch(6);
  stopped.say(StrokePhase::kStopped);
  stopped.answer();
  stopped.watch(3);
  EXPECT_EQ(stopped.runner.status().failure, TaskFailure::kControllerFault);
  EXPECT_TRUE(stopped.sent.empty());
}

TEST(PlanAhead, TrustsNoPictureThatShowsSomethingForeign) {
  Aftermath cell{near_each_other()};
  cell.watch(6);
  cell.answer();
  Scene tool = cell.table.scene(1.0, cell.step());
  tool.foreign = {{ForeignObject::Kind::kHeight, {0.1, 0.1}, 0.02, 0.03}};
  cell.show(tool);
  cell.say(StrokePhase::kDone);
  const auto asked = cell.questions.size();
  cell.watch(2);
  EXPECT_GT(cell.questions.size(), asked);
  EXPECT_TRUE(cell.sent.empty());
}

TEST(PlanAhead, CountsTheStrokeUnderWayAgainstTheOrder) {
  Aftermath cell{near_each_other()};
  cell.watch(6);
  EXPECT_EQ(cell.questions.at(0).context.pushes_left, TaskCell::order().max_pushes - 1);
}

TEST(PlanAhead, CanBeSwitchedOff) {
  TaskSettings settings = Aftermath::ahead_settings();
  settings.plan_ahead = false;
  Aftermath cell{near_each_other(), settings};
  cell.watch(6);
  EXPECT_TRUE(cell.questions.empty());
  cell.say(StrokePhase::kDone);
  cell.watch(2);
  EXPECT_EQ(cell.questions.size(), 1U);
}

TEST(PlanAhead, SavesTimeAndNeverStrikesEarlyWhateverTheStrategy) {
  for (const char* strategy : {"paper", "random_hybrid", "random_push", "robust"}) {
    Duration decide[2]{};
    AheadCounts counts;
    for (const char* name : {"B", "D", "F", "fig12"}) {
      for (const bool ahead : {false, true}) {
        TaskSettings settings;
        settings.plan_ahead = ahead;
        TaskCell cell{test::formation(name), strategy, settings};
        cell.think = milliseconds{200};
        cell.runner.on_request(TaskCell::order(), cell.now);
        ASSERT_TRUE(cell.play_to_end()) << strategy << " " << name;
        EXPECT_EQ(cell.early_strokes, 0) << strategy << " " << name;
        EXPECT_EQ(cell.outcomes.size(), cell.plans.size());
        decide[ahead ? 1 : 0] += cell.runner.status().times.decide / static_cast<int>(cell.plans.size());
        if (ahead) counts.kept += cell.runner.ahead_counts().kept;
      }
    }
    EXPECT_LT(to_seconds(decide[1]), 0.75 * to_seconds(decide[0]))
        << strategy << ": the first decision of an order has little to begin on, the others take no time";
    EXPECT_GT(counts.kept, 0U) << strategy;
  }
}

}  // namespace
}  // namespace breakshot::task
