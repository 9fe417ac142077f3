#include "perception/perception_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace breakshot::perception {
namespace {

using ::testing::HasSubstr;

PerceptionConfig load(const std::vector<std::string>& overrides = {}) {
  const ConfigDocument document = load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml", overrides);
  return load_perception_config(document, load_cell_config(document));
}

std::string error_of(const std::vector<std::string>& overrides) {
  try {
    load(overrides);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(PerceptionConfig, TakesColoursAndDiscsFromTheCell) {
  const PerceptionConfig config = load();
  EXPECT_GE(config.settings.colours.size(), 6U);
  EXPECT_DOUBLE_EQ(config.settings.disc_height, 0.020);
  EXPECT_EQ(config.settings.p_WB, Vector2(-0.5, 0.0));
  EXPECT_GT(config.silence_limit, Duration::zero());
}

TEST(PerceptionConfig, IsOverriddenFromTheCommandLine) {
  EXPECT_EQ(load({"perception.paper.thickness_px=7"}).settings.paper.thickness_px, 7);
}

TEST(PerceptionConfig, NamesTheKeyOfABadValue) {
  EXPECT_THAT(error_of({"perception.paper.thickness_px=4"}), HasSubstr("perception.paper.thickness_px: found 4"));
  EXPECT_THAT(error_of({"perception.morphology_px=33"}), HasSubstr("perception.morphology_px: found 33"));
  EXPECT_THAT(error_of({"perception.edge_gamma=.nan"}), HasSubstr("perception.edge_gamma"));
}

}  // namespace
}  // namespace breakshot::perception
