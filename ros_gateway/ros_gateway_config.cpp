#include "ros_gateway/ros_gateway_config.hpp"

namespace breakshot::ros {

RosGatewayConfig load_ros_gateway_config(const ConfigNode& section) {
  RosGatewayConfig config;
  config.interfaces = section.texts("interfaces");
  config.joints_every = from_seconds(1.0 / section.number("joint_rate", {0.1, 500.0}, "Hz"));
  config.image_every = from_seconds(1.0 / section.number("image_rate", {0.1, 30.0}, "Hz"));
  config.markers_every = from_seconds(1.0 / section.number("marker_rate", {0.1, 60.0}, "Hz"));
  section.finish();
  return config;
}

}  // namespace breakshot::ros
