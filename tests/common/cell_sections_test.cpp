// The shipped config/cell.yaml, read by every loader of every process; and what happens when any line of it is wrong.

#include "common/config/camera_file.hpp"
#include "common/config/cell_config.hpp"
#include "common/config/formation.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/controller_config.hpp"
#include "launcher/launcher_config.hpp"
#include "mes_gateway/mes_gateway_config.hpp"
#include "perception/perception_config.hpp"
#include "planner/planner_config.hpp"
#include "ros_gateway/ros_gateway_config.hpp"
#include "sim_bridge/sim_bridge_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace breakshot {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::filesystem::path kFile = BREAKSHOT_SOURCE_DIR "/config/cell.yaml";

/// Sections that load_everything() reads.
const std::vector<std::string> kRead{"cell", "sim_bridge", "controller", "perception", "planner", "mes_gateway", "ros_gateway", "launcher"};

void load_everything(const ConfigDocument& document) {
  document.only_sections(kCellSections);
  const CellConfig cell = load_cell_config(document);
  const auto sim = sim_bridge::load_sim_bridge_config(document, cell);
  (void)control::load_controller_config(document, cell);
  (void)perception::load_perception_config(document, cell);
  (void)planner::load_planner_config(document, cell);
  (void)mes::load_mes_gateway_config(document.section("mes_gateway"), cell);
  (void)ros::load_ros_gateway_config(document.section("ros_gateway"));
  (void)launcher::load_launcher_config(document.section("launcher"));
  // Last what is in other files: most of what this test breaks is found before they are opened.
  (void)load_cell_arm(cell);
  (void)load_camera(cell.camera_file);
  (void)load_formation(sim.formation, cell);
}

std::string error_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    load_everything(ConfigDocument::parse(text, kFile, overrides));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

/// A process of the launcher's may be left out of the file, and all of them are documented in one line.
bool is_process(const std::string& path) { return path.starts_with("launcher.processes."); }

/// A key of the shipped file with the line that it stands on.
struct Key {
  std::string path;   ///< "cell.arm.urdf"
  std::string name;   ///< "urdf"
  std::string value;  ///< as written, without the comment; empty when a block follows
  std::size_t line = 0;
};

class ShippedFile : public testing::Test {
 protected:
  ShippedFile() {
    std::ifstream stream{kFile};
    for (std::string line; std::getline(stream, line);) lines_.push_back(line);
    // The shipped file keeps to two blanks per level and one key per line, lists aside; that is all that this reader understands.
    const std::regex pattern{R"(^( *)([A-Za-z0-9_]+):(?: +([^#]*[^# ]))? *(?:#.*)?$)"};
    std::vector<std::string> parents;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      std::smatch match;
      if (!std::regex_match(lines_[i], match, pattern)) continue;
      parents.resize(static_cast<std::size_t>(match.length(1)) / 2);
      std::string path;
      for (const std::string& parent : parents) path += parent + ".";
      parents.push_back(match[2]);
      if (std::find(kRead.begin(), kRead.end(), parents.front()) == kRead.end()) continue;
      keys_.push_back({path + match[2].str(), match[2], match[3], i});
    }
  }

  /// Nothing that follows means anything when the file itself does not read.
  void SetUp() override { ASSERT_EQ(error_of(text()), "no error"); }

  std::string text() const {
    std::ostringstream text;
    for (const std::string& line : lines_) text << line << '\n';
    return text.str();
  }
  std::string text_with(std::size_t line, const std::string& replacement) const {
    std::ostringstream text;
    for (std::size_t i = 0; i < lines_.size(); ++i) text << (i == line ? replacement : lines_[i]) << '\n';
    return text.str();
  }

  std::vector<std::string> lines_;
  std::vector<Key> keys_;
};

TEST_F(ShippedFile, ReadsThroughEveryLoader) { EXPECT_GT(keys_.size(), 60U) << "the reader of this test has lost its way"; }

TEST_F(ShippedFile, HoldsNoTabsAndNoLongLines) {
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    EXPECT_EQ(lines_[i].find('\t'), std::string::npos) << i + 1;
    EXPECT_LE(lines_[i].size(), 160U) << i + 1;
  }
}

TEST_F(ShippedFile, EveryLineCounts) {
  for (const Key& key : keys_) {
    if (key.value.empty() || is_process(key.path)) continue;
    EXPECT_THAT(error_of(text_with(key.line, "")), AllOf(HasSubstr(key.path + ": found no such key"), HasSubstr("; allowed: ")))
        << key.path;
  }
}

TEST_F(ShippedFile, AMistypedKeyIsFoundWithItsLine) {
  for (const Key& key : keys_) {
    std::string line = lines_[key.line];
    line.insert(line.find(key.name) + key.name.size(), "x");
    const std::string message = error_of(text_with(key.line, line));
    // Its absence under the right name, or its presence under the wrong one: whichever the loader meets first.
    EXPECT_THAT(message, HasSubstr(key.path)) << key.path;
    EXPECT_THAT(message, HasSubstr(kFile.string() + ":")) << key.path;
  }
}

