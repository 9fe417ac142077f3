#include "sim_bridge/node/physics_figures.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace breakshot::sim_bridge {

void PhysicsFigures::Tail::record(Duration span) noexcept {
  const auto us = static_cast<std::uint64_t>(std::max<std::int64_t>(0, span.count()) / 1000);
  ++bins_[std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(us)), bins_.size() - 1)];
  ++count_;
  max_ = std::max(max_, span);
}

double PhysicsFigures::Tail::p99_us() const noexcept {
  std::uint64_t left = count_ - count_ / 100;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    if (bins_[i] >= left) return std::min(max_us(), static_cast<double>(std::uint64_t{1} << i));
    left -= bins_[i];
  }
  return max_us();
}

void PhysicsFigures::record(const Pace& pace, Duration late, Duration compute, const SimWorld& world) noexcept {
  const std::lock_guard lock{mutex_};
  summary_.ticks += static_cast<std::uint64_t>(pace.ticks);
  ++summary_.rounds;
  summary_.slipped += static_cast<std::uint64_t>(pace.slip / SimWorld::kTick);
  const auto verdicts = world.verdicts();
  summary_.taken = verdicts.front();
  summary_.refused = std::accumulate(verdicts.begin() + 1, verdicts.end(), std::uint64_t{0});
  summary_.waiting = false;
  wakeup_.record(late);
  compute_.record(compute);
}

void PhysicsFigures::waited() noexcept {
  const std::lock_guard lock{mutex_};
  ++summary_.rounds;
  summary_.waiting = true;
}

PhysicsFigures::Summary PhysicsFigures::summary(Time now) {
  const std::lock_guard lock{mutex_};
  const Duration span = now - rate_since_;
  if (span >= std::chrono::seconds{1}) {
    if (rate_since_ != Time{}) summary_.rate = static_cast<double>(summary_.ticks - rate_ticks_) / to_seconds(span);
    rate_since_ = now;
    rate_ticks_ = summary_.ticks;
  }
  summary_.wakeup_p99_us = wakeup_.p99_us();
  summary_.wakeup_max_us = wakeup_.max_us();
  summary_.compute_p99_us = compute_.p99_us();
  summary_.compute_max_us = compute_.max_us();
  return summary_;
}

}  // namespace breakshot::sim_bridge
