#include "client/demo/report.hpp"

#include "common/gap.hpp"

#include <fmt/core.h>
#include <sys/utsname.h>

#include <cmath>
#include <numbers>
#include <thread>

namespace breakshot::client {

namespace {

using nlohmann::json;

std::string mm(double metres) { return std::isfinite(metres) ? fmt::format("{:.1f} mm", metres * 1e3) : std::string{"-"}; }

/// JSON has no infinity and no NaN: null says "none".
json finite(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json to_json(const Vector2& p) { return json::array({p.x(), p.y()}); }

json to_json(const PhaseTimes& t) {
  return {{"look_s", to_seconds(t.look)},
          {"decide_s", to_seconds(t.decide)},
          {"move_s", to_seconds(t.move)},
          {"settle_s", to_seconds(t.settle)}};
}

json to_json(const StrokeRequest& s) {
  return {{"id", s.id},       {"kind", to_string(s.kind)}, {"p_WS", to_json(s.p_WS)}, {"direction_W", to_json(s.direction_W)},
          {"speed", s.speed}, {"run_in", s.run_in},        {"length", s.length}};
}

json to_json(const Scene& scene) {
  json out{{"seq", scene.seq}, {"discs", json::array()}, {"contacts", json::array()}};
  for (const auto& d : scene.discs)
    out["discs"].push_back({{"id", d.id}, {"p_WD", to_json(d.p_WD)}, {"radius", d.radius}, {"colour", d.colour}});
  for (const auto& c : scene.contacts) out["contacts"].push_back({{"a", c.a}, {"b", c.b}, {"gap", c.gap}, {"p_touch", c.p_touch}});
  return out;
}

json to_json(const DecisionRecord& record) {
  const Plan& plan = record.plan;
  json out{{"stroke", to_json(plan.stroke)},
           {"strategy", plan.strategy},
           {"why", plan.why},
           {"predicted_gap", finite(plan.predicted_gap)},
           {"think_s", to_seconds(plan.think)},
           {"scene", to_json(record.scene)}};
  for (const auto& p : plan.predicted_p_WD) out["predicted_p_WD"].push_back(to_json(p));
  if (record.outcome) {
    const Outcome& o = *record.outcome;
    out["outcome"] = {{"phase", to_string(o.stroke_phase)},     {"reason", to_string(o.reason)},
                      {"achieved_gap", finite(o.achieved_gap)}, {"contacts_left", o.contacts_left},
                      {"discs_singulated", o.discs_singulated}, {"discs_lost", o.discs_lost},
                      {"contact_speed", o.contact_speed},       {"times", to_json(o.times)}};
  }
  return out;
}

int truly_lost(const SimTruth& truth, const Rect& workspace) {
  int lost = 0;
  for (const auto& disc : truth.discs) lost += !disc.on_table || !workspace.contains(disc.p_WD) ? 1 : 0;
  return lost;
}

json machine() {
  utsname name{};
  uname(&name);
  return {{"kernel", name.release}, {"cores", std::thread::hardware_concurrency()}};
}

/// Whether the controller stopped on a machine that did not let it run in time.
bool was_held_up(const RunRecord& run) {
  if (!run.task || run.task->failure != TaskFailure::kControllerFault) return false;
  const auto controller = run.healths.find("controller");
  return controller != run.healths.end() && controller->second.overruns_hosts > 0;
}

}  // namespace

bool succeeded(const RunRecord& run) {
  const bool ended = run.job && run.job->phase == mes::JobPhase::kEnded;
  return ended && !(run.truth && truly_lost(*run.truth, run.workspace) > 0);
}

std::string decision_line(std::size_t index, const Plan& plan) {
  const StrokeRequest& s = plan.stroke;
  const double bearing = std::atan2(s.direction_W.y(), s.direction_W.x()) * 180.0 / std::numbers::pi;
  return fmt::format("#{:<2} {:<4} {:.2f} m/s at ({:+.3f}, {:+.3f}) m towards {:+4.0f} deg   predicted gap {:>7}   {}", index + 1,
                     to_string(s.kind), s.speed, s.p_WS.x(), s.p_WS.y(), bearing, mm(plan.predicted_gap), plan.why);
}

std::string outcome_line(const Plan& plan, const Outcome& outcome) {
  // Why a stroke was stopped is told by the order's text; only refusals have a reason of their own.
  if (outcome.stroke_phase == StrokePhase::kRefused) return fmt::format("    refused: {}", to_string(outcome.reason));
  if (outcome.stroke_phase != StrokePhase::kDone) return fmt::format("    {} on the way", to_string(outcome.stroke_phase));
  const std::string contact =
      plan.stroke.kind == StrokeKind::kHit ? fmt::format("struck at {:.2f} m/s, ", outcome.contact_speed) : std::string{};
  return fmt::format(
      "    {}smallest gap {}, {} discs singulated, {} contacts left{}   (look {:.2f}, decide {:.2f}, move {:.2f}, settle {:.2f} s)",
      contact, mm(outcome.achieved_gap), outcome.discs_singulated, outcome.contacts_left,
      outcome.discs_lost > 0 ? fmt::format(", {} LOST", outcome.discs_lost) : std::string{}, to_seconds(outcome.times.look),
      to_seconds(outcome.times.decide), to_seconds(outcome.times.move), to_seconds(outcome.times.settle));
}

std::string summary(const RunRecord& run) {
  std::string out;
  const auto row = [&out](std::string_view name, const std::string& value) { out += fmt::format("  {:<22}{}\n", name, value); };
  const bool good = succeeded(run);
  out += good ? "\nSINGULATED\n" : "\nNOT SINGULATED\n";
  if (run.job) row("order", fmt::format("{}{}", mes::to_string(run.job->phase), run.job->text.empty() ? "" : ": " + run.job->text));
  if (run.task) {
    const TaskStatus& t = *run.task;
    row("strokes", fmt::format("{} ({} hits, {} pushes)", t.hits + t.pushes, t.hits, t.pushes));
    row("discs", fmt::format("{} seen, {} singulated, {} lost", t.discs_seen, t.discs_singulated, t.discs_lost));
    row("smallest gap", fmt::format("{} seen (asked: {})", mm(t.smallest_gap), mm(run.target_gap)));
    row("time by phase", fmt::format("look {:.2f}  decide {:.2f}  move {:.2f}  settle {:.2f} s (cell clock)", to_seconds(t.times.look),
                                     to_seconds(t.times.decide), to_seconds(t.times.move), to_seconds(t.times.settle)));
  }
  if (run.truth) {
    row("scored by truth", fmt::format("smallest gap {}, {} of {} discs outside the workspace", mm(smallest_gap_between(run.truth->discs)),
                                       truly_lost(*run.truth, run.workspace), run.truth->discs.size()));
  }
  row("order to end", fmt::format("{:.2f} s wall time", to_seconds(run.wall)));
  row("scenes", fmt::format("{:.1f} per second", run.scene_rate));
  for (const auto& [name, h] : run.healths) {
    const double up = to_seconds(h.uptime);
    std::string loop;
    if (h.loop_hz > 0.0) {
      const std::string of_host = h.overruns_hosts > 0 ? fmt::format(" ({} by the host)", h.overruns_hosts) : std::string{};
      loop = fmt::format("   loop {:.1f} Hz, {} overruns{}, wake-up p99 {:.0f} us", h.loop_hz, h.overruns, of_host, h.wakeup.p99_us);
    }
    row(name, fmt::format("cpu {:5.1f} %  memory {:6.1f} MiB{}", up > 0.0 ? 100.0 * h.cpu_s / up : 0.0,
                          static_cast<double>(h.rss_bytes) / 1048576.0, loop));
  }
  if (was_held_up(run)) {
    row("what to do", "this machine took the processors away from the cell (overruns by the host): run it again, with less beside it");
  }
  return out;
}

json to_json(const RunRecord& run) {
  json out{{"formation", run.formation},   {"strategy", run.strategy},     {"success", succeeded(run)}, {"wall_s", to_seconds(run.wall)},
           {"target_gap", run.target_gap}, {"scene_rate", run.scene_rate}, {"machine", machine()},      {"decisions", json::array()}};
  for (const auto& record : run.decisions) out["decisions"].push_back(to_json(record));
  if (run.job)
    out["order"] = {{"phase", mes::to_string(run.job->phase)}, {"result", mes::to_string(run.job->result)}, {"text", run.job->text}};
  if (run.task) {
    const TaskStatus& t = *run.task;
    out["task"] = {{"phase", to_string(t.phase)},
                   {"failure", to_string(t.failure)},
                   {"hits", t.hits},
                   {"pushes", t.pushes},
                   {"discs_seen", t.discs_seen},
                   {"discs_singulated", t.discs_singulated},
                   {"discs_lost", t.discs_lost},
                   {"smallest_gap", finite(t.smallest_gap)},
                   {"times", to_json(t.times)}};
  }
  if (run.truth) {
    out["truth"] = {{"smallest_gap", finite(smallest_gap_between(run.truth->discs))},
                    {"discs_lost", truly_lost(*run.truth, run.workspace)},
                    {"strikes", run.truth->strikes}};
    for (const auto& d : run.truth->discs) out["truth"]["p_WD"].push_back(to_json(d.p_WD));
  }
  for (const auto& [name, h] : run.healths) {
    out["processes"][name] = {{"cpu_s", h.cpu_s},
                              {"uptime_s", to_seconds(h.uptime)},
                              {"rss_bytes", h.rss_bytes},
                              {"loop_hz", h.loop_hz},
                              {"overruns", h.overruns},
                              {"cycles", h.cycles},
                              {"wakeup_p99_us", h.wakeup.p99_us},
                              {"wakeup_max_us", h.wakeup.max_us},
                              {"compute_p99_us", h.compute.p99_us},
                              {"compute_max_us", h.compute.max_us},
                              {"dropped", h.dropped}};
  }
  return out;
}

}  // namespace breakshot::client
