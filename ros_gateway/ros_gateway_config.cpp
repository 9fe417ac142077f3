#include "ros_gateway/ros_gateway_config.hpp"

namespace breakshot::ros {

RosGatewayConfig load_ros_gateway_config(const ConfigNode& section) {
  RosGatewayConfig config{section.texts("interfaces")};
  section.finish();
  return config;
}

}  // namespace breakshot::ros
