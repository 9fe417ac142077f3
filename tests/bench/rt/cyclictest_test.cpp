#include "tests/bench/rt/cyclictest.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace breakshot::bench {
namespace {

// As cyclictest 2.40 writes it, without what is not read.
const char* const kReport = R"({"file_version": 1, "return_code": 0, "num_threads": 1,
  "thread": {"0": {"histogram": {"13": 1, "14": 4, "25": 990, "142": 4}, "cycles": 1000, "min": 13, "max": 250000, "avg": 25.41, "cpu": 1}}})";

TEST(LatencyCounts, ReadsAReportAndCountsWhatIsBeyondTheLastBin) {
  const LatencyCounts counts{nlohmann::json::parse(kReport)};
  EXPECT_EQ(counts.count(), 1000U);
  EXPECT_EQ(counts.max_us(), 250000.0);
  EXPECT_EQ(counts.quantile_us(0.0), 14.0);
  EXPECT_EQ(counts.quantile_us(0.5), 26.0);
  EXPECT_EQ(counts.quantile_us(0.995), 26.0) << "995 of 1000 are at most there";
  EXPECT_EQ(counts.quantile_us(0.996), 143.0);
  EXPECT_EQ(counts.quantile_us(0.999), 143.0);
  EXPECT_EQ(counts.quantile_us(1.0), 250001.0);
}

TEST(LatencyCounts, RefusesAnotherReport) {
  for (const char* const text :
       {"{}", R"({"thread": {"0": {}}})", R"({"thread": {"0": {"histogram": {"x": 1}, "cycles": 1, "max": 1}}})", "7"})
    EXPECT_THROW(LatencyCounts{nlohmann::json::parse(text)}, std::runtime_error) << text;
}

// Against sorting, for merged reports.
TEST(LatencyCounts, QuantileIsTheUpperEndOfItsBin) {
  std::mt19937 random{1};
  for (int round = 0; round < 100; ++round) {
    std::vector<double> truth;
    LatencyCounts merged;
    for (int part = 0; part < 3; ++part) {
      nlohmann::json histogram = nlohmann::json::object();
      double largest = 0.0;
      const auto count = 1 + random() % 500;
      for (std::size_t i = 0; i < count; ++i) {
        const double us = std::exp(std::uniform_real_distribution{1.0, 8.0}(random));
        truth.push_back(us);
        largest = std::max(largest, us);
        auto& bin = histogram[std::to_string(static_cast<int>(us))];
        bin = bin.is_null() ? 1 : bin.get<int>() + 1;
      }
      merged.merge(LatencyCounts{{{"thread", {{"0", {{"histogram", histogram}, {"cycles", count}, {"max", static_cast<int>(largest)}}}}}}});
    }
    std::sort(truth.begin(), truth.end());
    ASSERT_EQ(merged.count(), truth.size());
    for (const double p : {0.0, 0.5, 0.9, 0.99, 0.999, 1.0}) {
      const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(p * static_cast<double>(truth.size()))));
      EXPECT_EQ(merged.quantile_us(p), std::floor(truth[rank - 1]) + 1.0) << "p = " << p;
    }
  }
}

TEST(LatencyCounts, OfNothingAreZero) {
  EXPECT_EQ(LatencyCounts{}.count(), 0U);
  EXPECT_EQ(LatencyCounts{}.quantile_us(0.99), 0.0);
}

}  // namespace
}  // namespace breakshot::bench
