#pragma once

#include "common/config/config_node.hpp"
#include "common/time.hpp"

#include <string>
#include <vector>

namespace breakshot::ros {

struct RosGatewayConfig {
  std::vector<std::string> interfaces;  ///< IPv4 addresses through which ROS 2 tools are reached; empty: all
  Duration joints_every{};
  Duration image_every{};
  Duration markers_every{};
};

/// Reads section `ros_gateway`. @throws ConfigError
RosGatewayConfig load_ros_gateway_config(const ConfigNode& section);

}  // namespace breakshot::ros