TEST_F(ShippedFile, AProcessThatTheCellDoesNotHaveIsRefusedWithThoseThatItHas) {
  for (const Key& key : keys_) {
    if (!is_process(key.path)) continue;
    EXPECT_THAT(error_of(text_with(key.line, "    erp_gateway: {after: [], enabled: true}")),
                AllOf(HasSubstr(":" + std::to_string(key.line + 1) + ": launcher.processes.erp_gateway: found an unknown process"),
                      HasSubstr("sim_bridge, controller, perception, planner, mes_gateway, ros_gateway")));
  }
}

TEST_F(ShippedFile, AnExtraKeyIsFoundWithItsLine) {
  for (const Key& key : keys_) {
    if (key.value.empty() || key.path.find('.') == std::string::npos) continue;
    const std::string indent(lines_[key.line].find(key.name), ' ');
    const std::string message = error_of(text_with(key.line, lines_[key.line] + "\n" + indent + "zz_extra: 1"));
    EXPECT_THAT(message, AllOf(HasSubstr(":" + std::to_string(key.line + 2) + ": "), HasSubstr("zz_extra"))) << key.path;
  }
}

TEST_F(ShippedFile, NoKeyTakesTheWrongShape) {
  for (const Key& key : keys_) {
    const std::string wrong = key.value.empty() ? "1" : "{zz_wrong: 1}";
    EXPECT_THAT(error_of(text(), {key.path + "=" + wrong}), AllOf(HasSubstr("--set: " + key.path), HasSubstr("; allowed: "))) << key.path;
  }
}

TEST_F(ShippedFile, NoNumberIsWithoutBounds) {
  const std::regex number{R"(-?[0-9.]+)"};
  int numbers = 0;
  for (const Key& key : keys_) {
    if (!std::regex_match(key.value, number)) continue;
    ++numbers;
    for (const std::string wrong : {".nan", "-.inf", "1e300", "-1e300", "text", "\"1\""}) {
      EXPECT_THAT(error_of(text(), {key.path + "=" + wrong}), AllOf(HasSubstr("--set: " + key.path), HasSubstr("; allowed: "))) << wrong;
    }
  }
  EXPECT_GT(numbers, 80);
}

TEST_F(ShippedFile, NoListOfNumbersTakesNanOrAnotherLength) {
  const std::regex list{R"(\[[-0-9., ]+\])"};
  for (const Key& key : keys_) {
    if (!std::regex_match(key.value, list) || key.name == "interfaces") continue;
    const std::string inner = key.value.substr(1, key.value.size() - 2);
    const std::string nan = "[" + std::regex_replace(inner, std::regex{"^[^,]*"}, ".nan") + "]";
    EXPECT_THAT(error_of(text(), {key.path + "=" + nan}), HasSubstr("--set: " + key.path + "[0]: found .nan")) << key.path;
    EXPECT_THAT(error_of(text(), {key.path + "=[]"}), HasSubstr("--set: " + key.path + ": found a list of 0")) << key.path;
    EXPECT_NE(error_of(text(), {key.path + "=[" + inner + ", 0]"}), "no error") << key.path;
  }
}

/// docs/configuration.md has a table per section, "## `section`", with one row per key, "| `key` | ...".
TEST_F(ShippedFile, EveryKeyAndNoOtherIsDocumented) {
  std::ifstream stream{BREAKSHOT_SOURCE_DIR "/docs/configuration.md"};
  ASSERT_TRUE(stream);
  const std::regex heading{R"(^## `(\w+)`.*)"};
  const std::regex row{R"(^\| `([\w.]+)` .*)"};
  std::vector<std::string> documented;
  std::string section;
  for (std::string line; std::getline(stream, line);) {
    std::smatch match;
    if (std::regex_match(line, match, heading)) section = match[1];
    if (line.starts_with("## ") && !std::regex_match(line, heading)) section.clear();
    if (!section.empty() && std::regex_match(line, match, row)) documented.push_back(section + "." + match[1].str());
  }
  std::vector<std::string> present;
  for (const Key& key : keys_) {
    const bool in_section = key.path.find('.') != std::string::npos;
    if (in_section && !is_process(key.path) && !key.value.empty()) present.push_back(key.path);
  }
  for (const std::string& path : present) {
    EXPECT_TRUE(std::find(documented.begin(), documented.end(), path) != documented.end()) << path << " is not in docs/configuration.md";
  }
  for (const std::string& path : documented) {
    if (is_process(path) || path == "cell.colours") continue;
    EXPECT_TRUE(std::find(present.begin(), present.end(), path) != present.end()) << path << " is documented but not in config/cell.yaml";
  }
}

/// What no loader can see, because the sections belong to different processes.
TEST_F(ShippedFile, SectionsAgree) {
  const ConfigDocument document = ConfigDocument::parse(text(), kFile);
  const CellConfig cell = load_cell_config(document);
  const Rect asked = planner::load_planner_config(document, cell).settings.cell.striker_area;
  const Rect granted = control::load_controller_config(document, cell).motion.striker_area;
  EXPECT_TRUE(granted.contains(asked.min) && granted.contains(asked.max))
      << "the planner would ask for strokes that the controller refuses";
}

TEST_F(ShippedFile, FormationsFitTheCell) {
  const CellConfig cell = load_cell_config(ConfigDocument::parse(text(), kFile));
  for (const std::string& name : formation_names(cell)) EXPECT_NO_THROW((void)load_formation(name, cell)) << name;
}

}  // namespace
}  // namespace breakshot
