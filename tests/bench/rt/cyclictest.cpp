#include "tests/bench/rt/cyclictest.hpp"

#include "tests/bench/rt/child_program.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace breakshot::bench {

namespace {

/// Bins up to here, us; what is longer is counted by the difference.
constexpr int kLongestBin = 100'000;

}  // namespace

LatencyCounts::LatencyCounts(const nlohmann::json& report) {
  try {
    for (const auto& [thread, figures] : report.at("thread").items()) {
      for (const auto& [us, count] : figures.at("histogram").items()) bins_[std::stoll(us)] += count.get<std::uint64_t>();
      count_ += figures.at("cycles").get<std::uint64_t>();
      max_us_ = std::max(max_us_, figures.at("max").get<std::int64_t>());
    }
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("cyclictest's report is not understood: {}", error.what()));
  }
}

void LatencyCounts::merge(const LatencyCounts& other) {
  for (const auto& [us, count] : other.bins_) bins_[us] += count;
  count_ += other.count_;
  max_us_ = std::max(max_us_, other.max_us_);
}

double LatencyCounts::quantile_us(double p) const noexcept {
  if (count_ == 0) return 0.0;
  const double rank = std::max(1.0, std::ceil(p * static_cast<double>(count_)));
  double seen = 0.0;
  for (const auto& [us, count] : bins_) {
    seen += static_cast<double>(count);
    if (seen >= rank) return static_cast<double>(us + 1);
  }
  return static_cast<double>(max_us_ + 1);
}

LatencyCounts run_cyclictest(const LatencySettings& settings, Duration span) {
  const auto file = std::filesystem::temp_directory_path() / fmt::format("breakshot-cyclictest-{}.json", getpid());
  // --mlockall as the controller does. Its other defaults are in its favour: it also asks the processor not to sleep deeply (/dev/cpu_dma_latency).
  ChildProgram program{
      "cyclictest",
      "rt-tests",
      {"--quiet", "--mlockall", "--policy=fifo", fmt::format("--priority={}", settings.priority),
       fmt::format("--affinity={}", settings.cpu), "--threads=1",
       fmt::format("--interval={}", settings.period / std::chrono::microseconds{1}), fmt::format("--loops={}", span / settings.period),
       fmt::format("--histogram={}", kLongestBin), fmt::format("--json={}", file.string())}};
  const std::string said = program.wait(span + std::chrono::seconds{30});
  std::ifstream in{file};
  const nlohmann::json report = nlohmann::json::parse(in, nullptr, false);
  std::filesystem::remove(file);
  if (report.is_discarded()) throw std::runtime_error(fmt::format("cyclictest wrote no report; it said: {}", said));
  return LatencyCounts{report};
}

}  // namespace breakshot::bench
