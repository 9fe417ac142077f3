#include "ros_gateway/markers.hpp"

namespace breakshot::ros {

namespace vis = visualization_msgs::msg;

namespace {

// visualization_msgs/Marker.msg
enum class Type : std::int32_t { kArrow = 0, kCylinder = 3, kLineList = 5 };
enum class Action : std::int32_t { kAdd = 0, kDeleteAll = 3 };

constexpr double kContactWidth = 0.004;  // m, as drawn
constexpr double kArrowShaft = 0.008;    // m
constexpr double kRingHeight = 0.001;    // m
constexpr double kDrawnRunUp = 0.10;     // m, arrow of a hit

geometry_msgs::msg::Point point(const Vector2& p, double z) {
  geometry_msgs::msg::Point to;
  to.x(p.x());
  to.y(p.y());
  to.z(z);
  return to;
}

std_msgs::msg::ColorRGBA colour(float r, float g, float b, float a) {
  std_msgs::msg::ColorRGBA to;
  to.r(r);
  to.g(g);
  to.b(b);
  to.a(a);
  return to;
}

vis::Marker marker(const Scene& scene, const char* ns, std::int32_t id, Type type) {
  vis::Marker m;
  m.header().stamp(to_ros(scene.exposed));
  m.header().frame_id("world");
  m.ns(ns);
  m.id(id);
  m.type(static_cast<std::int32_t>(type));
  m.action(static_cast<std::int32_t>(Action::kAdd));
  m.pose().orientation().w(1.0);
  return m;
}

vis::Marker cylinder(const Scene& scene, const char* ns, std::int32_t id, const Vector2& p, double radius, double height) {
  vis::Marker m = marker(scene, ns, id, Type::kCylinder);
  m.pose().position(point(p, height / 2));
  m.scale().x(2 * radius);
  m.scale().y(2 * radius);
  m.scale().z(height);
  return m;
}

vis::Marker stroke_arrow(const Scene& scene, const StrokeRequest& stroke, double height) {
  vis::Marker m = marker(scene, "stroke", 0, Type::kArrow);
  const bool push = stroke.kind == StrokeKind::kPush;
  const Vector2 begin = push ? stroke.p_WS : Vector2{stroke.p_WS - kDrawnRunUp * stroke.direction_W};
  const Vector2 end = push ? Vector2{stroke.p_WS + stroke.length * stroke.direction_W} : stroke.p_WS;
  m.points({point(begin, height), point(end, height)});
  m.scale().x(kArrowShaft);
  m.scale().y(2 * kArrowShaft);
  m.scale().z(3 * kArrowShaft);
  m.color(push ? colour(0.1F, 0.8F, 0.2F, 1.0F) : colour(0.9F, 0.1F, 0.1F, 1.0F));
  return m;
}

}  // namespace

builtin_interfaces::msg::Time to_ros(Time time) {
  constexpr std::int64_t kNsPerS = 1'000'000'000;
  const std::int64_t ns = to_ns(time);
  std::int64_t seconds = ns / kNsPerS;
  if (ns % kNsPerS < 0) --seconds;
  builtin_interfaces::msg::Time to;
  to.sec(static_cast<std::int32_t>(seconds));
  to.nanosec(static_cast<std::uint32_t>(ns - seconds * kNsPerS));
  return to;
}

vis::MarkerArray make_markers(const Scene& scene, const std::optional<Plan>& plan, const MarkerStyle& style) {
  vis::MarkerArray array;
  auto& markers = array.markers();
  vis::Marker clear = marker(scene, "", 0, Type::kArrow);
  clear.action(static_cast<std::int32_t>(Action::kDeleteAll));
  markers.push_back(clear);

  for (const auto& disc : scene.discs) {
    vis::Marker m = cylinder(scene, "discs", static_cast<std::int32_t>(disc.id), disc.p_WD, disc.radius, style.disc_height);
    const std::array<float, 3> grey{0.5F, 0.5F, 0.5F};
    const auto& rgb = disc.colour < style.colours.size() ? style.colours[disc.colour] : grey;
    m.color(colour(rgb[0], rgb[1], rgb[2], 1.0F));
    markers.push_back(std::move(m));
  }
  if (!scene.contacts.empty()) {
    vis::Marker lines = marker(scene, "contacts", 0, Type::kLineList);
    lines.scale().x(kContactWidth);
    lines.color(colour(1.0F, 0.2F, 0.0F, 1.0F));
    for (const auto& contact : scene.contacts) {
      // A Marker of ours holds at most 64 points: 32 contacts are more than anyone can read.
      if (lines.points().size() + 2 > 64) break;
      lines.points().push_back(point(scene.discs[contact.a].p_WD, style.disc_height));
      lines.points().push_back(point(scene.discs[contact.b].p_WD, style.disc_height));
    }
    markers.push_back(std::move(lines));
  }
  if (plan) {
    if (plan->stroke.kind != StrokeKind::kPark) markers.push_back(stroke_arrow(scene, plan->stroke, style.disc_height));
    for (std::size_t i = 0; i < plan->predicted_p_WD.size() && i < scene.discs.size(); ++i) {
      vis::Marker ring =
          cylinder(scene, "predicted", static_cast<std::int32_t>(i), plan->predicted_p_WD[i], scene.discs[i].radius, kRingHeight);
      ring.color(colour(1.0F, 1.0F, 1.0F, 0.35F));
      markers.push_back(std::move(ring));
    }
  }
  return array;
}

}  // namespace breakshot::ros
