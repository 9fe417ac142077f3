#include "common/task.hpp"

namespace breakshot {

const char* to_string(TaskPhase phase) noexcept {
  switch (phase) {
    case TaskPhase::kIdle: return "idle";
    case TaskPhase::kLooking: return "looking";
    case TaskPhase::kDeciding: return "deciding";
    case TaskPhase::kMoving: return "moving";
    case TaskPhase::kSettling: return "settling";
    case TaskPhase::kPaused: return "paused";
    case TaskPhase::kSingulated: return "singulated";
    case TaskPhase::kFailed: return "failed";
    case TaskPhase::kCancelled: return "cancelled";
    case TaskPhase::kRecovering: return "recovering";
    case TaskPhase::kRecovered: return "recovered";
  }
  return "invalid";
}

const char* to_string(TaskFailure failure) noexcept {
  switch (failure) {
    case TaskFailure::kNone: return "none";
    case TaskFailure::kTimeout: return "timeout";
    case TaskFailure::kStrokeLimit: return "stroke limit";
    case TaskFailure::kDiscLost: return "disc lost";
    case TaskFailure::kNoScene: return "no scene";
    case TaskFailure::kWrongDiscCount: return "wrong disc count";
    case TaskFailure::kNoFeasibleStroke: return "no feasible stroke";
    case TaskFailure::kControllerFault: return "controller fault";
    case TaskFailure::kBadRequest: return "bad request";
    case TaskFailure::kForeignObject: return "foreign object";
  }
  return "invalid";
}

}  // namespace breakshot
