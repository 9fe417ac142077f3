#pragma once

#include "controller/flight/flight_files.hpp"
#include "controller/flight/flight_history.hpp"

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

namespace breakshot::control::flight {

struct RecorderSettings {
  std::filesystem::path folder;
  std::size_t files = 20;  ///< kept per trigger; 0: nothing is recorded
};

/// Empties the loop's tap in a thread of its own and writes a file for every stop, refusal and fault. The real-time thread neither waits for it nor
/// wakes it.
class FlightRecorder {
 public:
  using Stored = Result<std::filesystem::path, std::string>;

  /// @param config  the loop's
  /// @param tap     the loop's; this side of it is the recorder's alone; outlives it
  /// @param tell    called from the recorder's thread with every file that was written, or could not be, and why it was asked for
  FlightRecorder(const RecorderSettings& settings, const LoopConfig& config, FlightTap& tap,
                 std::function<void(const Stored&, const std::string& why)> tell);
  /// Writes what is asked for, complete or not.
  ~FlightRecorder();
  FlightRecorder(const FlightRecorder&) = delete;
  FlightRecorder& operator=(const FlightRecorder&) = delete;
  FlightRecorder(FlightRecorder&&) = delete;
  FlightRecorder& operator=(FlightRecorder&&) = delete;

  /// See FlightHistory.
  void remember(std::uint64_t number, const motion::Trajectory& trajectory) { history_.remember(number, trajectory); }
  void note(Trigger trigger, const std::string& why) { history_.note(trigger, why); }

 private:
  void run(const std::stop_token& stop);
  void write(bool incomplete);

  RecorderSettings settings_;
  FlightHistory history_;
  std::function<void(const Stored&, const std::string&)> tell_;
  std::jthread thread_;
};

}  // namespace breakshot::control::flight
