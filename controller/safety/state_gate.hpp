#pragma once

#include "controller/safety/joint_setpoint.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace breakshot::safety {

/// What is wrong with a joint state. A state with any of these is not used at all: for the controller it never came.
enum class StateFlaw : std::uint8_t {
  kNone = 0,
  kWrongJoints = 1,  ///< another number of joints than the arm's
  kNotFinite = 2,    ///< NaN or infinity in q, qd or tau
  kOutOfRange = 3,   ///< a position or speed that the arm cannot have
  kOldSession = 4,   ///< of a session that has been replaced
  kDuplicate = 5,    ///< seq of the newest one again
  kReordered = 6,    ///< seq or stamp before the newest one's
  kLate = 7,         ///< too old when it came
  kFromFuture = 8,   ///< stamped after now
};
inline constexpr std::size_t kStateFlaws = 9;

/// What the gate allows.
struct StateLimits {
  JointLimits joints;
  double position_margin = 0.2;  ///< beyond the joint range that a measured position may lie, rad (drives overshoot, encoders have offsets)
  double speed_factor = 2.0;     ///< of the joint's maximum speed that a measured one may reach
  Duration max_age = std::chrono::milliseconds{10};  ///< of the stamp
  Duration max_ahead =
      std::chrono::milliseconds{5};  ///< of the stamp: `now` is the loop's grid instant, up to a late wake-up behind the clock
};

/// The door for joint states: judges every one before anything else sees it.
class StateGate {
 public:
  struct Verdict {
    StateFlaw flaw = StateFlaw::kNone;
    bool new_session = false;  ///< the drives restarted: the first good state of another session
  };

  explicit StateGate(const StateLimits& limits) noexcept : limits_{limits} {}

  /// Cost: no allocation, about 20 ns.
  Verdict judge(const JointState& state, Time now) noexcept;

  /// How often each flaw was met, by StateFlaw; [kNone] counts the good ones.
  const std::array<std::uint64_t, kStateFlaws>& counts() const noexcept { return counts_; }

 private:
  StateFlaw flaw_of(const JointState& state, Time now) const noexcept;

  StateLimits limits_;
  bool any_ = false;
  std::uint64_t session_ = 0;
  std::uint64_t previous_session_ = 0;
  bool has_previous_session_ = false;
  std::uint64_t seq_ = 0;
  Time stamp_{};
  std::array<std::uint64_t, kStateFlaws> counts_{};
};

const char* to_string(StateFlaw flaw) noexcept;

}  // namespace breakshot::safety
