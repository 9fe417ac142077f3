#include "tests/hil/cell_under_test.hpp"

#include "sim_bridge/faults.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <stdexcept>

namespace breakshot::hil {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

namespace {

// A loaded machine starts five processes slowly; nothing here asserts how fast.
constexpr Duration kReadyTimeout = seconds{60};
constexpr Duration kAckPatience = seconds{20};

const std::vector<std::pair<std::string, std::vector<std::string>>> kProcesses{
    {"sim_bridge", {}}, {"controller", {"sim_bridge"}}, {"perception", {}}, {"planner", {}}, {"mes_gateway", {}}};

}  // namespace

CellUnderTest::CellUnderTest(CellOptions options)
    // Three domains for each of up to 33 test processes at a time; 0 to 129 are left to people.
    : cell_domain_{130 + 3 * static_cast<int>(getpid() % 33)},
      mes_domain_{cell_domain_ + 1},
      flights_{std::string{BREAKSHOT_BINARY_DIR} + "/tests/hil." + std::to_string(getpid()) + ".flights"} {
  arguments_ = {"--config", std::string{BREAKSHOT_SOURCE_DIR} + "/config/cell.yaml"};
  options.overrides.push_back(options.lockstep ? "cell.mode=lockstep" : "cell.mode=real_time");
  // Rendering is three quarters of what a cell in lockstep costs; half the frames show the planner as much.
  if (options.lockstep) options.overrides.emplace_back("sim_bridge.camera.frame_rate=15");
  options.overrides.push_back("cell.dds.cell_domain=" + std::to_string(cell_domain_));
  options.overrides.push_back("cell.dds.mes_domain=" + std::to_string(mes_domain_));
  options.overrides.push_back("cell.dds.ros2_domain=" + std::to_string(cell_domain_ + 2));
  options.overrides.push_back("controller.flight.folder=" + flights_);
  for (const auto& override : options.overrides) {
    arguments_.emplace_back("--set");
    arguments_.push_back(override);
  }

  config_ = load_cell_config(load_cell_document(arguments_[1], options.overrides));

  std::vector<launcher::ProcessSpec> specs;
  for (const auto& [name, after] : kProcesses) {
    if (std::count(options.without.begin(), options.without.end(), name) > 0) continue;
    launcher::ProcessSpec spec;
    spec.name = name;
    spec.program = std::string{BREAKSHOT_BINARY_DIR} + "/bin/breakshot-" + name;
    spec.arguments = arguments_;
    for (const auto& other : after) {
      if (std::count(options.without.begin(), options.without.end(), other) == 0) spec.after.push_back(other);
    }
    spec.ready_timeout = kReadyTimeout;
    specs.push_back(std::move(spec));
  }
  group_ = std::make_unique<launcher::ProcessGroup>(std::move(specs));
  const auto started = group_->start();
  if (!started) throw std::runtime_error(started.error().text());

  participant_ = std::make_unique<dds::Participant>(cell_domain_, "breakshot-hil");
  control_ = std::make_unique<dds::Writer<SimControl>>(*participant_);
  strokes_ = std::make_unique<dds::Writer<StrokeRequest>>(*participant_);
  stroke_statuses_ = std::make_unique<dds::Reader<StrokeStatus>>(*participant_);
  truths_ = std::make_unique<dds::Reader<SimTruth>>(*participant_);
  mes_ = std::make_unique<client::OrderClient>(mes_domain_, 1);
}

CellUnderTest::~CellUnderTest() {
  if (::testing::Test::HasFailure() && group_) std::cerr << logs();
  group_.reset();
  if (!::testing::Test::HasFailure()) std::filesystem::remove_all(flights_);
}

bool CellUnderTest::control(SimControl request) {
  request.seq = ++control_seq_;
  const auto give_up = steady_clock::now() + seconds{30};
  while (steady_clock::now() < give_up) {
    control_->write(request);
    const auto resend = steady_clock::now() + milliseconds{500};
    SimTruth truth;
    while (truths_->take(truth, resend - steady_clock::now())) {
      if (truth.control_seq == request.seq) return true;
    }
  }
  return false;
}

bool CellUnderTest::set_table(const std::string& formation) {
  SimControl request;
  request.verb = SimControl::Verb::kReset;
  request.formation = formation;
  if (!control(request)) return false;
  // Nobody's hand moves a table in no time: frames of the old one are still on their way. The camera's latency and a few frames later they are gone.
  constexpr Duration kSeen = milliseconds{300};
  const auto placed = truth();
  auto now = placed;
  while (now && now->stamp - placed->stamp < kSeen) now = truth();
  return now.has_value();
}

bool CellUnderTest::set_fault(std::uint8_t fault, double value) {
  SimControl request;
  request.verb = SimControl::Verb::kSetFault;
  request.fault = fault;
  request.fault_value = value;
  return control(request);
}

bool CellUnderTest::set_block(const Vector2& p_W, double radius, double height) {
  SimControl request;
  request.verb = SimControl::Verb::kSetFault;
  request.fault = static_cast<std::uint8_t>(sim_bridge::Fault::kBlock);
  request.discs = {SimDisc{.p_WD = p_W, .radius = radius, .height = height}};
  return control(request);
}

bool CellUnderTest::clear_faults() {
  SimControl request;
  request.verb = SimControl::Verb::kClearFaults;
  return control(request);
}

std::optional<SimTruth> CellUnderTest::truth() {
  SimTruth truth;
  if (!truths_->take(truth, seconds{10})) return std::nullopt;
  return truth;
}

std::optional<SimTruth> CellUnderTest::truth_at_rest(Duration patience) {
  constexpr double kStill = 0.002;  // m/s; drives that hold a position still tremble a little
  constexpr Duration kLongEnough = milliseconds{300};
  const auto give_up = steady_clock::now() + patience;
  auto now = truth();
  Time moved = now ? now->stamp : Time{};
  while (now && steady_clock::now() < give_up) {
    if (now->v_WT_W.norm() > kStill) moved = now->stamp;
    if (now->stamp - moved >= kLongEnough) return now;
    now = truth();
  }
  return std::nullopt;
}

std::optional<mes::Ack> CellUnderTest::place_order(const mes::Id& order, const mes::JobSpec& spec) {
  const auto give_up = steady_clock::now() + kReadyTimeout;
  std::optional<mes::Ack> ack;
  do {
    mes::Command command = mes_->command(mes::Verb::kStoreAndStart, order);
    command.spec = spec;
    ack = mes_->send(command, kAckPatience);
    if (!ack || ack->reason != mes::Reason::kNotReady) return ack;
    mes_->next_status(milliseconds{200});
  } while (steady_clock::now() < give_up);
  return ack;
}

std::optional<mes::Ack> CellUnderTest::recover() { return mes_->send(mes_->command(mes::Verb::kClear, {}), kAckPatience); }

std::optional<mes::JobState> CellUnderTest::follow(const mes::Id& order, const std::function<bool(const mes::JobState&)>& done,
                                                   Duration patience) {
  const auto give_up = steady_clock::now() + patience;
  while (steady_clock::now() < give_up) {
    const auto job = mes_->next_job(order, give_up - steady_clock::now());
    if (job && done(*job)) return job;
  }
  return std::nullopt;
}

std::optional<mes::JobState> CellUnderTest::run_order(const mes::JobSpec& spec, Duration patience) {
  const mes::Id order = mes::random_id();
  const auto ack = place_order(order, spec);
  if (!ack || ack->verdict == mes::Verdict::kRejected) return std::nullopt;
  return follow(
      order, [](const mes::JobState& job) { return job.phase == mes::JobPhase::kEnded || job.phase == mes::JobPhase::kAborted; }, patience);
}

std::optional<StrokeStatus> CellUnderTest::stroke(StrokeRequest request) {
  const auto give_up = steady_clock::now() + kReadyTimeout;
  while (steady_clock::now() < give_up) {
    strokes_->write(request);  // the same id again is not a second stroke
    const auto resend = steady_clock::now() + seconds{1};
    StrokeStatus status;
    while (stroke_statuses_->take(status, resend - steady_clock::now())) {
      if (status.id == request.id && is_final(status.phase)) return status;
    }
  }
  return std::nullopt;
}

std::string CellUnderTest::logs() const {
  constexpr std::size_t kLines = 40;
  std::string all;
  for (const auto& info : group_->infos()) {
    const auto lines = group_->log(info.name);
    const std::size_t first = lines.size() > kLines ? lines.size() - kLines : 0;
    for (std::size_t i = first; i < lines.size(); ++i) all += info.name + " | " + lines[i] + '\n';
  }
  return all;
}

}  // namespace breakshot::hil
