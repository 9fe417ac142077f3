#pragma once

#include "common/scene.hpp"
#include "common/task.hpp"
#include "idl/ros2.h"

#include <array>
#include <optional>
#include <vector>

namespace breakshot::ros {

/// A point of the cell's clock as ROS 2 tells time.
builtin_interfaces::msg::Time to_ros(Time time);

/// How the table and the plan look in RViz or Foxglove.
struct MarkerStyle {
  double disc_height = 0.020;                 ///< m
  std::vector<std::array<float, 3>> colours;  ///< of the discs, by SceneDisc::colour
};

/// Discs as cylinders, contacts as lines between centres, the chosen stroke as an arrow, predicted rests as flat rings; frame "world".
///
/// Starts with DELETEALL, so that what is gone from the scene goes from the display.
visualization_msgs::msg::MarkerArray make_markers(const Scene& scene, const std::optional<Plan>& plan, const MarkerStyle& style);

}  // namespace breakshot::ros
