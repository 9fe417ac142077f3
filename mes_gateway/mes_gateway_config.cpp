#include "mes_gateway/mes_gateway_config.hpp"

namespace breakshot::mes {

MesGatewayConfig load_mes_gateway_config(const ConfigNode& section, const CellConfig& cell) {
  constexpr std::int64_t kMostStrokes = 1000;
  MesGatewayConfig config;
  config.interfaces = section.texts("interfaces");
  auto& orders = config.orders;
  orders.robot_id = static_cast<std::uint32_t>(section.integer("robot_id", 1, 1'000'000));
  orders.workspace = cell.workspace;
  orders.default_gap = cell.target_gap;
  orders.most_gap = section.number("most_gap", {cell.target_gap, 0.5}, "m");
  orders.most_strokes = static_cast<std::uint32_t>(section.integer("most_strokes", 1, kMostStrokes));
  orders.default_hits = static_cast<std::uint32_t>(section.integer("default_hits", 1, orders.most_strokes));
  orders.default_pushes = static_cast<std::uint32_t>(section.integer("default_pushes", 1, orders.most_strokes));
  orders.most_timeout = from_seconds(section.number("most_timeout_s", {1.0, 86400.0}, "s"));
  orders.default_timeout = from_seconds(section.number("default_timeout_s", {1.0, to_seconds(orders.most_timeout)}, "s"));
  section.finish();
  return config;
}

}  // namespace breakshot::mes
