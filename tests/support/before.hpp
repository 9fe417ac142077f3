#pragma once

#include "controller/motion/trajectory.hpp"

#include <cstddef>

namespace breakshot::support {

/// Where a stroke begins that takes over from another one.
struct Before {
  const motion::Trajectory& trajectory;
  std::size_t tick = 0;  ///< above 0
};

}  // namespace breakshot::support
