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

}  // namespace
}  // namespace breakshot::support
