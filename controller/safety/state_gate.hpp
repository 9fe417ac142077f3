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
  kLeap = 4,         ///< a position that the arm cannot have reached since the newest state
  kNewSession = 5,   ///< of a session that has not confirmed itself yet
  kOldSession = 6,   ///< of a session that has been replaced
  kDuplicate = 7,    ///< seq of the newest one again
  kReordered = 8,    ///< seq or stamp before the newest one's
  kLate = 9,         ///< too old when it came
  kFromFuture = 10,  ///< stamped after now
};
inline constexpr std::size_t kStateFlaws = 11;

/// What the gate allows.
struct StateLimits {
  JointLimits joints;
  double position_margin = 0.2;  ///< beyond the joint range that a measured position may lie, rad (drives overshoot, encoders have offsets)
  double speed_factor = 2.0;     ///< of the joint's maximum speed that a measured one may reach, also between two states
  double leap_margin = 0.01;     ///< on top of that between two states, rad (noise)
  int confirm_session = 5;       ///< states of another session, one after the other, that show that the drives restarted
  Duration max_age = std::chrono::milliseconds{10};  ///< of the stamp
  Duration max_ahead =
      std::chrono::milliseconds{5};  ///< of the stamp: `now` is the loop's grid instant, up to a late wake-up behind the clock
};

/// The door for joint states: judges every one before anything else sees it.
///
/// One sample must not move the arm: set-points restart from measured positions, so a position that does not follow from the ones before is
/// refused until the time that has passed makes it possible, and a session number has to come several times to be believed.
class StateGate {
 public:
  struct Verdict {
    StateFlaw flaw = StateFlaw::kNone;
    bool new_session = false;  ///< the drives restarted: the first state of another session that counts
  };

  explicit StateGate(const StateLimits& limits) noexcept : limits_{limits} {}

  /// Cost: no allocation, about 20 ns.
  Verdict judge(const JointState& state, Time now) noexcept;

  /// How often each flaw was met, by StateFlaw; [kNone] counts the good ones.
  const std::array<std::uint64_t, kStateFlaws>& counts() const noexcept { return counts_; }

  /// What it remembers, for the flight recorder.
  template <typename Self, typename Code>
  static void fields(Self& self, Code& code) {
    for (auto* newest : {&self.current_, &self.candidate_}) {
      code(newest->session, newest->seq, newest->stamp, newest->q, newest->states);
    }
    code(self.replaced_, self.any_replaced_, self.counts_);
  }

 private:
  /// The newest state of a session that was taken.
  struct Newest {
    std::uint64_t session = 0;
    std::uint64_t seq = 0;
    Time stamp{};
    JointArray q{};
    int states = 0;  ///< taken so far; 0: there is no such session. Saturates at StateLimits::confirm_session
  };

  /// What can be told from the state alone.
  StateFlaw flaw_alone(const JointState& state, Time now) const noexcept;
  /// Whether the state follows from the newest one of its session.
  StateFlaw flaw_after(const Newest& newest, const JointState& state) const noexcept;
  void take(Newest& newest, const JointState& state) const noexcept;
  Verdict judge_session(const JointState& state) noexcept;

  StateLimits limits_;
  Newest current_;
  Newest candidate_;            ///< another session that may be about to replace the current one
  std::uint64_t replaced_ = 0;  ///< session before the current one
  bool any_replaced_ = false;
  std::array<std::uint64_t, kStateFlaws> counts_{};
};

const char* to_string(StateFlaw flaw) noexcept;

}  // namespace breakshot::safety
