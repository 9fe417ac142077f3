#include "common/process/logging.hpp"

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <stdexcept>

namespace breakshot::process {

namespace {

// A burst of this many records fits before the oldest are dropped; logging must never make a cell process wait.
constexpr std::size_t kQueue = 8192;

}  // namespace

void start_logging(const std::string& process, const std::string& level) {
  const auto parsed = spdlog::level::from_str(level);
  if (parsed == spdlog::level::off && level != "off") {
    throw std::invalid_argument("--log-level: found \"" + level + "\"; allowed: trace, debug, info, warning, error, off");
  }
  spdlog::init_thread_pool(kQueue, 1);
  auto logger = std::make_shared<spdlog::async_logger>(process, std::make_shared<spdlog::sinks::stderr_sink_mt>(), spdlog::thread_pool(),
                                                       spdlog::async_overflow_policy::overrun_oldest);
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody here changes the environment
  const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  logger->set_pattern(journal ? "%l %v" : "%Y-%m-%dT%H:%M:%S.%eZ %-7l %n %v", spdlog::pattern_time_type::utc);
  logger->set_level(parsed);
  logger->flush_on(spdlog::level::warn);
  spdlog::set_default_logger(std::move(logger));
  spdlog::flush_every(std::chrono::seconds{1});
}

void stop_logging() noexcept { spdlog::shutdown(); }

}  // namespace breakshot::process
