#pragma once

#include "common/camera_model.hpp"
#include "common/dds/topic.hpp"
#include "common/frames.hpp"
#include "common/health.hpp"
#include "common/joints.hpp"
#include "common/scene.hpp"
#include "common/sim_interface.hpp"
#include "common/stroke.hpp"
#include "common/task.hpp"
#include "idl/cellPubSubTypes.h"

// The topics of the cell (docs/topics.md): which value travels under which name, how, and what the receiver checks.

namespace breakshot::dds {

/// Declares Topic<VALUE>, which travels as the generated type WIRE. The codec is in the .cpp of this folder named after the subject.
#define BREAKSHOT_CELL_TOPIC(VALUE, WIRE, NAME, PROFILE)       \
  template <>                                                  \
  struct Topic<VALUE> {                                        \
    using Wire = breakshot_msgs::msg::WIRE;                    \
    using WireSupport = breakshot_msgs::msg::WIRE##PubSubType; \
    static constexpr const char* kName = "rt/" NAME;           \
    static constexpr Profile kProfile = PROFILE;               \
    static void encode(const VALUE& value, Wire& wire);        \
    static Result<VALUE, Invalid> decode(const Wire& wire);    \
  }

BREAKSHOT_CELL_TOPIC(JointState, JointState, "cell/joint_state", Profile::kStream);
BREAKSHOT_CELL_TOPIC(JointCommand, JointCommand, "cell/joint_command", Profile::kStream);
BREAKSHOT_CELL_TOPIC(ColorFrame, ColorFrame, "cell/color", Profile::kFrame);
BREAKSHOT_CELL_TOPIC(DepthFrame, DepthFrame, "cell/depth", Profile::kFrame);
BREAKSHOT_CELL_TOPIC(CameraModel, CameraInfo, "cell/camera_info", Profile::kLatched);
BREAKSHOT_CELL_TOPIC(Scene, Scene, "cell/scene", Profile::kStream);
BREAKSHOT_CELL_TOPIC(StrokeRequest, Stroke, "cell/stroke", Profile::kRequest);
BREAKSHOT_CELL_TOPIC(StrokeStatus, StrokeStatus, "cell/stroke_status", Profile::kRequest);
BREAKSHOT_CELL_TOPIC(TaskRequest, Task, "cell/task", Profile::kRequest);
BREAKSHOT_CELL_TOPIC(TaskStatus, TaskStatus, "cell/task_status", Profile::kRequest);
BREAKSHOT_CELL_TOPIC(Plan, Plan, "cell/plan", Profile::kRequest);
BREAKSHOT_CELL_TOPIC(Outcome, Outcome, "cell/outcome", Profile::kRequest);
BREAKSHOT_CELL_TOPIC(Health, Health, "cell/health", Profile::kEvent);
BREAKSHOT_CELL_TOPIC(SimControl, SimControl, "sim/control", Profile::kRequest);
BREAKSHOT_CELL_TOPIC(SimTruth, SimTruth, "sim/truth", Profile::kStream);

#undef BREAKSHOT_CELL_TOPIC

/// Scenes are checked to lie within this distance of the world's origin, m; it only has to keep absurd numbers out.
inline constexpr double kFarthest = 10.0;

}  // namespace breakshot::dds
