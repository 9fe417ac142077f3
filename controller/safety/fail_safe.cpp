#include "controller/safety/fail_safe.hpp"

#include <algorithm>

namespace breakshot::safety {

namespace {

constexpr CauseSet causes_that_clear(Clear clear) noexcept {
  CauseSet set;
  for (std::size_t i = 0; i < kCauses; ++i) set.add(static_cast<Cause>(i), kRules[i].clear == clear);
  return set;
}

constexpr CauseSet kAutomatic = causes_that_clear(Clear::kWhenGone);
constexpr CauseSet kPermanent = causes_that_clear(Clear::kNever);

constexpr CauseSet common(CauseSet a, CauseSet b) noexcept { return CauseSet{static_cast<std::uint16_t>(a.bits() & b.bits())}; }

}  // namespace

Cause CauseSet::worst() const noexcept {
  Cause worst = Cause::kNoState;
  Action action = Action::kRun;
  for (std::size_t i = 0; i < kCauses; ++i) {
    const auto cause = static_cast<Cause>(i);
    if (has(cause) && kRules[i].action > action) {
      worst = cause;
      action = kRules[i].action;
    }
  }
  return worst;
}

CauseSet FailSafe::update(CauseSet present) noexcept {
  const CauseSet before = active_;
  present_ = present;
  active_ = active_.without(kAutomatic).with(present);
  return active_.without(before);
}

CauseSet FailSafe::in_the_way() const noexcept { return common(active_, kPermanent).with(lasting(present_)); }

bool FailSafe::recover(bool at_rest) noexcept {
  if (!at_rest || !recoverable()) return false;
  active_ = common(active_, kAutomatic);
  return true;
}

Action FailSafe::action() const noexcept {
  Action action = Action::kRun;
  for (std::size_t i = 0; i < kCauses; ++i) {
    if (active_.has(static_cast<Cause>(i))) action = std::max(action, kRules[i].action);
  }
  return action;
}

CauseSet lasting(CauseSet causes) noexcept { return causes.without(kAutomatic); }

const char* to_string(Action action) noexcept {
  switch (action) {
    case Action::kRun: return "run";
    case Action::kHold: return "hold";
    case Action::kControlledStop: return "controlled stop";
    case Action::kProtectiveStop: return "protective stop";
    case Action::kFault: return "fault";
  }
  return "invalid";
}

const char* to_string(Cause cause) noexcept {
  switch (cause) {
    case Cause::kNoState: return "no joint state yet";
    case Cause::kStatePredicted: return "joint states are late";
    case Cause::kStopRequested: return "a stop was asked for";
    case Cause::kForeignCommander: return "another controller sends commands to these drives";
    case Cause::kStateStale: return "no fresh joint state";
    case Cause::kDrivesBraked: return "the drives braked by themselves";
    case Cause::kDrivesRestarted: return "the drives restarted";
    case Cause::kCommandGap: return "the loop was held up for so long that the drives braked by themselves";
    case Cause::kFollowingError: return "the arm is not where it was told to be";
    case Cause::kCommandLimit: return "the next command would have broken a limit";
    case Cause::kWrongDrives: return "the drives have another number of joints than the arm";
  }
  return "invalid";
}

}  // namespace breakshot::safety
