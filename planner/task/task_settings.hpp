#pragma once

#include "common/time.hpp"

#include <cstdint>

namespace breakshot::task {

/// Patience of a task, all of it on the cell clock.
struct TaskSettings {
  Duration resend{std::chrono::milliseconds{200}};       ///< a request without any answer is sent again after this
  Duration controller_silence{std::chrono::seconds{3}};  ///< a controller that says nothing, or stays not ready, for this long is faulty
  Duration scene_silence{std::chrono::seconds{3}};       ///< without a usable scene for this long, the task gives up
  Duration settle_limit{std::chrono::seconds{10}};       ///< discs that do not come to rest within this will not
  double settle_speed =
      0.02;                ///< scenes whose fastest disc is slower are at rest, m/s: three times what 0.2 mm of noise look like at 30 Hz
  int settled_scenes = 2;  ///< in a row, before a scene is decided on
  int count_scenes = 6;    ///< at rest, in a row, before a wrong number of discs is believed
  bool park_first = true;  ///< begin by parking the arm: nobody knows where the last order left it
  bool plan_ahead = true;  ///< begin the next decision while the arm still moves or discs still slide ...
  /// ... once the forecast of where they come to rest is this good for every disc (standard deviation), m. A worse one would be contradicted too often,
  /// a better one comes later; the decision takes 50 to 400 ms.
  double ahead_sigma = 5e-4;
  std::uint64_t seed = 1;  ///< of random strategies; decision k of a task gets seed and k
};

}  // namespace breakshot::task
