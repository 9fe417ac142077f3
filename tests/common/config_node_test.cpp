#include "common/config/config_node.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace breakshot {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

ConfigDocument parse(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return ConfigDocument::parse(text, "config/test.yaml", overrides);
}

/// The message of the ConfigError that `action` throws.
template <typename Action>
std::string error_of(Action action) {
  try {
    action();
  } catch (const ConfigError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no ConfigError";
  return {};
}

const std::string kGood = R"(
planner:
  gap: 0.015
  tries: 12
  quick: true
  name: paper
  start: [0.1, -0.2]
  axis: [0, 0, 1]
  inner:
    depth: 3
  list:
    - {p: 1}
    - {p: 2}
)";

TEST(ConfigNode, ReadsEveryKindOfValue) {
  const ConfigDocument document = parse(kGood);
  const ConfigNode node = document.section("planner");
  EXPECT_EQ(node.number("gap", {0, 1}, "m"), 0.015);
  EXPECT_EQ(node.integer("tries", 1, 100), 12);
  EXPECT_TRUE(node.flag("quick"));
  EXPECT_EQ(node.text("name"), "paper");
  EXPECT_EQ(node.choice("name", {"paper", "random_push"}), "paper");
  EXPECT_EQ(node.vector2("start", {-1, 1}), Vector2(0.1, -0.2));
  EXPECT_EQ(node.vector3("axis", {-1, 1}, ""), Vector3(0, 0, 1));
  EXPECT_EQ(node.child("inner").integer("depth", 0, 5), 3);
  const auto items = node.items("list");
  ASSERT_EQ(items.size(), 2U);
  EXPECT_EQ(items[1].integer("p", 0, 9), 2);
  EXPECT_EQ(items[0].integer("p", 0, 9), 1);
  EXPECT_NO_THROW(node.finish());
}

TEST(ConfigNode, ErrorsNamePlaceKeyFoundAndAllowed) {
  const ConfigDocument document = parse(kGood);
  const ConfigNode node = document.section("planner");
  EXPECT_EQ(error_of([&] {
              node.number("gap", {0.1, 1}, "m");
            }),
            "config/test.yaml:3: planner.gap: found 0.015; allowed: a number in [0.1, 1] m");
  EXPECT_EQ(error_of([&] { node.integer("tries", 1, 5); }),
            "config/test.yaml:4: planner.tries: found 12; allowed: a whole number in [1, 5]");
  EXPECT_EQ(error_of([&] { node.flag("name"); }), "config/test.yaml:6: planner.name: found paper; allowed: true or false");
  EXPECT_EQ(error_of([&] { node.child("inner").text("wrong"); }),
            "config/test.yaml:9: planner.inner.wrong: found no such key; allowed: a text");
  EXPECT_EQ(error_of([&] {
              node.items("list")[1].number("p", {5, 9}, "");
            }),
            "config/test.yaml:13: planner.list[1].p: found 2; allowed: a number in [5, 9]");
  EXPECT_EQ(error_of([&] {
              node.choice("name", {"papers", "random_push"});
            }),
            "config/test.yaml:6: planner.name: found paper; allowed: papers, random_push (did you mean papers?)");
  EXPECT_EQ(error_of([&] {
              node.vector3("start", {-1, 1});
            }),
            "config/test.yaml:7: planner.start: found a list of 2; allowed: a list of 3, each a number in [-1, 1] m");
  EXPECT_EQ(error_of([&] {
              node.vector2("start", {0, 1});
            }),
            "config/test.yaml:7: planner.start[1]: found -0.2; allowed: a number in [0, 1] m");
  EXPECT_EQ(error_of([&] { node.child("gap"); }), "config/test.yaml:3: planner.gap: found 0.015; allowed: a map of keys");
  EXPECT_EQ(error_of([&] { node.refuse("inner", "this", "that"); }), "config/test.yaml:9: planner.inner: found this; allowed: that");
  EXPECT_EQ(error_of([&] { (void)document.section("plan"); }), "config/test.yaml:2: plan: found no such key; allowed: a map of keys");
}

TEST(ConfigNode, RefusesWhatIsNoFiniteNumber) {
  for (const std::string found : {"nan", ".nan", ".NaN", "-nan", "inf", ".inf", "-.inf", "1e999", "0x10", "1,5", "1.5m", "\"1.5\"", "one",
                                  "+1", "~", "[]", "{}", "1 2", "true"}) {
    const ConfigDocument document = parse("a: " + found);
    EXPECT_THROW((void)document.root().number("a", {}, ""), ConfigError) << found;
    EXPECT_THROW((void)document.root().integer("a", -100, 100), ConfigError) << found;
  }
  for (const std::string found : {"1.0", "1e2", "99999999999999999999"}) {
    const ConfigDocument document = parse("a: " + found);
    EXPECT_THROW((void)document.root().integer("a", -100, 100), ConfigError) << found;
  }
  for (const std::string found : {"True", "yes", "on", "1", "\"true\"", "~"}) {
    const ConfigDocument document = parse("a: " + found);
    EXPECT_THROW((void)document.root().flag("a"), ConfigError) << found;
  }
}

