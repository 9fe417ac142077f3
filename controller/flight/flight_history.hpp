#pragma once

#include "controller/flight/flight_record.hpp"
#include "controller/loop/flight_tap.hpp"
#include "controller/motion/trajectory.hpp"

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace breakshot::control::flight {

/// The last seconds of the loop, as they come out of its tap, and the decision what of them is worth a record.
///
/// A stop, a refusal or a fault asks for a record of the two seconds before it and the half second after it, in which the arm comes to rest. What else
/// happens in that half second is in the same record. Of several reasons the gravest names it.
class FlightHistory {
 public:
  FlightHistory(const LoopConfig& config, FlightTap& tap);

  /// Copies a trajectory that is about to be handed to the loop. Any thread but the real-time one; costs its 2.8 MB.
  void remember(std::uint64_t number, const motion::Trajectory& trajectory);
  /// Something outside of the loop asks for a record. Any thread but the real-time one.
  void note(Trigger trigger, const std::string& why);

  /// Takes what has come since the last call. Writer thread, every some 10 ms.
  void drain();
  /// A record is asked for, whether complete or not. Writer thread.
  bool pending() const noexcept { return pending_.has_value(); }
  /// The record that was asked for, once it is complete; at once if `incomplete` will do. Writer thread.
  std::optional<FlightRecord> take(bool incomplete);

  /// Ticks that were lost because nobody called drain().
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  struct Pending {
    Trigger trigger;
    std::string why;
    std::uint64_t tick;
  };

  void look(const TickRecord& tick);
  void ask(Trigger trigger, std::string why, std::uint64_t tick);
  void forget_old();
  /// Trajectories below this number cannot be needed any more.
  std::uint64_t first_needed() const;

  LoopConfig config_;
  FlightTap& tap_;
  std::uint64_t ticks_before_;
  std::uint64_t ticks_after_;

  std::deque<TickRecord> ticks_;                   ///< without a gap
  std::deque<Keyframe> keyframes_;                 ///< the first is at or before ticks_.front(), unless there is none yet
  safety::Action action_ = safety::Action::kHold;  ///< of the newest tick
  std::uint64_t newest_started_ = 0;
  std::uint64_t lost_ = 0;
  std::optional<Pending> pending_;

  std::mutex mutex_;  ///< over what follows
  std::map<std::uint64_t, std::shared_ptr<const motion::Trajectory>> trajectories_;
  std::optional<Pending> noted_;
};

}  // namespace breakshot::control::flight
