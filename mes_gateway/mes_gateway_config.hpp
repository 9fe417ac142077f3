#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "mes_gateway/order_desk.hpp"

#include <string>
#include <vector>

namespace breakshot::mes {

struct MesGatewayConfig {
  OrderLimits orders;
  std::vector<std::string> interfaces;  ///< IPv4 addresses through which the factory is reached; empty: all
};

/// Reads section `mes_gateway`; what an order gets by default comes from section `cell`. @throws ConfigError
MesGatewayConfig load_mes_gateway_config(const ConfigNode& section, const CellConfig& cell);

}  // namespace breakshot::mes
