#include "common/dds/cell_topics.hpp"
#include "common/dds/door.hpp"

// sim/control and sim/truth: tests and scoring only.

namespace breakshot::dds {

namespace {

using WireDisc = breakshot_msgs::msg::SimDisc;

void put(const std::vector<SimDisc>& from, std::vector<WireDisc>& to) {
  to.resize(std::min(from.size(), kMaxSceneDiscs));
  for (std::size_t i = 0; i < to.size(); ++i) {
    to[i].p_wd({from[i].p_WD.x(), from[i].p_WD.y()});
    to[i].v_wd({from[i].v_WD_W.x(), from[i].v_WD_W.y()});
    to[i].yaw(from[i].yaw);
    to[i].radius(from[i].radius);
    to[i].height(from[i].height);
    to[i].mass(from[i].mass);
    to[i].colour(from[i].colour);
    to[i].on_table(from[i].on_table ? 1 : 0);
  }
}

std::vector<SimDisc> get(Door& door, const std::vector<WireDisc>& from) {
  door.at_most("discs", from.size(), kMaxSceneDiscs);
  std::vector<SimDisc> to;
  for (const auto& disc : from) {
    for (const double value : disc.p_wd()) door.within("discs[].p_wd", value, -kFarthest, kFarthest);
    for (const double value : disc.v_wd()) door.within("discs[].v_wd", value, -100.0, 100.0);
    door.finite("discs[].yaw", disc.yaw());
    door.within("discs[].radius", disc.radius(), 1e-3, 1.0);
    door.within("discs[].height", disc.height(), 1e-3, 1.0);
    door.within("discs[].mass", disc.mass(), 1e-4, 100.0);
    door.enumerated("discs[].on_table", disc.on_table(), 1);
    to.push_back({{disc.p_wd()[0], disc.p_wd()[1]},
                  {disc.v_wd()[0], disc.v_wd()[1]},
                  disc.yaw(),
                  disc.radius(),
                  disc.height(),
                  disc.mass(),
                  disc.colour(),
                  disc.on_table() != 0});
  }
  return to;
}

}  // namespace

void Topic<SimControl>::encode(const SimControl& value, Wire& wire) {
  wire.seq(value.seq);
  wire.verb(static_cast<std::uint8_t>(value.verb));
  wire.fault(value.fault);
  wire.fault_value(value.fault_value);
  wire.formation(std::string{fit(value.formation, 255)});
  put(value.discs, wire.discs());
}

Result<SimControl, Invalid> Topic<SimControl>::decode(const Wire& wire) {
  Door door;
  door.enumerated("verb", wire.verb(), static_cast<unsigned>(SimControl::Verb::kClearFaults));
  door.finite("fault_value", wire.fault_value());
  SimControl value;
  value.discs = get(door, wire.discs());
  if (!door.good()) return door.why();
  value.seq = wire.seq();
  value.verb = static_cast<SimControl::Verb>(wire.verb());
  value.fault = wire.fault();
  value.fault_value = wire.fault_value();
  value.formation = wire.formation().to_string();
  return value;
}

void Topic<SimTruth>::encode(const SimTruth& value, Wire& wire) {
  wire.seq(value.seq);
  wire.control_seq(value.control_seq);
  wire.stamp_ns(to_ns(value.stamp));
  wire.p_wt({value.p_WT.x(), value.p_WT.y(), value.p_WT.z()});
  wire.v_wt({value.v_WT_W.x(), value.v_WT_W.y(), value.v_WT_W.z()});
  wire.kinetic_energy(value.kinetic_energy);
  wire.strikes(value.strikes);
  put(value.discs, wire.discs());
}

Result<SimTruth, Invalid> Topic<SimTruth>::decode(const Wire& wire) {
  Door door;
  door.all_finite("p_wt", wire.p_wt());
  door.all_finite("v_wt", wire.v_wt());
  door.finite("kinetic_energy", wire.kinetic_energy());
  SimTruth value;
  value.discs = get(door, wire.discs());
  if (!door.good()) return door.why();
  value.seq = wire.seq();
  value.control_seq = wire.control_seq();
  value.stamp = time_from_ns(wire.stamp_ns());
  value.p_WT = {wire.p_wt()[0], wire.p_wt()[1], wire.p_wt()[2]};
  value.v_WT_W = {wire.v_wt()[0], wire.v_wt()[1], wire.v_wt()[2]};
  value.kinetic_energy = wire.kinetic_energy();
  value.strikes = wire.strikes();
  return value;
}

}  // namespace breakshot::dds
