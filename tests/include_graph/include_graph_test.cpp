#include "tests/include_graph/include_graph.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace breakshot::include_graph {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> violations_of(const std::string& file, const std::string& line) { return violations({{file, includes_of(line)}}); }

TEST(IncludeGraph, TheRepositoryKeepsTheDependencyRule) {
  const Graph graph = read_graph(BREAKSHOT_SOURCE_DIR);
  EXPECT_GT(graph.size(), 100U) << "the sources were not found";
  EXPECT_THAT(violations(graph), IsEmpty());
}

TEST(IncludeGraph, TheRepositoryHasNoCircle) { EXPECT_THAT(circle(read_graph(BREAKSHOT_SOURCE_DIR)), IsEmpty()); }

TEST(IncludeGraph, ReadsIncludeLines) {
  const auto includes = includes_of("#pragma once\n# include <ode/ode.h>  // why\n  #include \"common/time.hpp\"\n// include nothing\n");
  ASSERT_EQ(includes.size(), 2U);
  EXPECT_EQ(includes[0].name, "ode/ode.h");
  EXPECT_FALSE(includes[0].quoted);
  EXPECT_EQ(includes[1].name, "common/time.hpp");
  EXPECT_TRUE(includes[1].quoted);
  EXPECT_EQ(includes[1].line, 3);
}

TEST(IncludeGraph, RefusesWhatTheDesignForbids) {
  const std::vector<std::pair<std::string, std::string>> forbidden{
      {"common/time.hpp", "#include \"controller/motion/trajectory.hpp\""},
      {"common/scene.cpp", "#include \"common/dds/participant.hpp\""},
      {"controller/kinematics/arm.cpp", "#include \"controller/motion/trajectory.hpp\""},
      {"controller/motion/transit.cpp", "#include \"planner/world/world.hpp\""},
      {"controller/loop/tick.cpp", "#include \"common/dds/endpoint.hpp\""},
      {"planner/world/world.cpp", "#include \"planner/strategy/strategy.hpp\""},
      {"planner/world/world.cpp", "#include \"common/config/config_node.hpp\""},
      {"planner/strategy/paper.cpp", "#include \"controller/motion/stroke_planner.hpp\""},
      {"planner/arm_filter.cpp", "#include \"controller/loop/tick.hpp\""},
      {"sim_bridge/world/world.cpp", "#include \"planner/world/world.hpp\""},
      {"perception/discs.cpp", "#include \"sim_bridge/camera/camera.hpp\""},
      {"controller/loop/tick.cpp", "#include \"controller/node/controller_node.hpp\""},
      {"client/main.cpp", "#include \"mes_gateway/mes_gateway_node.hpp\""},
      {"client/main.cpp", "#include \"tests/support/cell.hpp\""},
      {"client/main.cpp", "#include \"order_client.hpp\""},
      {"planner/world/world.cpp", "#include <ode/ode.h>"},
      {"planner/world/world.cpp", "#include <opencv2/core.hpp>"},
      {"planner/planner_config.cpp", "#include <yaml-cpp/yaml.h>"},
      {"controller/motion/arm.cpp", "#include <urdf_parser/urdf_parser.h>"},
      {"controller/loop/tick.cpp", "#include <fastdds/dds/publisher/DataWriter.hpp>"},
      {"controller/rt/loop.cpp", "#include <spdlog/spdlog.h>"},
  };
  for (const auto& [file, line] : forbidden) EXPECT_EQ(violations_of(file, line).size(), 1U) << file << ": " << line;
}

TEST(IncludeGraph, SaysWhereAndWhy) {
  EXPECT_THAT(violations_of("planner/world/world.cpp", "\n#include \"common/dds/endpoint.hpp\""),
              ElementsAre("planner/world/world.cpp:2: includes common/dds/endpoint.hpp: planner/world may not know common/dds"));
}

TEST(IncludeGraph, LetsTheOuterPartsThrough) {
  const std::vector<std::pair<std::string, std::string>> allowed{
      {"planner/main.cpp", "#include \"planner/node/planner_node.hpp\""},
      {"mes_gateway/main.cpp", "#include \"mes_gateway/mes_gateway_node.hpp\""},
      {"controller/motion/motion_config.cpp", "#include \"common/config/config_node.hpp\""},
      {"planner/arm_filter.hpp", "#include \"controller/motion/stroke_planner.hpp\""},
      {"sim_bridge/world/world.cpp", "#include <ode/ode.h>"},
      {"tests/planner/world/yardstick_test.cpp", "#include <ode/ode.h>"},
  };
  for (const auto& [file, line] : allowed) EXPECT_THAT(violations_of(file, line), IsEmpty()) << file << ": " << line;
}

TEST(IncludeGraph, FindsACircle) {
  const Graph graph{{"common/a.hpp", includes_of("#include \"common/b.hpp\"")},
                    {"common/b.hpp", includes_of("#include \"common/c.hpp\"")},
                    {"common/c.hpp", includes_of("#include \"common/b.hpp\"")}};
  EXPECT_THAT(circle(graph), ElementsAre("common/b.hpp", "common/c.hpp", "common/b.hpp"));
}

}  // namespace
}  // namespace breakshot::include_graph
