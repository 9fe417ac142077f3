#include "common/stroke.hpp"

namespace breakshot {

const char* to_string(StrokeKind kind) noexcept {
  switch (kind) {
    case StrokeKind::kHit: return "hit";
    case StrokeKind::kPush: return "push";
    case StrokeKind::kPark: return "park";
    case StrokeKind::kRecover: return "recover";
  }
  return "invalid";
}

const char* to_string(StrokePhase phase) noexcept {
  switch (phase) {
    case StrokePhase::kAccepted: return "accepted";
    case StrokePhase::kTransit: return "transit";
    case StrokePhase::kRunIn: return "run-in";
    case StrokePhase::kFollowThrough: return "follow-through";
    case StrokePhase::kRetreat: return "retreat";
    case StrokePhase::kParking: return "parking";
    case StrokePhase::kDone: return "done";
    case StrokePhase::kRefused: return "refused";
    case StrokePhase::kStopped: return "stopped";
  }
  return "invalid";
}

const char* to_string(RefusalReason reason) noexcept {
  switch (reason) {
    case RefusalReason::kNone: return "none";
    case RefusalReason::kBadRequest: return "bad request";
    case RefusalReason::kUnreachable: return "unreachable";
    case RefusalReason::kTooFast: return "too fast";
    case RefusalReason::kOutOfBounds: return "out of bounds";
    case RefusalReason::kJointLimit: return "joint limit";
    case RefusalReason::kBusy: return "busy";
    case RefusalReason::kNotReady: return "not ready";
    case RefusalReason::kTooLong: return "too long";
    case RefusalReason::kStopped: return "stopped";
  }
  return "invalid";
}

}  // namespace breakshot
