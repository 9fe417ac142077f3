#include "planner/world/striker_motion.hpp"

#include "planner/world/pair_motion.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace breakshot::world {

namespace {

/// Ends of the pieces of the way back, in units of 1 / bandwidth. Shortest at first: that is when the disc is met again.
constexpr double kPieceEnds[] = {0.1, 0.25, 0.5, 1.0, 2.0, 4.0};
constexpr std::size_t kPieces = std::size(kPieceEnds);

}  // namespace

void StrikerMotion::begin(const StrikerRun& run) noexcept {
  run_ = run;
  brakes_at_ = run.cruise / run.speed;
  gone_at_ = brakes_at_ + std::min(run.speed / run.braking, run.lift);
  piece_ = kPieces;
}

double StrikerMotion::speed(double time) const noexcept {
  return std::max(0.0, run_.speed - run_.braking * std::max(0.0, time - brakes_at_));
}

Vector2 StrikerMotion::on_run(double time) const noexcept {
  const double braked = std::clamp(time - brakes_at_, 0.0, run_.speed / run_.braking);
  const double way = run_.speed * std::min(time, brakes_at_) + braked * (run_.speed - 0.5 * run_.braking * braked);
  return run_.p_WS + way * run_.direction;
}

StrikerMotion::Off StrikerMotion::off_run(double time) const noexcept {
  const double w = run_.bandwidth;
  const double t = time - thrown_at_;
  const double decay = std::exp(-w * t);
  const Vector2 rate = thrown_.v + w * thrown_.p;
  return {decay * (thrown_.p + t * rate), decay * (thrown_.v - w * t * rate)};
}

StrikerMotion::Leg StrikerMotion::leg(double time, const Vector2& p_WS) noexcept {
  if (time >= gone_at_) return {.until = kNever};
  const auto end_of_piece = [&] { return thrown_at_ + kPieceEnds[piece_] / run_.bandwidth; };
  while (piece_ < kPieces && time >= end_of_piece()) ++piece_;
  if (piece_ < kPieces) {
    const double end = end_of_piece();
    const Vector2 p_end = on_run(end) + (piece_ + 1 < kPieces ? off_run(end).p : Vector2{0.0, 0.0});
    return {.v = (p_end - p_WS) / (end - time), .until = std::min(end, gone_at_)};
  }
  const bool brakes = time >= brakes_at_;
  return {.v = speed(time) * run_.direction,
          .deceleration = (brakes ? run_.braking : 0.0) * run_.direction,
          .until = brakes ? gone_at_ : brakes_at_};
}

bool StrikerMotion::throw_back(double time, const Vector2& p_WS, const Vector2& change_W) noexcept {
  if (run_.bandwidth == 0.0) return false;
  const Vector2 v_before = piece_ < kPieces ? off_run(time).v : Vector2{0.0, 0.0};
  thrown_ = {p_WS - on_run(time), v_before + change_W};
  thrown_at_ = time;
  piece_ = 0;
  return true;
}

}  // namespace breakshot::world
