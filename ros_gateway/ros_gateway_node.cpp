#include "ros_gateway/ros_gateway_node.hpp"

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/process/health_publisher.hpp"
#include "common/urdf/arm_description.hpp"
#include "ros_gateway/markers.hpp"
#include "ros_gateway/ros_gateway_config.hpp"
#include "ros_gateway/ros_topics.hpp"

#include <atomic>
#include <mutex>
#include <optional>

namespace breakshot::ros {

namespace {

/// The newest value that a DDS thread left, taken once.
template <typename T>
class Newest {
 public:
  void put(T&& value) {
    const std::lock_guard lock{mutex_};
    value_ = std::move(value);
  }
  std::optional<T> take() {
    const std::lock_guard lock{mutex_};
    return std::exchange(value_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::optional<T> value_;
};

/// Lets something happen at most once per period.
class Pace {
 public:
  explicit Pace(Duration period) : period_{period} {}
  bool due(Time now) {
    if (now - last_ < period_) return false;
    last_ = now;
    return true;
  }

 private:
  Duration period_;
  Time last_{};
};

sensor_msgs::msg::JointState joint_message(const JointState& state, const ArmDescription& arm) {
  sensor_msgs::msg::JointState message;
  message.header().stamp(to_ros(state.stamp));
  message.header().frame_id("base");
  for (Eigen::Index i = 0; i < state.q.size() && i < static_cast<Eigen::Index>(arm.joints.size()); ++i) {
    message.name().emplace_back(arm.joints[static_cast<std::size_t>(i)].name);
    message.position().push_back(state.q[i]);
    message.velocity().push_back(state.qd[i]);
    message.effort().push_back(state.tau[i]);
  }
  return message;
}

sensor_msgs::msg::Image image_message(ColorFrame&& frame) {
  sensor_msgs::msg::Image message;
  message.header().stamp(to_ros(frame.exposed));
  message.header().frame_id("camera_color_optical_frame");
  message.height(static_cast<std::uint32_t>(frame.height));
  message.width(static_cast<std::uint32_t>(frame.width));
  message.encoding("rgb8");
  message.is_bigendian(0);
  message.step(static_cast<std::uint32_t>(3 * frame.width));
  message.data(std::move(frame.rgb));
  return message;
}

}  // namespace

void run_ros_gateway(process::Process& process) {
  const CellConfig& cell = process.cell();
  const ArmDescription arm = load_arm(cell.arm.urdf, cell.arm.base_link, cell.arm.tip_link);
  const RosGatewayConfig config = load_ros_gateway_config(process.config().section("ros_gateway"));
  MarkerStyle style;
  style.disc_height = cell.disc_height;
  for (const auto& colour : cell.colours) {
    style.colours.push_back({static_cast<float>(colour.rgb[0]) / 255.0F, static_cast<float>(colour.rgb[1]) / 255.0F,
                             static_cast<float>(colour.rgb[2]) / 255.0F});
  }

  dds::Participant inner{cell.dds.cell, "breakshot-ros_gateway"};
  dds::Participant outer{cell.dds.ros2, "breakshot", config.interfaces};
  dds::Writer<sensor_msgs::msg::JointState> joints{outer};
  dds::Writer<sensor_msgs::msg::Image> images{outer};
  dds::Writer<visualization_msgs::msg::MarkerArray> marker_arrays{outer};

  Newest<JointState> joint_state;
  Newest<ColorFrame> color;
  Newest<Scene> scene;
  Newest<Plan> new_plan;
  std::optional<Plan> plan;
  std::atomic<std::uint64_t> cycles{0};
  std::uint64_t cycles_reported = 0;

  const dds::Subscription<JointState> joint_states{inner, [&](JointState&& m) { joint_state.put(std::move(m)); }};
  const dds::Subscription<ColorFrame> colors{inner, [&](ColorFrame&& m) { color.put(std::move(m)); }};
  const dds::Subscription<Scene> scenes{inner, [&](Scene&& m) { scene.put(std::move(m)); }};
  const dds::Subscription<Plan> plans{inner, [&](Plan&& m) { new_plan.put(std::move(m)); }};
  const process::HealthPublisher health{process, inner, [&](Health& h) {
                                          h.state = HealthState::kReady;
                                          h.text = "shows the cell on ROS domain " + std::to_string(cell.dds.ros2);
                                          h.cycles = cycles;
                                          return std::exchange(cycles_reported, h.cycles) != h.cycles;
                                        }};
  process.ready("shows the cell on ROS domain " + std::to_string(cell.dds.ros2));

  Pace joint_pace{config.joints_every};
  Pace image_pace{config.image_every};
  Pace marker_pace{config.markers_every};
  while (!process.wait(std::chrono::milliseconds{10})) {
    ++cycles;
    const Time now = process::monotonic_now();
    if (joint_pace.due(now)) {
      if (const auto state = joint_state.take()) joints.write(joint_message(*state, arm));
    }
    if (image_pace.due(now)) {
      if (auto frame = color.take()) images.write(image_message(std::move(*frame)));
    }
    if (marker_pace.due(now)) {
      if (auto newer = new_plan.take()) plan = std::move(newer);
      if (const auto seen = scene.take()) marker_arrays.write(make_markers(*seen, plan, style));
    }
  }
}

}  // namespace breakshot::ros
