#pragma once

#include "common/geometry.hpp"
#include "common/stroke.hpp"
#include "common/time.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace breakshot {

/// A UUID in network byte order, as the MES sends it.
using OrderId = std::array<std::uint8_t, 16>;

/// What the gateway asks of the planner. Travels on `cell/task`.
struct TaskRequest {
  enum class Verb : std::uint8_t {
    kStart = 0,
    kCancel = 1,
    kPause = 2,
    kResume = 3,
    kRecover = 4,  ///< no task: ask the controller to end its stop; refused while a task runs
  };
  Verb verb = Verb::kStart;
  std::uint64_t seq = 0;  ///< of the gateway's requests; the planner acknowledges it in TaskStatus::request_seq
  OrderId order_id{};
  std::uint32_t order_rev = 0;
  double min_gap = 0.0;            ///< G: every pairwise gap is to reach it, m
  Rect region;                     ///< workspace that every disc's centre is to rest in, in W, m
  std::uint32_t expect_discs = 0;  ///< refuse the task when another number is seen; 0: any
  std::uint32_t max_hits = 0;
  std::uint32_t max_pushes = 0;
  Duration timeout{};
  double speed_scale = 1.0;  ///< scales every hit's speed limit, (0, 1]
};

enum class TaskPhase : std::uint8_t {
  kIdle = 0,
  kLooking = 1,  ///< waits for a scene at rest with the arm out of view
  kDeciding = 2,
  kMoving = 3,    ///< a stroke runs
  kSettling = 4,  ///< discs slide or the arm parks
  kPaused = 5,
  kSingulated = 6,  ///< final: success
  kFailed = 7,      ///< final: gave up; see TaskFailure
  kCancelled = 8,   ///< final: as asked, the arm parked
  kRecovering = 9,  ///< the controller was asked to end its stop
  kRecovered = 10,  ///< final: it did; kFailed when it did not
};

constexpr bool is_final(TaskPhase phase) noexcept {
  return phase == TaskPhase::kSingulated || phase == TaskPhase::kFailed || phase == TaskPhase::kCancelled || phase == TaskPhase::kRecovered;
}

/// Why a task was given up.
enum class TaskFailure : std::uint8_t {
  kNone = 0,
  kTimeout = 1,
  kStrokeLimit = 2,       ///< max_hits and max_pushes used up
  kDiscLost = 3,          ///< a disc rests outside the region, or is seen no more
  kNoScene = 4,           ///< no usable camera image for too long
  kWrongDiscCount = 5,    ///< not the number that the order expected
  kNoFeasibleStroke = 6,  ///< every stroke that the strategy offered was refused
  kControllerFault = 7,   ///< the controller is not there, is stopped, or stopped a stroke
  kBadRequest = 8,
  kForeignObject = 9,  ///< something that is neither disc nor arm stays on the table
};

/// Time of the cell clock spent so far, by what was waited for.
struct PhaseTimes {
  Duration look{}, decide{}, move{}, settle{};
  Duration total() const noexcept { return look + decide + move + settle; }
};

/// What the planner says of its task. Travels on `cell/task_status` on every change and at 5 Hz.
struct TaskStatus {
  OrderId order_id{};
  std::uint32_t order_rev = 0;
  std::uint64_t request_seq = 0;  ///< last TaskRequest::seq that was taken
  TaskPhase phase = TaskPhase::kIdle;
  TaskFailure failure = TaskFailure::kNone;
  Time stamp{}, started{}, ended{};
  std::uint32_t discs_seen = 0;
  std::uint32_t discs_singulated = 0;  ///< discs of which every gap is at least min_gap
  std::uint32_t discs_lost = 0;
  std::uint32_t hits = 0, pushes = 0;
  double smallest_gap = 0.0;  ///< m; infinity with fewer than two discs
  PhaseTimes times;
  std::string text;  ///< for people; at most 255 characters
};

/// One way on that a strategy considered.
struct Candidate {
  StrokeRequest stroke;
  double cost_s = 0.0;  ///< expected time to finish that way, s; what the choice minimises
  double p_singulated = 0.0;
  double p_lost = 0.0;
};

/// A decision and the reasons for it. Travels on `cell/plan` once per decision.
struct Plan {
  std::uint64_t seq = 0;
  OrderId order_id{};
  Time stamp{};
  std::uint64_t scene_seq = 0;
  std::string strategy;                 ///< "paper", "random_hybrid", ...; at most 31 characters
  StrokeRequest stroke;                 ///< what is going to be asked of the controller
  std::string why;                      ///< for people; at most 255 characters
  double predicted_gap = 0.0;           ///< smallest gap after the stroke in the virtual world, m; NaN when not predicted
  std::vector<Vector2> predicted_p_WD;  ///< resting places in the virtual world, by scene index; empty when not predicted
  std::vector<Candidate> candidates;    ///< best first, at most 5
  Duration think{};                     ///< time that the decision took
};

/// What a stroke achieved. Travels on `cell/outcome` once per stroke, when the table rests again.
struct Outcome {
  std::uint64_t plan_seq = 0;
  std::uint64_t stroke_id = 0;
  Time stamp{};
  StrokePhase stroke_phase = StrokePhase::kDone;
  RefusalReason reason = RefusalReason::kNone;
  double achieved_gap = 0.0;  ///< smallest gap seen afterwards, m
  std::uint32_t contacts_left = 0;
  std::uint32_t discs_singulated = 0;
  std::uint32_t discs_lost = 0;
  double contact_speed = 0.0;  ///< as the controller measured it, m/s
  PhaseTimes times;            ///< of this stroke alone, from the look before it to rest
};

const char* to_string(TaskPhase phase) noexcept;
const char* to_string(TaskFailure failure) noexcept;

}  // namespace breakshot
