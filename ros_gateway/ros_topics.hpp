#pragma once

#include "common/dds/topic.hpp"
#include "idl/ros2PubSubTypes.h"

namespace breakshot::dds {

/// Declares Topic<TYPE> for a ROS 2 message that is published as it is: the gateway builds it, so there is nothing to encode or to check.
#define BREAKSHOT_ROS_TOPIC(PACKAGE, TYPE, NAME)                           \
  template <>                                                              \
  struct Topic<PACKAGE::msg::TYPE> {                                       \
    using Wire = PACKAGE::msg::TYPE;                                       \
    using WireSupport = PACKAGE::msg::TYPE##PubSubType;                    \
    static constexpr const char* kName = "rt/" NAME;                       \
    static constexpr Profile kProfile = Profile::kRos;                     \
    static void encode(const Wire& value, Wire& wire) { wire = value; }    \
    static Result<Wire, Invalid> decode(const Wire& wire) { return wire; } \
  }

BREAKSHOT_ROS_TOPIC(sensor_msgs, JointState, "joint_states");
BREAKSHOT_ROS_TOPIC(sensor_msgs, Image, "camera/color/image_raw");
BREAKSHOT_ROS_TOPIC(visualization_msgs, MarkerArray, "scene_markers");

#undef BREAKSHOT_ROS_TOPIC

}  // namespace breakshot::dds
