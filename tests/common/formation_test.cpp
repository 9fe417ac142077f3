#include "common/config/formation.hpp"

#include "common/scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace breakshot {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const CellConfig& cell() {
  static const CellConfig config = load_cell_config(load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml"));
  return config;
}

double gap(const FormationDisc& a, const FormationDisc& b) { return (a.p_WD - b.p_WD).norm() - a.radius - b.radius; }

/// Pairs that touch.
int contacts(const Formation& formation) {
  int count = 0;
  for (std::size_t i = 0; i < formation.discs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) count += std::abs(gap(formation.discs[i], formation.discs[j])) < 1e-9 ? 1 : 0;
  }
  return count;
}

/// Discs that hang together by contacts with the first one.
std::size_t connected(const Formation& formation) {
  std::vector<std::size_t> reached{0};
  for (std::size_t next = 0; next < reached.size(); ++next) {
    for (std::size_t i = 0; i < formation.discs.size(); ++i) {
      const bool known = std::find(reached.begin(), reached.end(), i) != reached.end();
      if (!known && std::abs(gap(formation.discs[i], formation.discs[reached[next]])) < 1e-9) reached.push_back(i);
    }
  }
  return reached.size();
}

std::string error_of(const std::string& spec) {
  try {
    (void)load_formation(spec, cell());
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

/// The error of a file with the given text.
std::string error_of_file(const std::string& text) {
  const std::filesystem::path file =
      std::filesystem::path{testing::TempDir()} / ("breakshot_" + std::to_string(getpid()) + "_formation.yaml");
  std::ofstream{file} << text;
  std::string message = "no error";
  try {
    (void)load_formation_file(file, cell());
  } catch (const ConfigError& error) {
    message = error.what();
  }
  std::filesystem::remove(file);
  return message;
}

TEST(Formation, ThePapersFormationsTouchWhereTheyShould) {
  const std::map<std::string, std::pair<std::size_t, int>> expected{{"A", {2, 1}},     {"B", {3, 3}},     {"C", {4, 5}},
                                                                    {"D", {5, 6}},     {"E", {6, 9}},     {"F", {6, 8}},
                                                                    {"fig11", {6, 7}}, {"fig12", {6, 7}}, {"fig13", {6, 7}}};
  std::vector<std::string> names;
  for (const auto& [name, shape] : expected) {
    const Formation formation = load_formation(name, cell());
    EXPECT_EQ(formation.name, name);
    EXPECT_FALSE(formation.description.empty());
    EXPECT_EQ(formation.discs.size(), shape.first) << name;
    EXPECT_EQ(contacts(formation), shape.second) << name;
    // The cue disc of Fig. 11 stands apart.
    EXPECT_EQ(connected(formation), name == "fig11" ? 1U : shape.first) << name;
    std::vector<int> colours;
    for (const FormationDisc& disc : formation.discs) colours.push_back(disc.colour);
    std::sort(colours.begin(), colours.end());
    EXPECT_EQ(std::adjacent_find(colours.begin(), colours.end()), colours.end())
        << name << ": the paper's method tells discs apart by colour";
    names.push_back(name);
  }
  EXPECT_THAT(formation_names(cell()), ::testing::ContainerEq(names));
}

TEST(Formation, NamesHaveNoRegardToCase) {
  EXPECT_EQ(load_formation("a", cell()).name, "A");
  EXPECT_EQ(load_formation("FIG11", cell()).name, "fig11");
}

TEST(Formation, RefusesAnUnknownName) {
  EXPECT_THAT(error_of("fig14"), AllOf(HasSubstr("formation \"fig14\": found no such file in "), HasSubstr("A, B, C, D, E, F, fig11")));
  EXPECT_THAT(error_of("../cell"), HasSubstr("found no such file"));
  EXPECT_THAT(error_of(""), HasSubstr("found no such file"));
}

TEST(Formation, RefusesBadFilesWithLineAndDiscs) {
  const std::string head = "formation:\n  description: test\n  discs:\n";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"    - {colour: red, radius: 0.03, p_WD: [0, 0]}\n    - {colour: blue, radius: 0.03, p_WD: [0.05, 0]}\n",
       ":5: formation.discs[1].p_WD: found discs 0 and 1 overlapping by 10 mm; allowed: discs that touch at most; their centres must be "
       "0.06 m"},
      {"    - {colour: red, radius: 0.03, p_WD: [0.4, 0]}\n",
       ":4: formation.discs[0].p_WD: found disc 0 at (0.4, 0) m, out of the workspace; allowed: a centre between (-0.3, -0.3) m"},
      {"    - {colour: red, radius: 0.3, p_WD: [0, 0]}\n",
       ":4: formation.discs[0].radius: found 0.3 m; allowed: a radius in [0.015, 0.06] m"},
      {"    - {colour: red, radius: -0.03, p_WD: [0, 0]}\n", ":4: formation.discs[0].radius: found -0.03 m"},
      {"    - {colour: rad, radius: 0.03, p_WD: [0, 0]}\n", ":4: formation.discs[0].colour: found rad; allowed: red, amber"},
      {"    - {colour: red, radius: .nan, p_WD: [0, 0]}\n", ":4: formation.discs[0].radius: found .nan; allowed: a number m"},
      {"    - {colour: red, radius: 0.03, p_WD: [0, .inf]}\n", ":4: formation.discs[0].p_WD[1]: found .inf"},
      {"    - {colour: red, radius: 0.03, p_WD: [0, 0], mass: 1}\n", ":4: formation.discs[0].mass: found an unknown key"},
      {"    - {colour: red, p_WD: [0, 0]}\n", ":4: formation.discs[0].radius: found no such key"},
      {"    []\n", ":3: formation.discs: found 0 discs; allowed: 1 to 64 discs"},
      {"    nothing\n", ":3: formation.discs: found nothing; allowed: a list of maps"},
  };
  for (const auto& [discs, expected] : cases) EXPECT_THAT(error_of_file(head + discs), HasSubstr(expected)) << discs;
  std::string many = head;
  for (int i = 0; i < 65; ++i) many += "    - {colour: red, radius: 0.015, p_WD: [0, 0]}\n";
  EXPECT_THAT(error_of_file(many), HasSubstr(":3: formation.discs: found 65 discs; allowed: 1 to 64 discs"));
  EXPECT_THAT(error_of_file(head + "    - {colour: red, radius: 0.03, p_WD: [0, 0]}\nspare: 1\n"),
              HasSubstr(":5: spare: found an unknown key"));
}

