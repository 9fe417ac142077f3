#pragma once

#include "common/geometry.hpp"
#include "common/task.hpp"
#include "common/time.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string>

// What the factory (MES) and the cell say to each other, as plain values. The rules are in docs/mes.md.

namespace breakshot::mes {

/// A UUID: identifies an order, a command, a sender.
using Id = OrderId;

/// Version of this protocol. Another major version is refused (R_VERSION).
inline constexpr std::uint16_t kMajor = 1;
inline constexpr std::uint16_t kMinor = 0;

struct Header {
  std::uint32_t robot_id = 0;
  std::uint16_t major = kMajor;
  std::uint16_t minor = kMinor;
  Id source_id{};                 ///< who sends
  std::uint64_t session = 0;      ///< grows with each start of the sender
  std::uint64_t seq = 0;          ///< counts up by one per message of that session, per topic
  std::int64_t stamp_utc_ns = 0;  ///< wall clock of the sender, ns since 1970
};

enum class Verb : std::uint32_t {
  kStore = 0,
  kStoreAndStart,
  kStart,
  kPause,
  kResume,
  kCancel,
  kStop,
  kAbort,
  kClear,
  kReset,
  kSetMode,
  kAckAlarm,
  kAckResult,
  kQuery
};
enum class Verdict : std::uint32_t { kAccepted = 0, kRejected, kDuplicate };
enum class JobPhase : std::uint32_t { kNotAllowedToStart = 0, kAllowedToStart, kRunning, kInterrupted, kEnded, kAborted };
enum class PackState : std::uint32_t {
  kStopped = 0,
  kResetting,
  kIdle,
  kStarting,
  kExecute,
  kCompleting,
  kComplete,
  kAborting,
  kAborted,
  kStopping,
  kClearing,
  kSuspending,
  kSuspended,
  kUnsuspending,
  kHolding,
  kHeld,
  kUnholding
};
enum class UnitMode : std::uint32_t { kInvalid = 0, kProduction, kMaintenance, kManual };
enum class Reason : std::uint32_t {
  kNone = 0,
  kMalformed,
  kVersion,
  kUnknownOrder,
  kOutdatedRev,
  kSameRevDiffers,
  kOtherOrderActive,
  kQueueFull,
  kBadState,
  kBadMode,
  kUnsupportedParam,
  kOutOfLimits,
  kStale,
  kNotAuthorised,
  kSafetyStop,
  kNotReady,
  kOrderClosed,
  kInternal
};
enum class SafetyState : std::uint32_t { kOk = 0, kProtectiveStop, kEmergencyStop, kReduced, kFault };
enum class Severity : std::uint32_t { kInfo = 0, kWarning, kUrgent, kCritical, kFatal };

/// What is to be done with the discs. Zero means "as the cell is configured" for every number but min_gap and region.
struct JobSpec {
  double min_gap = 0.0;            ///< m; 0: as configured
  Rect region;                     ///< in W, m; all zero: the whole workspace
  std::uint32_t expect_discs = 0;  ///< 0: any number
  std::uint32_t max_hits = 0;
  std::uint32_t max_pushes = 0;
  std::uint32_t timeout_ms = 0;
  double speed_scale = 1.0;  ///< (0, 1]
};

/// Travels on `mes/command`.
struct Command {
  Header header;
  Id command_id{};  ///< idempotency key: the same id again is answered with the same ack and does nothing
  Id order_id{};
  std::uint32_t order_rev = 0;
  Verb verb = Verb::kQuery;
  UnitMode mode = UnitMode::kInvalid;
  std::uint32_t valid_for_ms = 0;  ///< the command is void when it is older; 0: no limit
  std::uint8_t auth_level = 0;
  std::string operator_id;  ///< at most 64 characters
  JobSpec spec;
};

/// Travels on `mes/ack`.
struct Ack {
  Header header;
  Id command_id{};
  Id order_id{};
  std::uint32_t order_rev = 0;
  Verdict verdict = Verdict::kAccepted;
  Reason reason = Reason::kNone;
  std::uint32_t detail = 0;
  PackState state = PackState::kIdle;
  std::string text;  ///< what was found and what is allowed; at most 128 characters
};

/// Travels on `mes/job`.
struct JobState {
  Header header;
  std::uint32_t slot = 0;
  Id order_id{};
  std::uint32_t order_rev = 0;
  JobPhase phase = JobPhase::kNotAllowedToStart;
  std::uint32_t change_no = 0;  ///< counts the changes of this order's state
  double progress = 0.0;        ///< [0, 1]
  std::uint32_t discs_seen = 0, discs_singulated = 0;
  std::uint32_t hits = 0, pushes = 0;
  std::int64_t accepted_utc_ns = 0, started_utc_ns = 0, ended_utc_ns = 0;
  double min_gap = std::numeric_limits<double>::infinity();  ///< smallest gap seen last, m
  Reason result = Reason::kNone;                             ///< with kAborted: why
  std::string text;
};

/// Travels on `mes/status`.
struct RobotStatus {
  Header header;
  Id boot_id{};
  PackState state = PackState::kIdle;
  UnitMode mode = UnitMode::kProduction;
  SafetyState safety = SafetyState::kOk;
  bool paused = false;
  bool accepting = false;  ///< a new order would be taken now
  Id active_order{};
  std::uint32_t queue_free = 0;
  std::uint32_t mes_age_ms = 0;  ///< since the MES was last heard
  std::uint64_t loop_overruns = 0;
  double loop_max_us = 0.0;
  std::string sw_version;
  std::string config_sha;
};

/// Travels on `mes/heartbeat`, both ways.
struct Heartbeat {
  Header header;
  bool peer_ready = false;
};

/// Travels on `mes/alarm`.
struct Alarm {
  Header header;
  std::uint32_t code = 0;
  std::uint32_t occurrence = 0;
  Severity severity = Severity::kInfo;
  bool active = false;
  bool acked = false;
  std::int64_t raised_utc_ns = 0, cleared_utc_ns = 0;
  Id order_id{};
  double value = 0.0;
  std::string text;
};

const char* to_string(Verb verb) noexcept;
const char* to_string(Verdict verdict) noexcept;
const char* to_string(JobPhase phase) noexcept;
const char* to_string(PackState state) noexcept;
const char* to_string(Reason reason) noexcept;

/// "0f8c...": the usual UUID text.
std::string to_text(const Id& id);
/// A random (version 4) UUID.
Id random_id();

}  // namespace breakshot::mes
