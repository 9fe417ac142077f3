// `./breakshot bench strokes`: how exact planned strokes are, and how far from the least time that any plan could take.

#include "common/config/cell_config.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/motion/motion_config.hpp"
#include "tests/bench/path_bound.hpp"
#include "tests/bench/report.hpp"
#include "tests/bench/statistics.hpp"
#include "tests/support/stroke_audit.hpp"

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <ruckig/ruckig.hpp>

#include <ctime>
#include <iostream>
#include <map>
#include <numbers>

namespace breakshot::bench {
namespace {

using motion::StrokePlanner;
using motion::StrokeTimes;
using motion::Trajectory;
using motion::TrajectoryPoint;
using support::StrokeAudit;

constexpr double kDegree = std::numbers::pi / 180.0;
/// Samples of a push's path for its bound.
constexpr int kPathSamples = 400;

struct Arguments {
  std::string config = "config/cell.yaml";
  std::vector<std::string> overrides;
  int n = 200;
  std::uint64_t seed = 1;
  std::vector<double> speeds{0.3, 0.6, 1.0, 1.5};
  std::string json_file;
  std::string paths_file;
};

double cpu_time() noexcept {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Shortest time from one state to another when every joint moves alone: nothing that keeps the joints' limits is quicker, s.
double joint_bound(const TrajectoryPoint& from, const TrajectoryPoint& to, int joints, const JointVector& max_speed,
                   const motion::MotionSettings& settings) {
  double bound = 0.0;
  ruckig::Ruckig<1> solver;
  ruckig::Trajectory<1> trajectory;
  for (int i = 0; i < joints; ++i) {
    const auto j = static_cast<std::size_t>(i);
    ruckig::InputParameter<1> input;
    input.current_position = {from.q[j]};
    input.current_velocity = {from.qd[j]};
    input.current_acceleration = {from.qdd[j]};
    input.target_position = {to.q[j]};
    input.target_velocity = {to.qd[j]};
    input.target_acceleration = {to.qdd[j]};
    // A little more than the limits, because states at them are off by rounding.
    input.max_velocity = {1.001 * max_speed[i]};
    input.max_acceleration = {1.001 * settings.max_acceleration};
    input.max_jerk = {settings.max_jerk};
    if (solver.calculate(input, trajectory) >= 0) bound = std::max(bound, trajectory.get_duration());
  }
  return bound;
}

/// The joints' path under a push's line, from its trajectory.
JointPath path_of_push(const StrokePlanner& planner, const StrokeRequest& request, const Trajectory& trajectory) {
  const motion::TipTracker tracker{planner.kinematics()};
  const Vector3 direction{request.direction_W.x(), request.direction_W.y(), 0.0};
  JointPath path;
  path.step = request.length / kPathSamples;
  JointVector q = Eigen::Map<const Eigen::VectorXd>{trajectory.points[trajectory.contact_tick].q.data(), trajectory.joints};
  JointVector dq = JointVector::Zero(q.size());
  for (int k = 0; k <= kPathSamples; ++k) {
    const Vector2 p = request.p_WS + k * path.step * request.direction_W;
    q += path.step * dq;
    if (!tracker.follow({p.x(), p.y(), planner.settings().tip_height}, direction, {0.0, 0.0, -1.0}, q, dq)) return {};
    path.q.push_back(q);
    path.dq.push_back(dq);
  }
  for (std::size_t k = 0; k < path.dq.size(); ++k) {
    const std::size_t a = k == 0 ? 0 : k - 1;
    const std::size_t b = std::min(k + 1, path.dq.size() - 1);
    path.ddq.emplace_back((path.dq[b] - path.dq[a]) / (static_cast<double>(b - a) * path.step));
  }
  return path;
}

/// What a row of the table is made of.
struct Tally {
  int asked = 0;
  int possible = 0;  ///< asked for no more than the joints' speeds and accelerations allow at the place
  int accepted = 0;
  std::map<std::string, int> refusals;
  std::vector<double> position, direction, speed, deviation;  ///< mm, deg, %, mm
  std::vector<double> total, to_contact, low_after, plan_ms;  ///< s, s, mm, ms
  nlohmann::json push_paths = nlohmann::json::array();        ///< for tests/bench/toppra_check.py
  std::vector<double> over_bound, push_over_bound;            ///< of the ways to and from the contact (the line); of a push's line
  int limit_violations = 0, second_contacts = 0;
};

bool violates(const StrokeAudit& found, const motion::MotionSettings& settings) {
  return found.range > 1e-6 || found.speed > 1.001 || found.acceleration > 1.001 || found.jerk > 1.01 || !found.at_rest_at_ends ||
         found.lowest_tip < settings.tip_height - 1e-4 || found.lowest_link < settings.link_clearance - 1e-4 ||
         found.low_outside_dip > 0.2 * settings.clearance;
}

class Bench {
 public:
  explicit Bench(const Arguments& arguments)
      : document_{load_cell_document(arguments.config, arguments.overrides)},
        cell_{load_cell_config(document_)},
        planner_{load_cell_arm(cell_), cell_.arm.X_WB,
                 motion::load_motion_settings(document_.root().child("controller").child("motion"), cell_)},
        q_{cell_.arm.park} {}

  void run(StrokeRequest request, SplitMix64& random, Tally& tally) {
    request.park_after = random.uniform() < 0.5;
    ++tally.asked;
    if (request.speed <= planner_.speed_bound(request.p_WS, request.direction_W)) ++tally.possible;
    const double start = cpu_time();
    const auto times = planner_.plan(request, q_, *trajectory_);
    tally.plan_ms.push_back(1e3 * (cpu_time() - start));
    if (!times) {
      ++tally.refusals[to_string(times.error().reason)];
      return;
    }
    ++tally.accepted;
    score(request, *times, tally);
    const TrajectoryPoint& last = trajectory_->points[trajectory_->size - 1];
    q_ = Eigen::Map<const Eigen::VectorXd>{last.q.data(), trajectory_->joints};
  }

  const CellConfig& cell() const noexcept { return cell_; }

 private:
  void score(const StrokeRequest& request, const StrokeTimes& times, Tally& tally) const {
    const StrokeAudit found = support::audit(planner_, request, times, *trajectory_);
    tally.position.push_back(1e3 * found.position_error);
    tally.direction.push_back(found.direction_error / kDegree);
    tally.speed.push_back(100.0 * found.speed_error);
    tally.deviation.push_back(1e3 * found.line_deviation);
    tally.total.push_back(to_seconds(times.total));
    tally.to_contact.push_back(to_seconds(times.contact));
    tally.low_after.push_back(1e3 * times.low_after);
    if (violates(found, planner_.settings())) ++tally.limit_violations;
    if (request.kind == StrokeKind::kHit && !(found.struck_disc_gap > 0.0)) ++tally.second_contacts;

    const bool push = request.kind == StrokeKind::kPush;
    const Trajectory& t = *trajectory_;
    std::size_t line_end = t.contact_tick;
    while (push && t.points[line_end].phase == StrokePhase::kRunIn) ++line_end;
    const auto bound = [&](std::size_t from, std::size_t to) {
      return joint_bound(t.points[from], t.points[to], t.joints, planner_.kinematics().max_speed(), planner_.settings());
    };
    const double moved = to_seconds(t.tick) * static_cast<double>(t.contact_tick + t.size - 1 - line_end);
    tally.over_bound.push_back(moved / (bound(0, t.contact_tick) + bound(line_end, t.size - 1)));
    if (!push) return;
    const JointPath path = path_of_push(planner_, request, t);
    const double least =
        path.dq.empty() ? 0.0
                        : least_path_time(path, planner_.kinematics().max_speed(), planner_.settings().max_acceleration, request.speed);
    if (!(least > 0.0)) return;
    const double planned = to_seconds(t.tick) * static_cast<double>(line_end - t.contact_tick);
    tally.push_over_bound.push_back(planned / least);
    nlohmann::json q = nlohmann::json::array();
    for (const JointVector& sample : path.q) q.push_back(std::vector<double>(sample.begin(), sample.end()));
    const JointVector& max_speed = planner_.kinematics().max_speed();
    tally.push_paths.push_back({{"step", path.step},
                                {"speed", request.speed},
                                {"max_speed", std::vector<double>(max_speed.begin(), max_speed.end())},
                                {"max_acceleration", planner_.settings().max_acceleration},
                                {"q", q},
                                {"planned_s", planned},
                                {"bound_s", least}});
  }

  ConfigDocument document_;
  CellConfig cell_;
  StrokePlanner planner_;
  JointVector q_;  ///< where the next stroke begins: where the last one ended
  std::unique_ptr<Trajectory> trajectory_ = std::make_unique<Trajectory>();
};

void print_row(const std::string& name, const Tally& t) {
  fmt::print("{:<14}{:>9.1f} %{:>9.1f} %{:>9.2f}{:>9.2f}{:>8.2f}{:>9.1f}{:>9.2f}{:>9.2f}\n", name, 100.0 * t.accepted / t.asked,
             100.0 * t.accepted / std::max(1, t.possible), mean(t.total), mean(t.to_contact), mean(t.over_bound), mean(t.low_after),
             mean(t.plan_ms), quantile(t.plan_ms, 0.99));
  for (const auto& [reason, count] : t.refusals) fmt::print("{:<14}  refused, {}: {}\n", "", reason, count);
}

void append(std::vector<double>& to, const std::vector<double>& from) { to.insert(to.end(), from.begin(), from.end()); }
double largest(const std::vector<double>& values) { return quantile(values, 1.0); }

int run(const Arguments& arguments) {
  Bench bench{arguments};
  nlohmann::json metrics;
  fmt::print("{:<14}{:>11}{:>11}{:>9}{:>9}{:>8}{:>9}{:>9}{:>9}\n", "stroke", "accepted", "possible", "total s", "contact", "/bound",
             "past mm", "plan ms", "p99 ms");
  Tally hits;
  int violations = 0;
  std::vector<double> over_bound;
  const auto put = [&](const std::string& name, const Tally& t) {
    print_row(name, t);
    metrics[name + ".accepted_pct"] = 100.0 * t.accepted / t.asked;
    metrics[name + ".accepted_of_possible_pct"] = 100.0 * t.accepted / std::max(1, t.possible);
    metrics[name + ".total_s_mean"] = mean(t.total);
    metrics[name + ".contact_s_mean"] = mean(t.to_contact);
    metrics[name + ".over_bound_mean"] = mean(t.over_bound);
    metrics[name + ".plan_ms_mean"] = mean(t.plan_ms);
    violations += t.limit_violations;
    append(over_bound, t.over_bound);
  };
  for (const double speed : arguments.speeds) {
    Tally tally;
    SplitMix64 random{arguments.seed};
    for (int i = 0; i < arguments.n; ++i) bench.run(support::random_hit(random, bench.cell().workspace, speed), random, tally);
    put(fmt::format("hit_{:.1f}", speed), tally);
    append(hits.position, tally.position);
    append(hits.direction, tally.direction);
    append(hits.speed, tally.speed);
    append(hits.deviation, tally.deviation);
    hits.second_contacts += tally.second_contacts;
  }
  Tally pushes;
  SplitMix64 random{arguments.seed};
  for (int i = 0; i < arguments.n; ++i) bench.run(support::random_push(random, bench.cell().workspace), random, pushes);
  put("push", pushes);

  metrics["hit_position_err_mm_p99"] = quantile(hits.position, 0.99);
  metrics["hit_direction_err_deg_p99"] = quantile(hits.direction, 0.99);
  metrics["hit_speed_err_pct_p99"] = quantile(hits.speed, 0.99);
  metrics["run_in_deviation_mm_max"] = largest(hits.deviation);
  metrics["push_deviation_mm_max"] = largest(pushes.deviation);
  metrics["push_speed_err_pct_max"] = largest(pushes.speed);
  metrics["push_over_toppra_median"] = quantile(pushes.push_over_bound, 0.5);
  metrics["push_over_toppra_p90"] = quantile(pushes.push_over_bound, 0.9);
  metrics["transit_over_bound_mean"] = mean(over_bound);
  metrics["limit_violations"] = violations;
  metrics["second_contacts"] = hits.second_contacts;

  nlohmann::json goals;
  fmt::print("\n");
  const auto goal = [&](const char* name, double bound) {
    const double value = metrics[name].get<double>();
    goals[name] = {{"value", value}, {"goal", bound}, {"met", value <= bound}};
    fmt::print("{:<28}{:>10.4g}   goal at most {:<8.4g}{}\n", name, value, bound, value <= bound ? "" : "   missed");
  };
  goal("hit_position_err_mm_p99", 0.3);
  goal("hit_direction_err_deg_p99", 0.3);
  goal("hit_speed_err_pct_p99", 1.0);
  goal("push_deviation_mm_max", 0.2);
  goal("push_over_toppra_median", 1.10);
  goal("transit_over_bound_mean", 1.25);
  goal("limit_violations", 0.0);
  goal("second_contacts", 0.0);
  fmt::print("({} strokes of each kind, each from where the last one ended; planned set-points, on and between the ticks\n", arguments.n);
  fmt::print(" possible: accepted of those that the joints' speeds and accelerations at the contact allow; past: low after the contact\n");
  fmt::print(" /bound: the ways to and from the contact over their joint-space bound; ms: CPU time of a plan or a refusal)\n");
  const nlohmann::json args{{"n", arguments.n}, {"seed", arguments.seed}, {"speeds", arguments.speeds}};
  if (!arguments.json_file.empty()) write_file(arguments.json_file, report("strokes", args, metrics, goals).dump(2) + "\n");
  if (!arguments.paths_file.empty()) write_file(arguments.paths_file, pushes.push_paths.dump() + "\n");
  return 0;
}

}  // namespace
}  // namespace breakshot::bench

int main(int argc, char** argv) {
  breakshot::bench::Arguments arguments;
  CLI::App app{"Plans random hits and pushes of the cell's arm and measures them: accuracy, limits, time beside lower bounds.",
               "bench strokes"};
  app.add_option("--config", arguments.config, "The cell's configuration file")->capture_default_str();
  app.add_option("--set", arguments.overrides, "Overrides one value of it (repeatable)")->allow_extra_args(false);
  app.add_option("--n", arguments.n, "Strokes of each kind")->check(CLI::Range(1, 1'000'000))->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same strokes")->capture_default_str();
  app.add_option("--speed", arguments.speeds, "Speeds of the hits, m/s, separated by commas")->delimiter(',')->capture_default_str();
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  app.add_option("--paths", arguments.paths_file, "Write the pushes' paths to this file, for tests/bench/toppra_check.py");
  CLI11_PARSE(app, argc, argv);
  try {
    return breakshot::bench::run(arguments);
  } catch (const std::exception& error) {
    std::cerr << "bench strokes: " << error.what() << '\n';
    return 1;
  }
}
