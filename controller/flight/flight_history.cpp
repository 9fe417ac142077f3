#include "controller/flight/flight_history.hpp"

#include "controller/loop/event_text.hpp"

#include <algorithm>
#include <utility>

namespace breakshot::control::flight {

namespace {

using safety::Action;
using Kind = LoopEvent::Kind;

constexpr Duration kBefore = std::chrono::seconds{2};
constexpr Duration kAfter = std::chrono::milliseconds{500};

}  // namespace

FlightHistory::FlightHistory(const LoopConfig& config, FlightTap& tap)
    : config_{config},
      tap_{tap},
      ticks_before_{static_cast<std::uint64_t>(kBefore / config.period)},
      ticks_after_{static_cast<std::uint64_t>(kAfter / config.period)} {}

void FlightHistory::remember(std::uint64_t number, const motion::Trajectory& trajectory) {
  auto copy = std::make_shared<motion::Trajectory>(trajectory);
  const std::lock_guard lock{mutex_};
  trajectories_[number] = std::move(copy);
}

void FlightHistory::note(Trigger trigger, const std::string& why) {
  const std::lock_guard lock{mutex_};
  if (!noted_) noted_ = Pending{trigger, why, 0};
}

void FlightHistory::drain() {
  TickRecord tick;
  while (tap_.ticks.pop(tick)) {
    if (!ticks_.empty() && tick.tick != ticks_.back().tick + 1) {
      lost_ += tick.tick - ticks_.back().tick - 1;
      ticks_.clear();
    }
    ticks_.push_back(tick);
    look(tick);
  }
  Keyframe keyframe;
  while (tap_.keyframes.pop(keyframe)) keyframes_.push_back(keyframe);

  std::optional<Pending> noted;
  {
    const std::lock_guard lock{mutex_};
    noted = std::exchange(noted_, std::nullopt);
  }
  if (noted && !ticks_.empty()) ask(noted->trigger, std::move(noted->why), ticks_.back().tick);
  forget_old();
}

void FlightHistory::look(const TickRecord& tick) {
  for (std::size_t i = 0; i < tick.requests; ++i) newest_started_ = std::max(newest_started_, tick.request[i].trajectory_number);
  const Action before = std::exchange(action_, tick.action);
  const bool worse = tick.action > Action::kHold && tick.action > before;
  if (worse || tick.has_told(Kind::kStopped)) {
    ask(tick.action == Action::kFault ? Trigger::kFault : Trigger::kStop,
        std::string{to_string(tick.action)} + ": " + describe(tick.causes), tick.tick);
  } else if (tick.has_told(Kind::kNotStarted) || tick.has_told(Kind::kNotRecovered)) {
    ask(Trigger::kRefusal, (tick.has_told(Kind::kNotStarted) ? "a stroke was not started; " : "no recovery yet; ") + describe(tick.causes),
        tick.tick);
  }
}

void FlightHistory::ask(Trigger trigger, std::string why, std::uint64_t tick) {
  if (!pending_) {
    pending_ = Pending{trigger, std::move(why), tick};
  } else if (trigger > pending_->trigger) {
    pending_->trigger = trigger;
    pending_->why = std::move(why);
  }
}

void FlightHistory::forget_old() {
  if (ticks_.empty()) return;
  // A keyframe from before a gap leads nowhere.
  while (!keyframes_.empty() && keyframes_.front().tick < ticks_.front().tick) keyframes_.pop_front();
  if (keyframes_.empty()) return;
  const std::uint64_t of = pending_ ? pending_->tick : ticks_.back().tick;
  while (keyframes_.size() > 1 && keyframes_[1].tick + ticks_before_ <= of) keyframes_.pop_front();
  while (!ticks_.empty() && ticks_.front().tick < keyframes_.front().tick) ticks_.pop_front();

  const std::lock_guard lock{mutex_};
  trajectories_.erase(trajectories_.begin(), trajectories_.lower_bound(first_needed()));
  while (trajectories_.size() > kMaxTrajectories) {
    // More strokes in two seconds than there can be. Begin anew behind the oldest.
    trajectories_.erase(trajectories_.begin());
    ticks_.clear();
    keyframes_.clear();
  }
}

std::uint64_t FlightHistory::first_needed() const {
  if (const auto running = keyframes_.front().memory.trajectory_number_; running != 0) return running;
  for (const TickRecord& tick : ticks_) {
    for (std::size_t i = 0; i < tick.requests; ++i) {
      if (tick.request[i].kind == LoopRequest::Kind::kStart) return tick.request[i].trajectory_number;
    }
  }
  return newest_started_ + 1;
}

std::optional<FlightRecord> FlightHistory::take(bool incomplete) {
  if (!pending_ || ticks_.empty()) return std::nullopt;
  if (!incomplete && ticks_.back().tick < pending_->tick + ticks_after_) return std::nullopt;
  const Pending what = *std::exchange(pending_, std::nullopt);
  // Without a keyframe (a gap a moment ago) there is nothing that a replay could begin from.
  if (keyframes_.empty() || keyframes_.front().tick != ticks_.front().tick) return std::nullopt;

  FlightRecord record;
  record.trigger = what.trigger;
  record.why = what.why;
  record.trigger_tick = what.tick;
  record.config = config_;
  record.start = keyframes_.front();
  record.ticks.assign(ticks_.begin(), ticks_.end());
  const std::lock_guard lock{mutex_};
  record.trajectories = trajectories_;
  return record;
}

}  // namespace breakshot::control::flight