TEST(Formation, AllowsContactUpToRounding) {
  Formation formation{"f", "d", {{{0, 0}, 0.03, 0}, {{0.06 - 0.9e-6, 0}, 0.03, 1}}};
  EXPECT_NO_THROW(check_formation(formation, cell(), "here"));
  formation.discs[1].p_WD.x() = 0.06 - 1.1e-6;
  EXPECT_THROW(check_formation(formation, cell(), "here"), ConfigError);
}

TEST(Formation, RefusesBadSpecs) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"random:", "formation \"random:\": n: found no such key; allowed: a whole number in [1, 64]"},
      {"random:n=six", "n: found six; allowed: a whole number in [1, 64]"},
      {"random:n=6.5", "n: found 6.5"},
      {"random:n=0", "n: found 0"},
      {"random:n=65", "n: found 65"},
      {"random:n=-1", "n: found -1"},
      {"random:n=6,n=7", "n: found the key a second time"},
      {"random:n=6,sede=7", "sede: found an unknown key; allowed: n, seed, rmin, rmax, compact (did you mean seed?)"},
      {"random:n=6,seed=-1", "seed: found -1"},
      {"random:n=6,rmin=nan", "rmin: found nan; allowed: a number in [0.015, 0.06]"},
      {"random:n=6,rmax=inf", "rmax: found inf"},
      {"random:n=6,rmin=0.05,rmax=0.02", "rmin: found a value above rmax"},
      {"random:n=6,compact=2", "compact: found 2; allowed: a number in [0, 1]"},
      {"random:n=6,,seed=1", "found \"\"; allowed: key=value"},
      {"random:n", "found \"n\"; allowed: key=value"},
      {"random:n=64,rmin=0.06,rmax=0.06", "found discs that do not fit into the workspace"},
  };
  for (const auto& [spec, expected] : cases) EXPECT_THAT(error_of(spec), HasSubstr(expected)) << spec;
}

