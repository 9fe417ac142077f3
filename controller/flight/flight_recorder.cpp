#include "controller/flight/flight_recorder.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace breakshot::control::flight {

namespace {

/// The tap holds four seconds.
constexpr auto kPoll = std::chrono::milliseconds{20};
/// A loop that has died gives no further ticks to wait for.
constexpr auto kPatience = std::chrono::seconds{2};

}  // namespace

FlightRecorder::FlightRecorder(const RecorderSettings& settings, const LoopConfig& config, FlightTap& tap,
                               std::function<void(const Stored&, const std::string&)> tell)
    : settings_{settings}, history_{config, tap}, tell_{std::move(tell)} {
  thread_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
}

FlightRecorder::~FlightRecorder() = default;

void FlightRecorder::run(const std::stop_token& stop) {
  std::mutex never;
  std::condition_variable_any poll;
  auto asked = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock{never};
      poll.wait_for(lock, stop, kPoll, [] { return false; });
    }
    history_.drain();
    if (!history_.pending()) asked = std::chrono::steady_clock::now();
    write(std::chrono::steady_clock::now() - asked > kPatience);
  }
  history_.drain();
  write(true);
}

void FlightRecorder::write(bool incomplete) {
  auto record = history_.take(incomplete);
  if (!record || settings_.files == 0) return;
  const auto utc = std::chrono::system_clock::now().time_since_epoch();
  record->written_utc_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count();
  tell_(store(settings_.folder, *record, settings_.files), record->why);
}

}  // namespace breakshot::control::flight