TEST(ConfigNode, FinishNamesTheUnknownKeyAndTheNearestKnownOne) {
  const ConfigDocument document = parse("s:\n  gap: 1\n  tries: 2\n  trise: 3\n");
  const ConfigNode node = document.section("s");
  (void)node.number("gap", {}, "");
  (void)node.integer("tries", 0, 9);
  EXPECT_EQ(error_of([&] { node.finish(); }),
            "config/test.yaml:4: s.trise: found an unknown key; allowed: gap, tries (did you mean tries?)");
}

TEST(ConfigNode, FinishLooksIntoMapsAndLists) {
  const ConfigDocument in_map = parse("s:\n  a: {b: 1,\n      c: 2}\n");
  (void)in_map.section("s").child("a").integer("b", 0, 9);
  EXPECT_THAT(error_of([&] { in_map.section("s").finish(); }), HasSubstr("config/test.yaml:3: s.a.c: found an unknown key; allowed: b"));
  const ConfigDocument in_list = parse("s:\n  a:\n    - {b: 1}\n    - {b: 1, c: 2}\n");
  for (const ConfigNode& item : in_list.section("s").items("a")) (void)item.integer("b", 0, 9);
  EXPECT_THAT(error_of([&] { in_list.section("s").finish(); }), HasSubstr("config/test.yaml:4: s.a[1].c: found an unknown key"));
}

TEST(ConfigNode, HasMakesAKeyOptional) {
  const ConfigDocument document = parse("s: {a: 1}");
  const ConfigNode node = document.section("s");
  EXPECT_TRUE(node.has("a"));
  EXPECT_FALSE(node.has("b"));
  EXPECT_NO_THROW(node.finish());
}

TEST(ConfigNode, PathsCountFromTheFolderOfTheFile) {
  const ConfigDocument document = parse("a: x/y.urdf\nb: /tmp\nc: ../z");
  EXPECT_EQ(document.root().path("a"), "config/x/y.urdf");
  EXPECT_EQ(document.root().folder("b"), "/tmp");
  EXPECT_EQ(document.root().path("c"), "z");
  EXPECT_EQ(error_of([&] { (void)document.root().file("a"); }),
            "config/test.yaml:1: a: found config/x/y.urdf, which is not there; allowed: the path of a file");
  EXPECT_THROW((void)document.root().folder("a"), ConfigError);
  EXPECT_THROW((void)document.root().file("b"), ConfigError);
}

TEST(ConfigDocument, RefusesYamlThatIsNotPlain) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"a: 1\nb: 2\na: 3",
       "config/test.yaml:3: a: found the key a second time; allowed: each key once; the first is at config/test.yaml:1"},
      {"a: &x 1\nb: *x", "config/test.yaml:1: a: found an anchor (&)"},
      {"a: !!int 1", "config/test.yaml:1: a: found the tag"},
      {"a: 1\n---\nb: 2", "found a second document"},
      {"a: [1, 2", "malformed YAML"},
      {"a:\n\t- 1", "config/test.yaml:2: found malformed YAML"},
      {"- 1\n- 2", "config/test.yaml:1: found a list of 2; allowed: a map of keys"},
      {"", "found nothing"},
      {"just a text", "found just a text"},
      {"a.b: 1", "config/test.yaml:1: found the key \"a.b\""},
      {"? [1]\n: 2", "found a list or a map as a key"},
      {"~: 2", "found"},
      {"a: " + std::string(40, '[') + std::string(40, ']'), "found more than 16 levels"},
      {"a: " + std::string(100000, '['), "a bracket that is never closed"},
      {std::string("a: 1\0", 5), "found a zero byte"},
  };
  for (const auto& [text, expected] : cases) {
    EXPECT_THAT(error_of([&] { (void)parse(text); }), HasSubstr(expected)) << text.substr(0, 40);
  }
  EXPECT_THAT(error_of([] { (void)ConfigDocument::load("/nowhere/cell.yaml"); }), HasSubstr("/nowhere/cell.yaml: found no such file"));
  EXPECT_THAT(error_of([] { (void)ConfigDocument::load("/tmp"); }), HasSubstr("/tmp: found no such file"));
}

