#include "common/dds/cell_topics.hpp"
#include "common/dds/door.hpp"

#include <limits>

// Scene, strokes.

namespace breakshot::dds {

void Topic<Scene>::encode(const Scene& value, Wire& wire) {
  wire.seq(value.seq);
  wire.frame_seq(value.frame_seq);
  wire.exposed_ns(to_ns(value.exposed));
  wire.age_ns(value.age.count());
  wire.at_rest(value.at_rest ? 1 : 0);
  wire.quality(static_cast<std::uint8_t>(value.quality));
  // Infinity ("a disc came or went") travels as a negative speed, so that NaN and infinity stay errors on the wire.
  wire.max_speed(std::isfinite(value.max_speed) ? value.max_speed : -1.0);
  wire.text(std::string{fit(value.text, 255)});
  const auto discs = std::min(value.discs.size(), kMaxSceneDiscs);
  wire.discs().resize(discs);
  for (std::size_t i = 0; i < discs; ++i) {
    const auto& disc = value.discs[i];
    auto& to = wire.discs()[i];
    to.id(disc.id);
    to.p_wd({disc.p_WD.x(), disc.p_WD.y()});
    to.covariance({disc.covariance(0, 0), disc.covariance(0, 1), disc.covariance(1, 0), disc.covariance(1, 1)});
    to.v_wd({disc.v_WD_W.x(), disc.v_WD_W.y()});
    to.radius(disc.radius);
    to.radius_sigma(disc.radius_sigma);
    to.colour(disc.colour);
    to.complete(disc.complete ? 1 : 0);
  }
  const auto contacts = std::min(value.contacts.size(), kMaxSceneContacts);
  wire.contacts().resize(contacts);
  for (std::size_t i = 0; i < contacts; ++i) {
    const auto& contact = value.contacts[i];
    auto& to = wire.contacts()[i];
    to.a(contact.a);
    to.b(contact.b);
    to.gap(contact.gap);
    to.p_touch(contact.p_touch);
    to.push_start({contact.push_start_W.x(), contact.push_start_W.y()});
    to.push_direction({contact.push_direction_W.x(), contact.push_direction_W.y()});
    to.contour_length(contact.contour_length);
  }
  const auto foreign = std::min(value.foreign.size(), kMaxSceneForeign);
  wire.foreign().resize(foreign);
  for (std::size_t i = 0; i < foreign; ++i) {
    const auto& object = value.foreign[i];
    auto& to = wire.foreign()[i];
    to.kind(static_cast<std::uint8_t>(object.kind));
    to.p_w({object.p_W.x(), object.p_W.y()});
    to.extent(object.extent);
    to.height(object.height);
  }
}

namespace {

Vector2 point(const std::array<double, 2>& from) { return {from[0], from[1]}; }

void check_point(Door& door, std::string_view field, const std::array<double, 2>& p) {
  door.within(field, p[0], -kFarthest, kFarthest);
  door.within(field, p[1], -kFarthest, kFarthest);
}

constexpr double kLargestRadius = 1.0;  // m
constexpr double kFastestDisc = 100.0;  // m/s

SceneDisc decode_disc(Door& door, const breakshot_msgs::msg::SceneDisc& wire) {
  check_point(door, "discs[].p_wd", wire.p_wd());
  for (const double c : wire.covariance()) door.within("discs[].covariance", c, -1.0, 1.0);
  for (const double v : wire.v_wd()) door.within("discs[].v_wd", v, -kFastestDisc, kFastestDisc);
  door.within("discs[].radius", wire.radius(), 1e-4, kLargestRadius);
  door.within("discs[].radius_sigma", wire.radius_sigma(), 0.0, kLargestRadius);
  door.enumerated("discs[].complete", wire.complete(), 1);
  SceneDisc disc;
  disc.id = wire.id();
  disc.p_WD = point(wire.p_wd());
  disc.covariance << wire.covariance()[0], wire.covariance()[1], wire.covariance()[2], wire.covariance()[3];
  disc.v_WD_W = point(wire.v_wd());
  disc.radius = wire.radius();
  disc.radius_sigma = wire.radius_sigma();
  disc.colour = wire.colour();
  disc.complete = wire.complete() != 0;
  return disc;
}

SceneContact decode_contact(Door& door, const breakshot_msgs::msg::SceneContact& wire, std::size_t discs) {
  door.check(wire.a() < wire.b() && wire.b() < discs, "contacts[].a, b are not two discs of the scene in ascending order");
  door.within("contacts[].gap", wire.gap(), -kLargestRadius, kFarthest);
  door.within("contacts[].p_touch", wire.p_touch(), 0.0, 1.0);
  check_point(door, "contacts[].push_start", wire.push_start());
  check_point(door, "contacts[].push_direction", wire.push_direction());
  door.within("contacts[].contour_length", wire.contour_length(), 0.0, kFarthest);
  return {wire.a(), wire.b(), wire.gap(), wire.p_touch(), point(wire.push_start()), point(wire.push_direction()), wire.contour_length()};
}

ForeignObject decode_foreign(Door& door, const breakshot_msgs::msg::SceneForeign& wire) {
  door.enumerated("foreign[].kind", wire.kind(), static_cast<unsigned>(ForeignObject::Kind::kOffTable));
  check_point(door, "foreign[].p_w", wire.p_w());
  door.within("foreign[].extent", wire.extent(), 0.0, kFarthest);
  door.within("foreign[].height", wire.height(), -kFarthest, kFarthest);
  return {static_cast<ForeignObject::Kind>(wire.kind()), point(wire.p_w()), wire.extent(), wire.height()};
}

}  // namespace

Result<Scene, Invalid> Topic<Scene>::decode(const Wire& wire) {
  Door door;
  door.enumerated("quality", wire.quality(), static_cast<unsigned>(SceneQuality::kMisplaced));
  door.enumerated("at_rest", wire.at_rest(), 1);
  door.within("max_speed", wire.max_speed(), -1.0, kFastestDisc);
  door.at_most("discs", wire.discs().size(), kMaxSceneDiscs);
  door.at_most("contacts", wire.contacts().size(), kMaxSceneContacts);
  door.at_most("foreign", wire.foreign().size(), kMaxSceneForeign);
  if (!door.good()) return door.why();
  Scene value;
  value.seq = wire.seq();
  value.frame_seq = wire.frame_seq();
  value.exposed = time_from_ns(wire.exposed_ns());
  value.age = Duration{wire.age_ns()};
  value.at_rest = wire.at_rest() != 0;
  value.quality = static_cast<SceneQuality>(wire.quality());
  value.max_speed = wire.max_speed() < 0.0 ? std::numeric_limits<double>::infinity() : wire.max_speed();
  value.text = wire.text().to_string();
  for (const auto& disc : wire.discs()) value.discs.push_back(decode_disc(door, disc));
  for (const auto& contact : wire.contacts()) value.contacts.push_back(decode_contact(door, contact, wire.discs().size()));
  for (const auto& object : wire.foreign()) value.foreign.push_back(decode_foreign(door, object));
  if (!door.good()) return door.why();
  return value;
}

void Topic<StrokeRequest>::encode(const StrokeRequest& value, Wire& wire) {
  wire.id(value.id);
  wire.kind(static_cast<std::uint8_t>(value.kind));
  wire.p_ws({value.p_WS.x(), value.p_WS.y()});
  wire.direction({value.direction_W.x(), value.direction_W.y()});
  wire.speed(value.speed);
  wire.run_in(value.run_in);
  wire.length(value.length);
  wire.park_after(value.park_after ? 1 : 0);
}

// Only the form is checked here: whether the numbers make a stroke is for the stroke planner, which answers with a refusal that says why.
Result<StrokeRequest, Invalid> Topic<StrokeRequest>::decode(const Wire& wire) {
  Door door;
  door.enumerated("kind", wire.kind(), static_cast<unsigned>(StrokeKind::kRecover));
  door.enumerated("park_after", wire.park_after(), 1);
  door.check(wire.id() != 0, "id is 0; allowed: from 1");
  if (!door.good()) return door.why();
  return StrokeRequest{wire.id(),          static_cast<StrokeKind>(wire.kind()),
                       point(wire.p_ws()), point(wire.direction()),
                       wire.speed(),       wire.run_in(),
                       wire.length(),      wire.park_after() != 0};
}

void Topic<StrokeStatus>::encode(const StrokeStatus& value, Wire& wire) {
  wire.id(value.id);
  wire.phase(static_cast<std::uint8_t>(value.phase));
  wire.reason(static_cast<std::uint8_t>(value.reason));
  wire.attainable(value.attainable);
  wire.stamp_ns(to_ns(value.stamp));
  wire.planned_contact_ns(value.planned_contact.count());
  wire.planned_total_ns(value.planned_total.count());
  wire.contact_speed(value.contact_speed);
  wire.text(std::string{fit(value.text, 255)});
}

Result<StrokeStatus, Invalid> Topic<StrokeStatus>::decode(const Wire& wire) {
  Door door;
  door.enumerated("phase", wire.phase(), static_cast<unsigned>(StrokePhase::kStopped));
  door.enumerated("reason", wire.reason(), static_cast<unsigned>(RefusalReason::kStopped));
  door.finite("attainable", wire.attainable());
  door.finite("contact_speed", wire.contact_speed());
  if (!door.good()) return door.why();
  StrokeStatus value;
  value.id = wire.id();
  value.phase = static_cast<StrokePhase>(wire.phase());
  value.reason = static_cast<RefusalReason>(wire.reason());
  value.attainable = wire.attainable();
  value.stamp = time_from_ns(wire.stamp_ns());
  value.planned_contact = Duration{wire.planned_contact_ns()};
  value.planned_total = Duration{wire.planned_total_ns()};
  value.contact_speed = wire.contact_speed();
  value.text = wire.text().to_string();
  return value;
}

}  // namespace breakshot::dds
