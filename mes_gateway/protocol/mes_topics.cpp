#include "mes_gateway/protocol/mes_topics.hpp"

#include "common/dds/door.hpp"

#include <cmath>

namespace breakshot::dds {

namespace wire = breakshot_mes_msgs::msg;

namespace {

void put(const mes::Header& from, wire::MsgHeader& to) {
  to.robot_id(from.robot_id);
  to.ver_major(from.major);
  to.ver_minor(from.minor);
  to.source_id(from.source_id);
  to.session(from.session);
  to.seq(from.seq);
  to.stamp_utc_ns(from.stamp_utc_ns);
}

mes::Header get(const wire::MsgHeader& from) {
  return {from.robot_id(), from.ver_major(), from.ver_minor(), from.source_id(), from.session(), from.seq(), from.stamp_utc_ns()};
}

template <typename WireEnum, typename Value>
WireEnum to_wire(Value value) {
  return static_cast<WireEnum>(static_cast<std::uint32_t>(value));
}

template <typename Value, typename WireEnum>
Value from_wire(WireEnum value) {
  return static_cast<Value>(static_cast<std::uint32_t>(value));
}

template <typename Value, typename WireEnum>
Value from_wire(Door& door, std::string_view field, WireEnum value, Value last) {
  door.enumerated(field, static_cast<std::uint32_t>(value), static_cast<std::uint32_t>(last));
  return from_wire<Value>(value);
}

// An infinite gap (fewer than two discs) travels as this many metres: JSON, databases and people on the far side handle no infinities.
constexpr double kNoGap = 1e6;

}  // namespace

void Topic<mes::Command>::encode(const mes::Command& value, Wire& to) {
  to.robot_id(value.header.robot_id);
  put(value.header, to.hdr());
  to.command_id(value.command_id);
  to.order_id(value.order_id);
  to.order_rev(value.order_rev);
  to.verb(to_wire<wire::VerbKind>(value.verb));
  to.mode(to_wire<wire::UnitMode>(value.mode));
  to.valid_for_ms(value.valid_for_ms);
  to.auth_level(value.auth_level);
  to.operator_id(std::string{fit(value.operator_id, 64)});
  auto& spec = to.spec();
  spec.min_gap_m(value.spec.min_gap);
  spec.region_xyxy_m({value.spec.region.min.x(), value.spec.region.min.y(), value.spec.region.max.x(), value.spec.region.max.y()});
  spec.expect_discs(value.spec.expect_discs);
  spec.max_hits(value.spec.max_hits);
  spec.max_pushes(value.spec.max_pushes);
  spec.timeout_ms(value.spec.timeout_ms);
  spec.speed_scale(value.spec.speed_scale);
}

Result<mes::Command, Invalid> Topic<mes::Command>::decode(const Wire& from) {
  mes::Command value;
  value.header = get(from.hdr());
  value.command_id = from.command_id();
  value.order_id = from.order_id();
  value.order_rev = from.order_rev();
  value.verb = from_wire<mes::Verb>(from.verb());
  value.mode = from_wire<mes::UnitMode>(from.mode());
  value.valid_for_ms = from.valid_for_ms();
  value.auth_level = from.auth_level();
  value.operator_id = from.operator_id().to_string();
  const auto& spec = from.spec();
  value.spec.min_gap = spec.min_gap_m();
  const auto& region = spec.region_xyxy_m();
  value.spec.region = {{region[0], region[1]}, {region[2], region[3]}};
  value.spec.expect_discs = spec.expect_discs();
  value.spec.max_hits = spec.max_hits();
  value.spec.max_pushes = spec.max_pushes();
  value.spec.timeout_ms = spec.timeout_ms();
  value.spec.speed_scale = spec.speed_scale();
  return value;
}

void Topic<mes::Ack>::encode(const mes::Ack& value, Wire& to) {
  to.robot_id(value.header.robot_id);
  put(value.header, to.hdr());
  to.command_id(value.command_id);
  to.order_id(value.order_id);
  to.order_rev(value.order_rev);
  to.verdict(to_wire<wire::VerdictKind>(value.verdict));
  to.reason(to_wire<wire::ReasonCode>(value.reason));
  to.detail(value.detail);
  to.state(to_wire<wire::PackState>(value.state));
  to.text(std::string{fit(value.text, 128)});
}

Result<mes::Ack, Invalid> Topic<mes::Ack>::decode(const Wire& from) {
  Door door;
  mes::Ack value;
  value.header = get(from.hdr());
  value.command_id = from.command_id();
  value.order_id = from.order_id();
  value.order_rev = from.order_rev();
  value.verdict = from_wire(door, "verdict", from.verdict(), mes::Verdict::kDuplicate);
  value.reason = from_wire(door, "reason", from.reason(), mes::Reason::kInternal);
  value.detail = from.detail();
  value.state = from_wire(door, "state", from.state(), mes::PackState::kUnholding);
  value.text = from.text().to_string();
  if (!door.good()) return door.why();
  return value;
}

void Topic<mes::JobState>::encode(const mes::JobState& value, Wire& to) {
  to.robot_id(value.header.robot_id);
  to.slot(value.slot);
  put(value.header, to.hdr());
  to.order_id(value.order_id);
  to.order_rev(value.order_rev);
  to.phase(to_wire<wire::JobPhase>(value.phase));
  to.change_no(value.change_no);
  to.progress(static_cast<float>(value.progress));
  to.discs_seen(value.discs_seen);
  to.discs_singulated(value.discs_singulated);
  to.hits(value.hits);
  to.pushes(value.pushes);
  to.t_accepted_ns(value.accepted_utc_ns);
  to.t_started_ns(value.started_utc_ns);
  to.t_ended_ns(value.ended_utc_ns);
  to.min_gap_m(std::isfinite(value.min_gap) ? value.min_gap : kNoGap);
  to.result(to_wire<wire::ReasonCode>(value.result));
  to.text(std::string{fit(value.text, 128)});
}

Result<mes::JobState, Invalid> Topic<mes::JobState>::decode(const Wire& from) {
  Door door;
  door.within("progress", static_cast<double>(from.progress()), 0.0, 1.0);
  door.within("min_gap_m", from.min_gap_m(), -1.0, kNoGap);
  mes::JobState value;
  value.header = get(from.hdr());
  value.slot = from.slot();
  value.order_id = from.order_id();
  value.order_rev = from.order_rev();
  value.phase = from_wire(door, "phase", from.phase(), mes::JobPhase::kAborted);
  value.change_no = from.change_no();
  value.progress = static_cast<double>(from.progress());
  value.discs_seen = from.discs_seen();
  value.discs_singulated = from.discs_singulated();
  value.hits = from.hits();
  value.pushes = from.pushes();
  value.accepted_utc_ns = from.t_accepted_ns();
  value.started_utc_ns = from.t_started_ns();
  value.ended_utc_ns = from.t_ended_ns();
  value.min_gap = from.min_gap_m() >= kNoGap ? std::numeric_limits<double>::infinity() : from.min_gap_m();
  value.result = from_wire(door, "result", from.result(), mes::Reason::kInternal);
  value.text = from.text().to_string();
  if (!door.good()) return door.why();
  return value;
}

void Topic<mes::RobotStatus>::encode(const mes::RobotStatus& value, Wire& to) {
  to.robot_id(value.header.robot_id);
  put(value.header, to.hdr());
  to.boot_id(value.boot_id);
  to.state(to_wire<wire::PackState>(value.state));
  to.mode(to_wire<wire::UnitMode>(value.mode));
  to.safety(to_wire<wire::SafetyState>(value.safety));
  to.paused(value.paused ? 1 : 0);
  to.accepting(value.accepting ? 1 : 0);
  to.active_order(value.active_order);
  to.queue_free(value.queue_free);
  to.mes_age_ms(value.mes_age_ms);
  to.loop_overruns(value.loop_overruns);
  to.loop_max_us(static_cast<float>(value.loop_max_us));
  to.sw_version(std::string{fit(value.sw_version, 32)});
  to.config_sha(std::string{fit(value.config_sha, 64)});
}

Result<mes::RobotStatus, Invalid> Topic<mes::RobotStatus>::decode(const Wire& from) {
  Door door;
  door.enumerated("paused", from.paused(), 1);
  door.enumerated("accepting", from.accepting(), 1);
  door.finite("loop_max_us", static_cast<double>(from.loop_max_us()));
  mes::RobotStatus value;
  value.header = get(from.hdr());
  value.boot_id = from.boot_id();
  value.state = from_wire(door, "state", from.state(), mes::PackState::kUnholding);
  value.mode = from_wire(door, "mode", from.mode(), mes::UnitMode::kManual);
  value.safety = from_wire(door, "safety", from.safety(), mes::SafetyState::kFault);
  value.paused = from.paused() != 0;
  value.accepting = from.accepting() != 0;
  value.active_order = from.active_order();
  value.queue_free = from.queue_free();
  value.mes_age_ms = from.mes_age_ms();
  value.loop_overruns = from.loop_overruns();
  value.loop_max_us = static_cast<double>(from.loop_max_us());
  value.sw_version = from.sw_version().to_string();
  value.config_sha = from.config_sha().to_string();
  if (!door.good()) return door.why();
  return value;
}

void Topic<mes::Alarm>::encode(const mes::Alarm& value, Wire& to) {
  to.robot_id(value.header.robot_id);
  to.code(value.code);
  put(value.header, to.hdr());
  to.occurrence(value.occurrence);
  to.severity(to_wire<wire::SeverityKind>(value.severity));
  to.active(value.active ? 1 : 0);
  to.acked(value.acked ? 1 : 0);
  to.t_raised_ns(value.raised_utc_ns);
  to.t_cleared_ns(value.cleared_utc_ns);
  to.order_id(value.order_id);
  to.value(value.value);
  to.text(std::string{fit(value.text, 128)});
}

Result<mes::Alarm, Invalid> Topic<mes::Alarm>::decode(const Wire& from) {
  Door door;
  door.enumerated("active", from.active(), 1);
  door.enumerated("acked", from.acked(), 1);
  door.finite("value", from.value());
  mes::Alarm value;
  value.header = get(from.hdr());
  value.code = from.code();
  value.occurrence = from.occurrence();
  value.severity = from_wire(door, "severity", from.severity(), mes::Severity::kFatal);
  value.active = from.active() != 0;
  value.acked = from.acked() != 0;
  value.raised_utc_ns = from.t_raised_ns();
  value.cleared_utc_ns = from.t_cleared_ns();
  value.order_id = from.order_id();
  value.value = from.value();
  value.text = from.text().to_string();
  if (!door.good()) return door.why();
  return value;
}

void Topic<mes::Heartbeat>::encode(const mes::Heartbeat& value, Wire& to) {
  to.robot_id(value.header.robot_id);
  put(value.header, to.hdr());
  to.peer_ready(value.peer_ready ? 1 : 0);
}

Result<mes::Heartbeat, Invalid> Topic<mes::Heartbeat>::decode(const Wire& from) {
  Door door;
  door.enumerated("peer_ready", from.peer_ready(), 1);
  if (!door.good()) return door.why();
  return mes::Heartbeat{get(from.hdr()), from.peer_ready() != 0};
}

}  // namespace breakshot::dds
