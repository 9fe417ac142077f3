#pragma once

#include "common/geometry.hpp"
#include "common/time.hpp"

#include <cstdint>
#include <string>

namespace breakshot {

enum class StrokeKind : std::uint8_t {
  kHit = 0,   ///< the striker meets a disc at speed, brakes and lifts away at once
  kPush = 1,  ///< the striker runs slowly along a straight line
  kPark = 2,  ///< no stroke: lift, and go where the arm does not hide the table from the camera
  /// Nothing moves: ends a stop of the controller, if it may be. Somebody's decision to go on; kDone, or kRefused with what stands in the way.
  kRecover = 3,
};

/// What the planner asks of the controller. Travels on `cell/stroke`.
struct StrokeRequest {
  std::uint64_t id = 0;  ///< unique within a planner session, from 1; never used twice
  StrokeKind kind = StrokeKind::kPark;
  /// Where the striker's *axis* is, in W: for a hit at the instant of first contact, for a push where the straight line begins, m.
  Vector2 p_WS{0.0, 0.0};
  Vector2 direction_W{1.0, 0.0};  ///< unit vector of travel
  double speed = 0.0;             ///< of the tip along direction_W: a hit's at contact, a push's while it runs, m/s
  double run_in = 0.0;            ///< hit: straight approach that ends in p_WS; the striker comes down before it, m
  double length = 0.0;  ///< push: length of the straight line, m; a hit ignores it (its follow-through is as short as the arm can brake)
  bool park_after =
      true;  ///< go to the park pose when the stroke is done, so that the camera sees the table; not when another one follows it
};

/// Where a stroke is in its life. kRefused, kDone and kStopped are final.
enum class StrokePhase : std::uint8_t {
  kAccepted = 0,       ///< about to move: planned and checked; or taken, and waits for the stroke before it (see text)
  kTransit = 1,        ///< moving over the discs to the start, including the descent
  kRunIn = 2,          ///< straight line; for a push, the push itself
  kFollowThrough = 3,  ///< braking after the contact point
  kRetreat = 4,        ///< lifting away
  kParking = 5,        ///< discs are free and the arm goes to the park pose
  kDone = 6,           ///< the arm is at rest, or the next stroke took over in motion (see text)
  kRefused = 7,        ///< not planned: see RefusalReason; the arm did not move
  kStopped = 8,        ///< begun but stopped on the way: see text
};

constexpr bool is_final(StrokePhase phase) noexcept {
  return phase == StrokePhase::kDone || phase == StrokePhase::kRefused || phase == StrokePhase::kStopped;
}

enum class RefusalReason : std::uint8_t {
  kNone = 0,
  kBadRequest = 1,   ///< NaN, direction not of unit length, speed or length out of range
  kUnreachable = 2,  ///< no joint configuration puts the striker there
  kTooFast = 3,      ///< beyond what the arm attains there; `attainable` says what it does, m/s
  kOutOfBounds = 4,  ///< the striker would leave the area it may work in, or touch the table
  kJointLimit = 5,   ///< a joint would leave its range, speed, acceleration or jerk on the way
  kBusy = 6,         ///< another stroke runs, and this one cannot follow it
  kNotReady = 7,     ///< no fresh joint state, or the arm is not at rest; with kRecover: what stands in the way is in the text
  kTooLong = 8,      ///< the trajectory does not fit the controller's fixed-size buffer
  kStopped = 9,      ///< the controller is stopped, and nothing but StrokeKind::kRecover ends that
};

/// What the controller says of a stroke. Travels on `cell/stroke_status` on every change and at 50 Hz.
struct StrokeStatus {
  std::uint64_t id = 0;
  StrokePhase phase = StrokePhase::kAccepted;
  RefusalReason reason = RefusalReason::kNone;
  double attainable = 0.0;  ///< with kTooFast: the speed that would have been accepted, m/s
  Time stamp{};
  Duration planned_contact{};  ///< from the start (first motion, or where it takes over from the stroke before) to p_WS, as planned
  Duration planned_total{};    ///< from the start to rest, as planned
  /// Measured tip speed along direction_W with which the striker came to p_WS, before any disc slowed it, m/s; 0 before that, and when the joint
  /// states of those milliseconds are missing.
  double contact_speed = 0.0;
  std::string text;  ///< for people: what was found and what is allowed; at most 255 characters
};

/// "hit", "push", ...; "invalid" for a value outside the enum (such values can come from the wire).
const char* to_string(StrokeKind kind) noexcept;
const char* to_string(StrokePhase phase) noexcept;
const char* to_string(RefusalReason reason) noexcept;

}  // namespace breakshot