/// A cluster of every size: connected, touching, inside, without overlap, and of the asked radii.
TEST(RandomCluster, IsATouchingClusterInsideTheWorkspace) {
  for (const double compact : {0.0, 0.5, 1.0}) {
    for (int n = 1; n <= 15; ++n) {
      for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const RandomCluster wanted{n, seed, 0.015, 0.03, compact};
        const Formation formation = random_cluster(wanted, cell());
        ASSERT_EQ(formation.discs.size(), static_cast<std::size_t>(n));
        EXPECT_EQ(connected(formation), formation.discs.size()) << "n " << n << " seed " << seed;
        for (const FormationDisc& disc : formation.discs) {
          EXPECT_GE(disc.radius, 0.015);
          EXPECT_LE(disc.radius, 0.03);
          EXPECT_GE(cell().workspace.margin(disc.p_WD), disc.radius);
        }
        EXPECT_NO_THROW(check_formation(formation, cell(), "here"));
      }
    }
  }
}

TEST(RandomCluster, CompactOnesHaveMoreContactsThanChains) {
  int packed = 0;
  int chained = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    packed += contacts(random_cluster({8, seed, 0.03, 0.03, 1.0}, cell()));
    chained += contacts(random_cluster({8, seed, 0.03, 0.03, 0.0}, cell()));
  }
  EXPECT_GE(packed, 50 * 13);  // each disc after the second brings two contacts: 1 + 6 * 2
  EXPECT_LE(chained, 50 * 8);  // a chain of eight has seven
}

/// Frozen on purpose: benchmarks and held-out seeds name clusters by their numbers alone.
TEST(RandomCluster, IsTheSameForever) {
  const Formation formation = load_formation("random:n=6,seed=3", cell());
  const Formation again = load_formation("random:n=6,seed=3,rmin=0.03,rmax=0.03,compact=0.8", cell());
  const Formation other = load_formation("random:n=6,seed=4", cell());
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(formation.discs[i].p_WD, again.discs[i].p_WD);
    EXPECT_EQ(formation.discs[i].colour, again.discs[i].colour);
  }
  EXPECT_NE(formation.discs[2].p_WD, other.discs[2].p_WD);
  EXPECT_EQ(formation.discs[5].p_WD, Vector2(-0x1.aeff9a12a19f7p-5, 0x1.54c5c40864f5cp-5));
  EXPECT_EQ(formation.discs[5].colour, 2);
  SplitMix64 random{1234567};
  EXPECT_EQ(random.next(), 6457827717110365317U);  // the reference implementation's first two for this seed
  EXPECT_EQ(random.next(), 3203168211198807973U);
}

TEST(Jitter, OpensContactsByUpToTheGap) {
  SplitMix64 random{5};
  double largest = 0.0;
  for (const std::string& name : formation_names(cell())) {
    const Formation before = load_formation(name, cell());
    for (int i = 0; i < 200; ++i) {
      Formation after = before;
      jitter(after, random, 0.5e-3);
      for (std::size_t a = 0; a < before.discs.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
          const double opened = gap(after.discs[a], after.discs[b]) - gap(before.discs[a], before.discs[b]);
          EXPECT_GE(opened, -1e-12);
          if (gap(before.discs[a], before.discs[b]) > 1e-9) continue;
          EXPECT_LE(opened, 0.5e-3);
          largest = std::max(largest, opened);
        }
      }
    }
  }
  EXPECT_GT(largest, 0.4e-3);
}

TEST(Jitter, OfZeroChangesNothing) {
  SplitMix64 random{5};
  const Formation before = load_formation("E", cell());
  Formation after = before;
  jitter(after, random, 0.0);
  for (std::size_t i = 0; i < before.discs.size(); ++i) EXPECT_EQ(before.discs[i].p_WD, after.discs[i].p_WD);
}

TEST(SplitMix64, IsUniform) {
  SplitMix64 random{42};
  double sum = 0.0;
  double squares = 0.0;
  double normal_squares = 0.0;
  constexpr int kDraws = 100'000;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.uniform();
    ASSERT_GE(x, 0.0);
    ASSERT_LT(x, 1.0);
    sum += x;
    squares += x * x;
    const double z = random.normal();
    normal_squares += z * z;
  }
  EXPECT_NEAR(sum / kDraws, 0.5, 0.005);
  EXPECT_NEAR(squares / kDraws, 1.0 / 3.0, 0.005);
  EXPECT_NEAR(normal_squares / kDraws, 1.0, 0.02);
}

}  // namespace
}  // namespace breakshot