TEST(ConfigDocument, RefusesAnAlias) {
  // yaml-cpp itself refuses an alias without an anchor, and we the anchor.
  EXPECT_THROW((void)parse("a: *x"), ConfigError);
}

TEST(ConfigDocument, OnlyListedSectionsMayBeThere) {
  const ConfigDocument document = parse("cell: {}\nplaner: {}\n");
  const std::vector<std::string_view> names{"cell", "planner"};
  EXPECT_EQ(error_of([&] { document.only_sections(names); }),
            "config/test.yaml:2: planer: found an unknown section; allowed: cell, planner (did you mean planner?)");
}

TEST(ConfigDocument, OverridesReplaceValues) {
  const ConfigDocument document =
      parse(kGood, {"planner.gap=0.02", "planner.inner.depth=4", "planner.start=[1, 2]", "planner.name=x=y", "planner.gap=0.03"});
  const ConfigNode node = document.section("planner");
  EXPECT_EQ(node.number("gap", {0, 1}, "m"), 0.03);  // the later one
  EXPECT_EQ(node.child("inner").integer("depth", 0, 9), 4);
  EXPECT_EQ(node.vector2("start", {0, 9}), Vector2(1, 2));
  EXPECT_EQ(node.text("name"), "x=y");
  EXPECT_EQ(node.integer("tries", 0, 99), 12);  // the rest stays
}

TEST(ConfigDocument, OverrideErrorsNameTheCommandLine) {
  const ConfigDocument document = parse(kGood, {"planner.gap=nan"});
  EXPECT_EQ(error_of([&] {
              (void)document.section("planner").number("gap", {0, 1}, "m");
            }),
            "--set: planner.gap: found nan; allowed: a number in [0, 1] m");
  EXPECT_EQ(error_of([] { (void)parse(kGood, {"planner.gab=1"}); }),
            "--set: planner.gab: found an unknown key; allowed: gap, tries, quick, name, start, axis, inner, list (did you mean gap?)");
  EXPECT_THAT(error_of([] { (void)parse(kGood, {"planer.gap=1"}); }),
              HasSubstr("--set: planer.gap: found an unknown key; allowed: planner"));
  EXPECT_THAT(error_of([] { (void)parse(kGood, {"planner.gap.x=1"}); }), HasSubstr("found planner.gap, which holds 0.015"));
  EXPECT_THAT(error_of([] { (void)parse(kGood, {"planner.list.0=1"}); }), HasSubstr("found planner.list, which holds a list of 2"));
  EXPECT_THAT(error_of([] { (void)parse(kGood, {"planner.gap"}); }), HasSubstr("--set: found \"planner.gap\"; allowed: section.key=value"));
  EXPECT_THAT(error_of([] { (void)parse(kGood, {"=1"}); }), HasSubstr("section.key=value"));
  EXPECT_THAT(error_of([] { (void)parse(kGood, {"planner.gap="}); }), HasSubstr("--set: planner.gap: found nothing"));
  EXPECT_THAT(error_of([] { (void)parse(kGood, {"planner..gap=1"}); }), HasSubstr("found an unknown key"));
  EXPECT_THAT(error_of([] { (void)parse(kGood, {"planner.gap=[1"}); }),
              HasSubstr("--set: planner.gap: found a list or a map as a key (or a bracket that is never closed)"));
}

/// Damages a good file at random places: it either still reads or throws ConfigError, and never anything else.
TEST(ConfigDocument, DamagedFilesThrowOnlyConfigErrors) {
  std::mt19937 random{7};
  const std::string alphabet = "abc019.-+:{}[],&*!|>'\"%@`#?~\n\t \\=\x01\x80\xff";
  for (int i = 0; i < 5'000; ++i) {
    std::string text = kGood;
    const auto edits = 1 + random() % 4;
    for (unsigned e = 0; e < edits; ++e) {
      const std::size_t at = random() % text.size();
      const char c = alphabet[random() % alphabet.size()];
      switch (random() % 3) {
        case 0: text[at] = c; break;
        case 1: text.insert(at, 1, c); break;
        default: text.erase(at, 1 + random() % 5); break;
      }
    }
    try {
      const ConfigDocument document = parse(text);
      const ConfigNode node = document.section("planner");
      (void)node.number("gap", {0, 1}, "m");
      (void)node.vector2("start", {-1, 1});
      (void)node.child("inner");
      (void)node.items("list");
      node.finish();
    } catch (const ConfigError& error) {
      EXPECT_THAT(error.what(), HasSubstr("config/test.yaml")) << text;
      EXPECT_THAT(error.what(), HasSubstr("; allowed: ")) << text;
    }
  }
}

}  // namespace
}  // namespace breakshot
