#include "common/config/cell_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace breakshot {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::filesystem::path kFile = BREAKSHOT_SOURCE_DIR "/config/cell.yaml";

std::string error_with(const std::string& override_text) {
  try {
    (void)load_cell_config(load_cell_document(kFile, std::vector<std::string>{override_text}));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(CellConfig, TheShippedFileReads) {
  const CellConfig cell = load_cell_config(load_cell_document(kFile));
  EXPECT_EQ(cell.mode, CellMode::kRealTime);
  EXPECT_EQ(cell.workspace.max, Vector2(0.3, 0.3));
  EXPECT_EQ(cell.arm.park.size(), 6);
  EXPECT_EQ(cell.arm.X_WB.translation(), Vector3(-0.5, 0, 0));
  EXPECT_GE(cell.colours.size(), 8U);
  EXPECT_EQ(find_colour(cell.colours, "red"), 0);
  EXPECT_FALSE(find_colour(cell.colours, "no such colour"));
}

TEST(CellConfig, EveryHueBelongsToAtMostOneColourAndRedWraps) {
  const CellConfig cell = load_cell_config(load_cell_document(kFile));
  for (int hue = 0; hue <= 360; ++hue) {
    int owners = 0;
    for (const Colour& colour : cell.colours) owners += colour.hsv.contains(hue, 0.8, 0.8) ? 1 : 0;
    EXPECT_LE(owners, 1) << hue;
  }
  EXPECT_TRUE(cell.colours[0].hsv.contains(0, 0.8, 0.8));
  EXPECT_TRUE(cell.colours[0].hsv.contains(350, 0.8, 0.8));
  EXPECT_FALSE(cell.colours[0].hsv.contains(180, 0.8, 0.8));
  EXPECT_FALSE(cell.colours[0].hsv.contains(0, 0.1, 0.8));
}

TEST(CellConfig, RefusesWhatDoesNotFitTogether) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"cell.mode=fast", "--set: cell.mode: found fast; allowed: real_time, lockstep"},
      {"cell.tip_height=0.03", "cell.tip_height: found a striker that passes over the discs"},
      {"cell.disc_radius=[0.05, 0.02]", "cell.disc_radius: found an empty range"},
      {"cell.table_size=[0.5, 1.2]", "cell.workspace: found a workspace that reaches over the table's edge"},
      {"cell.workspace.max=[-0.3, 0.3]", "cell.workspace.max: found a corner too near"},
      {"cell.target_gap=.nan", "--set: cell.target_gap: found .nan; allowed: a number in [0.001, 0.1] m"},
      {"cell.dds.mes_domain=31", "cell.dds.mes_domain: found the domain of the cell"},
      {"cell.dds.ros2_domain=233", "cell.dds.ros2_domain: found 233; allowed: a whole number in [0, 232]"},
      {"cell.arm.urdf=arms/none.urdf", "arms/none.urdf, which is not there"},
      {"cell.arm.park_deg=[1, 2, 3, 4, 5, 6, 7, 8]", "cell.arm.park_deg: found a list of 8; allowed: a list of 1 to 7"},
      {"cell.table_markers.dictionary=4x4", "cell.table_markers.dictionary: found 4x4; allowed: 4x4_50, 5x5_100, 6x6_250, apriltag_36h11"},
      {"cell.table_markers.at=[{id: 50, p_WM: [0.5, 0], yaw_deg: 0}]", "cell.table_markers.at[0].id: found 50"},
      {"cell.table_markers.at=[{id: 1, p_WM: [0.5, 0], yaw_deg: 0}, {id: 1, p_WM: [0.5, 0.2], yaw_deg: 0}]",
       "cell.table_markers.at[1].id: found 1 a second time"},
      {"cell.table_markers.at=[{id: 1, p_WM: [0.5, 0], yaw_deg: 0}, {id: 2, p_WM: [0.5, 0.05], yaw_deg: 0}]",
       "cell.table_markers.at[1].p_WM: found a marker over marker 1"},
      {"cell.table_markers.at=[{id: 1, p_WM: [0.68, 0], yaw_deg: 0}]", "cell.table_markers: found marker 1 over the table's edge"},
      {"cell.table_markers.at=[{id: 1, p_WM: [0.28, 0], yaw_deg: 0}]",
       "cell.table_markers: found marker 1 over the table's edge, or where discs lie"},
      {"cell.colours=[]", "cell.colours: found 0 colours"},
      {"cell.colours=[{name: a, rgb: [255, 0, 0], hue_deg: [90, 120], saturation: [0.1, 1], value: [0.1, 1]}]",
       "--set: cell.colours[0].rgb: found a paint of hue 0 deg"},
      {"cell.colours=[{name: a, rgb: [255, 0, 0], hue_deg: [340, 20], saturation: [0.1, 1], value: [0.1, 1]}, "
       "{name: b, rgb: [255, 60, 0], hue_deg: [10, 40], saturation: [0.1, 1], value: [0.1, 1]}]",
       "cell.colours[1].hue_deg: found an HSV range that overlaps that of a"},
      {"cell.arm={urdf: arms/ur5e_striker.urdf, base_link: a, tip_link: b, p_WB: [0, 0, 0], yaw_deg: 0, park_deg: [0], spare: 1}",
       "--set: cell.arm.spare: found an unknown key; allowed: urdf, base_link, tip_link, p_WB, yaw_deg, park_deg"},
  };
  for (const auto& [override_text, expected] : cases) EXPECT_THAT(error_with(override_text), HasSubstr(expected)) << override_text;
}

TEST(CellConfig, RefusesAnUnknownSection) {
  const ConfigDocument document = ConfigDocument::parse("cell: {}\nplaner: {}\n", "x.yaml");
  EXPECT_THROW(document.only_sections(kCellSections), ConfigError);
}

}  // namespace
}  // namespace breakshot
