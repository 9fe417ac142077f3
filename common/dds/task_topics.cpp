#include "common/dds/cell_topics.hpp"
#include "common/dds/door.hpp"

#include <cmath>
#include <limits>

// Tasks, plans, outcomes.

namespace breakshot::dds {

namespace {

constexpr std::size_t kMostCandidates = 5;

using WireTimes = breakshot_msgs::msg::PhaseTimes;

void put(const PhaseTimes& from, WireTimes& to) {
  to.look_ns(from.look.count());
  to.decide_ns(from.decide.count());
  to.move_ns(from.move.count());
  to.settle_ns(from.settle.count());
}

PhaseTimes get(const WireTimes& from) {
  return {Duration{from.look_ns()}, Duration{from.decide_ns()}, Duration{from.move_ns()}, Duration{from.settle_ns()}};
}

// Gaps may be infinite (fewer than two discs) or unknown (NaN); both are told as numbers no gap can have, so that NaN and infinity stay errors
// on the wire.
constexpr double kInfiniteGap = 1e6;
constexpr double kUnknownGap = -1e6;

double put_gap(double gap) {
  if (std::isnan(gap)) return kUnknownGap;
  return std::isfinite(gap) ? gap : kInfiniteGap;
}

double get_gap(Door& door, double wire) {
  door.within("gap", wire, kUnknownGap, kInfiniteGap);
  if (wire == kUnknownGap) return std::numeric_limits<double>::quiet_NaN();
  return wire == kInfiniteGap ? std::numeric_limits<double>::infinity() : wire;
}

}  // namespace

void Topic<TaskRequest>::encode(const TaskRequest& value, Wire& wire) {
  wire.seq(value.seq);
  wire.verb(static_cast<std::uint8_t>(value.verb));
  wire.order_id(value.order_id);
  wire.order_rev(value.order_rev);
  wire.min_gap(value.min_gap);
  wire.region({value.region.min.x(), value.region.min.y(), value.region.max.x(), value.region.max.y()});
  wire.expect_discs(value.expect_discs);
  wire.max_hits(value.max_hits);
  wire.max_pushes(value.max_pushes);
  wire.timeout_ns(value.timeout.count());
  wire.speed_scale(value.speed_scale);
}

Result<TaskRequest, Invalid> Topic<TaskRequest>::decode(const Wire& wire) {
  Door door;
  door.enumerated("verb", wire.verb(), static_cast<unsigned>(TaskRequest::Verb::kRecover));
  door.finite("min_gap", wire.min_gap());
  for (const double value : wire.region()) door.within("region", value, -kFarthest, kFarthest);
  door.finite("speed_scale", wire.speed_scale());
  if (!door.good()) return door.why();
  TaskRequest value;
  value.verb = static_cast<TaskRequest::Verb>(wire.verb());
  value.seq = wire.seq();
  value.order_id = wire.order_id();
  value.order_rev = wire.order_rev();
  value.min_gap = wire.min_gap();
  value.region = {{wire.region()[0], wire.region()[1]}, {wire.region()[2], wire.region()[3]}};
  value.expect_discs = wire.expect_discs();
  value.max_hits = wire.max_hits();
  value.max_pushes = wire.max_pushes();
  value.timeout = Duration{wire.timeout_ns()};
  value.speed_scale = wire.speed_scale();
  return value;
}

void Topic<TaskStatus>::encode(const TaskStatus& value, Wire& wire) {
  wire.order_id(value.order_id);
  wire.order_rev(value.order_rev);
  wire.request_seq(value.request_seq);
  wire.phase(static_cast<std::uint8_t>(value.phase));
  wire.failure(static_cast<std::uint8_t>(value.failure));
  wire.stamp_ns(to_ns(value.stamp));
  wire.started_ns(to_ns(value.started));
  wire.ended_ns(to_ns(value.ended));
  wire.discs_seen(value.discs_seen);
  wire.discs_singulated(value.discs_singulated);
  wire.discs_lost(value.discs_lost);
  wire.hits(value.hits);
  wire.pushes(value.pushes);
  wire.smallest_gap(put_gap(value.smallest_gap));
  put(value.times, wire.times());
  wire.text(std::string{fit(value.text, 255)});
}

Result<TaskStatus, Invalid> Topic<TaskStatus>::decode(const Wire& wire) {
  Door door;
  door.enumerated("phase", wire.phase(), static_cast<unsigned>(TaskPhase::kRecovered));
  door.enumerated("failure", wire.failure(), static_cast<unsigned>(TaskFailure::kForeignObject));
  TaskStatus value;
  value.smallest_gap = get_gap(door, wire.smallest_gap());
  if (!door.good()) return door.why();
  value.order_id = wire.order_id();
  value.order_rev = wire.order_rev();
  value.request_seq = wire.request_seq();
  value.phase = static_cast<TaskPhase>(wire.phase());
  value.failure = static_cast<TaskFailure>(wire.failure());
  value.stamp = time_from_ns(wire.stamp_ns());
  value.started = time_from_ns(wire.started_ns());
  value.ended = time_from_ns(wire.ended_ns());
  value.discs_seen = wire.discs_seen();
  value.discs_singulated = wire.discs_singulated();
  value.discs_lost = wire.discs_lost();
  value.hits = wire.hits();
  value.pushes = wire.pushes();
  value.times = get(wire.times());
  value.text = wire.text().to_string();
  return value;
}

void Topic<Plan>::encode(const Plan& value, Wire& wire) {
  wire.seq(value.seq);
  wire.order_id(value.order_id);
  wire.stamp_ns(to_ns(value.stamp));
  wire.scene_seq(value.scene_seq);
  wire.strategy(std::string{fit(value.strategy, 31)});
  Topic<StrokeRequest>::encode(value.stroke, wire.stroke());
  wire.why(std::string{fit(value.why, 255)});
  wire.predicted_gap(put_gap(value.predicted_gap));
  wire.think_ns(value.think.count());
  wire.predicted_p_wd().resize(std::min(value.predicted_p_WD.size(), kMaxSceneDiscs));
  for (std::size_t i = 0; i < wire.predicted_p_wd().size(); ++i) {
    wire.predicted_p_wd()[i].x(value.predicted_p_WD[i].x());
    wire.predicted_p_wd()[i].y(value.predicted_p_WD[i].y());
  }
  wire.candidates().resize(std::min(value.candidates.size(), kMostCandidates));
  for (std::size_t i = 0; i < wire.candidates().size(); ++i) {
    Topic<StrokeRequest>::encode(value.candidates[i].stroke, wire.candidates()[i].stroke());
    wire.candidates()[i].cost_s(value.candidates[i].cost_s);
    wire.candidates()[i].p_singulated(value.candidates[i].p_singulated);
    wire.candidates()[i].p_lost(value.candidates[i].p_lost);
  }
}

Result<Plan, Invalid> Topic<Plan>::decode(const Wire& wire) {
  Door door;
  Plan value;
  value.predicted_gap = get_gap(door, wire.predicted_gap());
  door.at_most("predicted_p_wd", wire.predicted_p_wd().size(), kMaxSceneDiscs);
  door.at_most("candidates", wire.candidates().size(), kMostCandidates);
  auto stroke = Topic<StrokeRequest>::decode(wire.stroke());
  if (!stroke) return stroke.error();
  if (!door.good()) return door.why();
  value.seq = wire.seq();
  value.order_id = wire.order_id();
  value.stamp = time_from_ns(wire.stamp_ns());
  value.scene_seq = wire.scene_seq();
  value.strategy = wire.strategy().to_string();
  value.stroke = *stroke;
  value.why = wire.why().to_string();
  value.think = Duration{wire.think_ns()};
  for (const auto& p : wire.predicted_p_wd()) {
    door.within("predicted_p_wd", p.x(), -kFarthest, kFarthest);
    door.within("predicted_p_wd", p.y(), -kFarthest, kFarthest);
    value.predicted_p_WD.emplace_back(p.x(), p.y());
  }
  for (const auto& candidate : wire.candidates()) {
    auto way = Topic<StrokeRequest>::decode(candidate.stroke());
    if (!way) return way.error();
    door.finite("cost_s", candidate.cost_s());
    door.within("p_singulated", candidate.p_singulated(), 0.0, 1.0);
    door.within("p_lost", candidate.p_lost(), 0.0, 1.0);
    value.candidates.push_back({*way, candidate.cost_s(), candidate.p_singulated(), candidate.p_lost()});
  }
  if (!door.good()) return door.why();
  return value;
}

void Topic<Outcome>::encode(const Outcome& value, Wire& wire) {
  wire.plan_seq(value.plan_seq);
  wire.stroke_id(value.stroke_id);
  wire.stamp_ns(to_ns(value.stamp));
  wire.stroke_phase(static_cast<std::uint8_t>(value.stroke_phase));
  wire.reason(static_cast<std::uint8_t>(value.reason));
  wire.achieved_gap(put_gap(value.achieved_gap));
  wire.contacts_left(value.contacts_left);
  wire.discs_singulated(value.discs_singulated);
  wire.discs_lost(value.discs_lost);
  wire.contact_speed(value.contact_speed);
  put(value.times, wire.times());
}

Result<Outcome, Invalid> Topic<Outcome>::decode(const Wire& wire) {
  Door door;
  door.enumerated("stroke_phase", wire.stroke_phase(), static_cast<unsigned>(StrokePhase::kStopped));
  door.enumerated("reason", wire.reason(), static_cast<unsigned>(RefusalReason::kStopped));
  door.finite("contact_speed", wire.contact_speed());
  Outcome value;
  value.achieved_gap = get_gap(door, wire.achieved_gap());
  if (!door.good()) return door.why();
  value.plan_seq = wire.plan_seq();
  value.stroke_id = wire.stroke_id();
  value.stamp = time_from_ns(wire.stamp_ns());
  value.stroke_phase = static_cast<StrokePhase>(wire.stroke_phase());
  value.reason = static_cast<RefusalReason>(wire.reason());
  value.contacts_left = wire.contacts_left();
  value.discs_singulated = wire.discs_singulated();
  value.discs_lost = wire.discs_lost();
  value.contact_speed = wire.contact_speed();
  value.times = get(wire.times());
  return value;
}

}  // namespace breakshot::dds
