#include "ros_gateway/ros_gateway_node.hpp"

int main(int argc, char** argv) {
  return breakshot::process::run_process({"ros_gateway", "Shows the cell to ROS 2 tools (RViz, Foxglove, rclpy)."}, argc, argv,
                                         breakshot::ros::run_ros_gateway);
}
