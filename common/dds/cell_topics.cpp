#include "common/dds/cell_topics.hpp"
#include "common/dds/door.hpp"

#include <algorithm>

// Joints, images, camera and health.

namespace breakshot::dds {

namespace {

using WireJoints = std::array<double, kMaxJoints>;
/// A pose without its last line, 0 0 0 1.
using WirePose = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

void put(const JointVector& from, WireJoints& to) {
  to.fill(0.0);
  std::copy(from.data(), from.data() + from.size(), to.begin());
}

JointVector get(const WireJoints& from, std::size_t joints) {
  JointVector to{static_cast<Eigen::Index>(joints)};
  std::copy_n(from.begin(), joints, to.data());
  return to;
}

// Generous physical bounds: they keep rubbish out; the arm's own limits are the controller's and the drives' business.
constexpr double kMostAngle = 100.0;   // rad
constexpr double kMostSpeed = 1000.0;  // rad/s
constexpr double kMostOther = 1e6;     // rad/s^2, N m

void check_joints(Door& door, std::string_view field, const WireJoints& values, double most) {
  for (const double value : values) door.within(field, value, -most, most);
}

constexpr double kLongestSpan = 1e12;  // us: eleven days

void put(const LoopTail& from, breakshot_msgs::msg::LoopTail& to) {
  to.p50_us(from.p50_us);
  to.p99_us(from.p99_us);
  to.p999_us(from.p999_us);
  to.p9999_us(from.p9999_us);
  to.max_us(from.max_us);
}

LoopTail get(const breakshot_msgs::msg::LoopTail& from) {
  return {from.p50_us(), from.p99_us(), from.p999_us(), from.p9999_us(), from.max_us()};
}

void check_tail(Door& door, std::string_view field, const breakshot_msgs::msg::LoopTail& tail) {
  for (const double value : {tail.p50_us(), tail.p99_us(), tail.p999_us(), tail.p9999_us(), tail.max_us()})
    door.within(field, value, 0.0, kLongestSpan);
}

}  // namespace

// Plain types whose C++ layout must equal their CDR layout, because Fast DDS copies them as they are.
static_assert(sizeof(breakshot_msgs::msg::ColorFrame) % 8 == 0 && sizeof(breakshot_msgs::msg::DepthFrame) % 8 == 0);

void Topic<JointState>::encode(const JointState& value, Wire& wire) {
  wire.seq(value.seq);
  wire.session(value.session);
  wire.stamp_ns(to_ns(value.stamp));
  wire.command_seq(value.command_seq);
  wire.joints(static_cast<std::uint32_t>(value.q.size()));
  wire.braked(value.braked ? 1 : 0);
  put(value.q, wire.q());
  put(value.qd, wire.qd());
  put(value.tau, wire.tau());
}

Result<JointState, Invalid> Topic<JointState>::decode(const Wire& wire) {
  Door door;
  door.check(wire.joints() >= 1 && wire.joints() <= kMaxJoints, "joints is not 1 to 7");
  door.enumerated("braked", wire.braked(), 1);
  check_joints(door, "q", wire.q(), kMostAngle);
  check_joints(door, "qd", wire.qd(), kMostSpeed);
  check_joints(door, "tau", wire.tau(), kMostOther);
  if (!door.good()) return door.why();
  JointState value;
  value.seq = wire.seq();
  value.session = wire.session();
  value.stamp = time_from_ns(wire.stamp_ns());
  value.command_seq = wire.command_seq();
  value.braked = wire.braked() != 0;
  value.q = get(wire.q(), wire.joints());
  value.qd = get(wire.qd(), wire.joints());
  value.tau = get(wire.tau(), wire.joints());
  return value;
}

void Topic<JointCommand>::encode(const JointCommand& value, Wire& wire) {
  wire.seq(value.seq);
  wire.session(value.session);
  wire.state_seq(value.state_seq);
  wire.due_ns(to_ns(value.due));
  wire.joints(static_cast<std::uint32_t>(value.q.size()));
  wire.reserved(0);
  put(value.q, wire.q());
  put(value.qd, wire.qd());
  put(value.qdd, wire.qdd());
}

Result<JointCommand, Invalid> Topic<JointCommand>::decode(const Wire& wire) {
  Door door;
  door.check(wire.joints() >= 1 && wire.joints() <= kMaxJoints, "joints is not 1 to 7");
  check_joints(door, "q", wire.q(), kMostAngle);
  check_joints(door, "qd", wire.qd(), kMostSpeed);
  check_joints(door, "qdd", wire.qdd(), kMostOther);
  if (!door.good()) return door.why();
  JointCommand value;
  value.seq = wire.seq();
  value.session = wire.session();
  value.state_seq = wire.state_seq();
  value.due = time_from_ns(wire.due_ns());
  value.q = get(wire.q(), wire.joints());
  value.qd = get(wire.qd(), wire.joints());
  value.qdd = get(wire.qdd(), wire.joints());
  return value;
}

void Topic<ColorFrame>::encode(const ColorFrame& value, Wire& wire) {
  wire.seq(value.seq);
  wire.stamp_ns(to_ns(value.exposed));
  wire.width(static_cast<std::uint32_t>(value.width));
  wire.height(static_cast<std::uint32_t>(value.height));
  std::copy_n(value.rgb.begin(), std::min(value.rgb.size(), wire.data().size()), wire.data().begin());
}

Result<ColorFrame, Invalid> Topic<ColorFrame>::decode(const Wire& wire) {
  Door door;
  door.check(wire.width() > 0 && wire.height() > 0 && 3ULL * wire.width() * wire.height() <= wire.data().size(),
             "width x height is zero or more than 1280 x 720");
  if (!door.good()) return door.why();
  const auto bytes = 3UL * wire.width() * wire.height();
  return ColorFrame{wire.seq(),
                    time_from_ns(wire.stamp_ns()),
                    static_cast<int>(wire.width()),
                    static_cast<int>(wire.height()),
                    {wire.data().begin(), wire.data().begin() + static_cast<std::ptrdiff_t>(bytes)}};
}

void Topic<DepthFrame>::encode(const DepthFrame& value, Wire& wire) {
  wire.seq(value.seq);
  wire.stamp_ns(to_ns(value.exposed));
  wire.width(static_cast<std::uint32_t>(value.width));
  wire.height(static_cast<std::uint32_t>(value.height));
  std::copy_n(value.depth.begin(), std::min(value.depth.size(), wire.data().size()), wire.data().begin());
}

Result<DepthFrame, Invalid> Topic<DepthFrame>::decode(const Wire& wire) {
  Door door;
  door.check(wire.width() > 0 && wire.height() > 0 && 1ULL * wire.width() * wire.height() <= wire.data().size(),
             "width x height is zero or more than 1280 x 720");
  if (!door.good()) return door.why();
  const auto pixels = 1UL * wire.width() * wire.height();
  return DepthFrame{wire.seq(),
                    time_from_ns(wire.stamp_ns()),
                    static_cast<int>(wire.width()),
                    static_cast<int>(wire.height()),
                    {wire.data().begin(), wire.data().begin() + static_cast<std::ptrdiff_t>(pixels)}};
}

void Topic<CameraModel>::encode(const CameraModel& value, Wire& wire) {
  wire.width(static_cast<std::uint32_t>(value.width));
  wire.height(static_cast<std::uint32_t>(value.height));
  wire.fx(value.fx);
  wire.fy(value.fy);
  wire.cx(value.cx);
  wire.cy(value.cy);
  wire.distortion(value.distortion);
  Eigen::Map<WirePose>{wire.x_wc().data()} = value.X_WC.affine();
}

Result<CameraModel, Invalid> Topic<CameraModel>::decode(const Wire& wire) {
  Door door;
  door.within("width", wire.width(), 1, 1280);
  door.within("height", wire.height(), 1, 720);
  door.within("fx", wire.fx(), 1.0, 1e5);
  door.within("fy", wire.fy(), 1.0, 1e5);
  door.within("cx", wire.cx(), -1e4, 1e4);
  door.within("cy", wire.cy(), -1e4, 1e4);
  door.all_finite("distortion", wire.distortion());
  for (const double value : wire.x_wc()) door.within("x_wc", value, -kFarthest, kFarthest);
  if (!door.good()) return door.why();
  CameraModel value;
  value.width = static_cast<int>(wire.width());
  value.height = static_cast<int>(wire.height());
  value.fx = wire.fx();
  value.fy = wire.fy();
  value.cx = wire.cx();
  value.cy = wire.cy();
  value.distortion = wire.distortion();
  value.X_WC.affine() = Eigen::Map<const WirePose>{wire.x_wc().data()};
  constexpr double kOrthonormal = 1e-6;
  const Matrix3 R_WC = value.X_WC.linear();
  if (!(R_WC * R_WC.transpose()).isIdentity(kOrthonormal) || R_WC.determinant() < 0) return Invalid{"x_wc is not a rigid pose"};
  return value;
}

void Topic<Health>::encode(const Health& value, Wire& wire) {
  wire.process(std::string{fit(value.process, 31)});
  wire.text(std::string{fit(value.text, 255)});
  wire.session(value.session);
  wire.pid(value.pid);
  wire.stamp_ns(to_ns(value.stamp));
  wire.uptime_ns(value.uptime.count());
  wire.state(static_cast<std::uint8_t>(value.state));
  wire.loop_hz(value.loop_hz);
  wire.cycles(value.cycles);
  wire.overruns(value.overruns);
  wire.overruns_ours(value.overruns_ours);
  wire.overruns_hosts(value.overruns_hosts);
  put(value.wakeup, wire.wakeup());
  put(value.compute, wire.compute());
  wire.cpu_s(value.cpu_s);
  wire.rss_bytes(value.rss_bytes);
  wire.dropped(value.dropped);
}

Result<Health, Invalid> Topic<Health>::decode(const Wire& wire) {
  Door door;
  door.enumerated("state", wire.state(), static_cast<unsigned>(HealthState::kFault));
  for (const double value : {wire.loop_hz(), wire.cpu_s()}) door.finite("figure", value);
  check_tail(door, "wakeup", wire.wakeup());
  check_tail(door, "compute", wire.compute());
  if (!door.good()) return door.why();
  Health value;
  value.process = wire.process().to_string();
  value.state = static_cast<HealthState>(wire.state());
  value.text = wire.text().to_string();
  value.session = wire.session();
  value.pid = wire.pid();
  value.stamp = time_from_ns(wire.stamp_ns());
  value.uptime = Duration{wire.uptime_ns()};
  value.loop_hz = wire.loop_hz();
  value.cycles = wire.cycles();
  value.overruns = wire.overruns();
  value.overruns_ours = wire.overruns_ours();
  value.overruns_hosts = wire.overruns_hosts();
  value.wakeup = get(wire.wakeup());
  value.compute = get(wire.compute());
  value.cpu_s = wire.cpu_s();
  value.rss_bytes = wire.rss_bytes();
  value.dropped = wire.dropped();
  return value;
}

}  // namespace breakshot::dds
