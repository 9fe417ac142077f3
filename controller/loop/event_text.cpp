#include "controller/loop/event_text.hpp"

#include <fmt/format.h>

namespace breakshot::control {

const char* to_string(LoopEvent::Refusal refusal) noexcept {
  using Refusal = LoopEvent::Refusal;
  switch (refusal) {
    case Refusal::kNone: return "none";
    case Refusal::kBusy: return "something moves";
    case Refusal::kNotReady: return "the controller is stopped or has no fresh joint state";
    case Refusal::kBadBuffer: return "the trajectory does not fit the loop";
    case Refusal::kElsewhere: return "the trajectory does not begin where the arm is";
    case Refusal::kMissed: return "the stroke that it was to take over from is past that place, slowed down or stopped";
  }
  return "invalid";
}

std::string describe(safety::CauseSet causes) {
  std::string text;
  for (std::size_t i = 0; i < safety::kCauses; ++i) {
    const auto cause = static_cast<safety::Cause>(i);
    if (!causes.has(cause)) continue;
    if (cause == safety::Cause::kStatePredicted && causes.has(safety::Cause::kStateStale)) continue;  // the same, said less clearly
    if (!text.empty()) text += "; ";
    text += to_string(cause);
  }
  return text;
}

std::string describe(const LoopEvent& event) {
  using Kind = LoopEvent::Kind;
  switch (event.kind) {
    case Kind::kPhase: return to_string(event.phase);
    case Kind::kContact: return "passed the contact point";
    case Kind::kDone: return event.joined ? "done; the next stroke takes over in motion" : "done";
    case Kind::kStopped: return "stopped: " + describe(event.causes);
    case Kind::kNotStarted: {
      const std::string why = to_string(event.refusal);
      return event.causes.empty() ? why : why + " (" + describe(event.causes) + ")";
    }
    case Kind::kRecovered: return "recovered";
    case Kind::kNotRecovered: return "cannot recover yet: " + (event.causes.empty() ? "the arm is not at rest" : describe(event.causes));
    case Kind::kSafety: break;
  }
  // Joints are counted from 1, as on a teach pendant.
  std::string text = describe(event.causes);
  if (event.violation) {
    text += fmt::format(": {} of joint {}: {:.6g}, allowed {:.6g}", to_string(event.violation.kind), event.violation.joint + 1,
                        event.violation.value, event.violation.limit);
  }
  if (event.following.joint >= 0) {
    text += fmt::format(": joint {} is off by {:.4f} rad, allowed {:.4f}", event.following.joint + 1, event.following.error,
                        event.following.limit);
  }
  return text;
}

}  // namespace breakshot::control
