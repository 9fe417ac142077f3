#include "controller/rt/histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace breakshot::rt {
namespace {

/// Spans over many orders of magnitude, as latencies are.
std::vector<std::int64_t> random_spans(std::mt19937& random, std::size_t count) {
  std::uniform_real_distribution exponent{0.0, 10.5};
  std::vector<std::int64_t> spans(count);
  for (auto& span : spans) span = static_cast<std::int64_t>(std::pow(10.0, exponent(random)));
  return spans;
}

TEST(Histogram, QuantileIsNeverBelowTheTruthAndAtMostOneBinAboveIt) {
  std::mt19937 random{1};
  for (int round = 0; round < 200; ++round) {
    auto spans = random_spans(random, 1 + random() % 2000);
    Histogram histogram;
    for (const auto span : spans) histogram.record(Duration{span});
    std::sort(spans.begin(), spans.end());
    ASSERT_EQ(histogram.count(), spans.size());
    EXPECT_EQ(histogram.max().count(), spans.back());
    for (const double p : {0.0, 0.01, 0.5, 0.9, 0.99, 0.999, 1.0}) {
      const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(p * static_cast<double>(spans.size()))));
      const std::int64_t truth = spans[rank - 1];
      const std::int64_t found = histogram.quantile(p).count();
      EXPECT_GE(found, truth) << "p = " << p;
      EXPECT_LE(found, truth + truth / 32) << "p = " << p;
    }
  }
}

TEST(Histogram, QuantileRisesWithP) {
  std::mt19937 random{2};
  Histogram histogram;
  for (const auto span : random_spans(random, 5000)) histogram.record(Duration{span});
  Duration last{};
  for (int i = 0; i <= 1000; ++i) {
    const Duration quantile = histogram.quantile(i / 1000.0);
    EXPECT_GE(quantile, last);
    last = quantile;
  }
  EXPECT_EQ(last, histogram.max());
}

TEST(Histogram, MergingIsRecordingBoth) {
  std::mt19937 random{3};
  Histogram a, b, both;
  for (const auto span : random_spans(random, 3000)) {
    (span % 2 == 0 ? a : b).record(Duration{span});
    both.record(Duration{span});
  }
  a.merge(b);
  EXPECT_EQ(a.count(), both.count());
  EXPECT_EQ(a.max(), both.max());
  EXPECT_EQ(a.mean(), both.mean());
  for (int i = 0; i <= 100; ++i) EXPECT_EQ(a.quantile(i / 100.0), both.quantile(i / 100.0));
}

TEST(Histogram, HoldsAtTheEdges) {
  Histogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), Duration::zero());
  EXPECT_EQ(histogram.mean(), Duration::zero());
  histogram.record(Duration{-5});
  EXPECT_EQ(histogram.quantile(1.0), Duration::zero()) << "a negative span counts as zero";
  const Duration hours = std::chrono::hours{5};
  histogram.record(hours);
  EXPECT_EQ(histogram.quantile(1.0), hours) << "beyond the last bin the maximum is still exact";
  EXPECT_EQ(histogram.quantile(std::nan("")), Duration::zero());
  EXPECT_EQ(histogram.quantile(7.0), hours);
  histogram.clear();
  EXPECT_EQ(histogram.count(), 0U);
}

}  // namespace
}  // namespace breakshot::rt
