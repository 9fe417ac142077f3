#include "tests/support/in_process_cell.hpp"

#include <gtest/gtest.h>

namespace breakshot::support {
namespace {

// What the benchmarks play: the arm that comes into the picture must be known for an arm, not for something that does not belong there.
TEST(InProcessCell, SingulatesByRenderedPicturesAndByTheirErrorModel) {
  auto settings = load_in_process_settings(std::string{BREAKSHOT_SOURCE_DIR} + "/config/cell.yaml");
  for (const Sight sight : {Sight::kRendered, Sight::kNoiseModel}) {
    settings.sight = sight;
    InProcessCell cell{settings};
    EpisodeWorld world;
    world.physics = settings.sim.physics;
    world.camera_latency = settings.camera_latency;
    const auto result = cell.run(load_formation("A", cell.settings().cell), cell.default_request(), "paper", world);
    EXPECT_EQ(result.task.phase, TaskPhase::kSingulated) << result.task.text;
    EXPECT_EQ(result.truly_lost, 0);
    EXPECT_GE(result.task.hits + result.task.pushes, 1U);
  }
}

// Thinking that is over when the scene settles costs no time; what does cost is charged, and the same again for the same seed.
TEST(InProcessCell, PlansAheadAndIsDeterministic) {
  auto settings = load_in_process_settings(std::string{BREAKSHOT_SOURCE_DIR} + "/config/cell.yaml");
  settings.sight = Sight::kNoiseModel;
  const auto run = [&](bool ahead) {
    settings.task.plan_ahead = ahead;
    InProcessCell cell{settings};
    EpisodeWorld world;
    world.physics = settings.sim.physics;
    world.camera_latency = settings.camera_latency;
    world.seed = 3;
    return cell.run(load_formation("F", cell.settings().cell), cell.default_request(), "robust", world);
  };
  const EpisodeResult without = run(false);
  const EpisodeResult with = run(true);
  const EpisodeResult again = run(true);
  ASSERT_EQ(with.task.phase, TaskPhase::kSingulated) << with.task.text;
  EXPECT_EQ(without.ahead.kept + without.ahead.corrected, 0U);
  EXPECT_EQ(with.ahead.kept + with.ahead.corrected, with.plans.size());
  const auto decide = [](const EpisodeResult& r) { return to_seconds(r.task.times.decide) / static_cast<double>(r.plans.size()); };
  EXPECT_NEAR(decide(without), 0.2, 0.035);
  EXPECT_LT(decide(with), 0.15);
  EXPECT_EQ(with.duration, again.duration);
  EXPECT_EQ(with.true_gap, again.true_gap);
}

}  // namespace
}  // namespace breakshot::support
