#include "common/config/formation.hpp"
#include "controller/loop/control_loop.hpp"
#include "controller/loop/stroke_executor.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "controller/safety/following_error.hpp"
#include "sim_bridge/world/sim_world.hpp"
#include "tests/support/in_process_cell.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <random>

// The arm runs into what nobody told it of, and into discs as it is meant to: the simulated world under the loop and the executor of the controller, as
// the cell's configuration has them.

namespace breakshot::control::test {
namespace {

const support::InProcessSettings& settings() {
  static const auto kSettings = support::load_in_process_settings(std::string{BREAKSHOT_SOURCE_DIR} + "/config/cell.yaml");
  return kSettings;
}

class Cell {
 public:
  Cell() : config_{lockstep(settings().loop)}, world_{settings().arm, start_settings()}, loop_{config_, *channels_} { run(50); }

  void tick() {
    const JointState state = world_.joint_state();
    const JointCommand before = command_;
    command_ = loop_.tick(&state, world_.now());
    if (command_.q.size() > 0) {
      if (before.q.size() > 0) jump_ = std::max(jump_, (command_.q - before.q - 1e-3 * before.qd).cwiseAbs().maxCoeff());
      note_error(state);
      world_.command(command_);
    }
    executor_.poll(world_.now());
    StrokeStatus status;
    while (executor_.next(status)) statuses_.push_back(status);
    world_.tick();
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) tick();
  }

  void submit(StrokeRequest& request) {
    request.id = ++id_;
    executor_.submit(request, world_.now());
  }
  /// Its last status; kAccepted when it has not ended.
  StrokeStatus status_of(std::uint64_t id) const {
    const auto found = std::find_if(statuses_.rbegin(), statuses_.rend(), [&](const StrokeStatus& status) { return status.id == id; });
    return found == statuses_.rend() ? StrokeStatus{} : *found;
  }
  StrokeStatus ask(StrokeRequest request) {
    submit(request);
    for (int i = 0; i < 30'000 && !is_final(status_of(request.id).phase); ++i) tick();
    return status_of(request.id);
  }
  StrokeStatus ask(StrokeKind kind) {
    StrokeRequest request;
    request.kind = kind;
    return ask(request);
  }

  void place(const std::string& formation) {
    std::vector<SimDisc> discs;
    for (const auto& disc : load_formation(formation, settings().cell).discs) {
      const double scale = disc.radius / settings().disc_mass_radius;
      discs.push_back({.p_WD = disc.p_WD, .radius = disc.radius, .mass = settings().disc_mass * scale * scale});
    }
    world_.place(discs);
  }

  LoopConfig config_;
  sim_bridge::SimWorld world_;
  std::unique_ptr<LoopChannels> channels_ = std::make_unique<LoopChannels>();
  ControlLoop loop_;
  motion::StrokePlanner planner_{settings().arm, settings().cell.arm.X_WB, settings().motion};
  StrokeExecutor executor_{planner_, *channels_};
  JointCommand command_;
  double jump_ = 0.0;         ///< largest step of the set-point that its speed does not explain, rad
  double error_share_ = 0.0;  ///< largest following error, as a share of what is allowed

 private:
  static sim_bridge::SimSettings start_settings() {
    sim_bridge::SimSettings sim = settings().sim;
    sim.start = time_from_ns(1'000'000'000);
    return sim;
  }
  void note_error(const JointState& state) {
    const auto error = monitor_.check(state, config_.drive_lag);
    if (error.joint >= 0) error_share_ = std::max(error_share_, 1e-3 * std::abs(error.error) / error.limit);
    safety::Setpoint sent;
    std::copy_n(command_.q.data(), command_.q.size(), sent.q.begin());
    std::copy_n(command_.qd.data(), command_.qd.size(), sent.qd.begin());
    monitor_.sent(command_.due, sent);
  }

  /// Tells of errors from a thousandth of what the loop allows.
  safety::FollowingMonitor monitor_{6, {1e-3 * settings().loop.following.floor, 1e-3 * settings().loop.following.per_speed}};
  std::vector<StrokeStatus> statuses_;
  std::uint64_t id_ = 0;
};

struct Stroke {
  StrokeKind kind;
  double speed;         // m/s
  double most_ms;       // from the first touch to the stop
  double most_force_N;  // ever
};

class Collision : public ::testing::TestWithParam<Stroke> {};

TEST_P(Collision, WithABlockIsAProtectiveStopAndNothingGoesOnByItself) {
  const Stroke& stroke = GetParam();
  constexpr double kBlockRadius = 0.03;
  Cell cell;
  StrokeRequest request;
  request.kind = stroke.kind;
  request.direction_W = {0.0, 1.0};
  request.p_WS = stroke.kind == StrokeKind::kHit ? Vector2{0.0, 0.05} : Vector2{0.0, -0.15};
  request.speed = stroke.speed;
  request.run_in = 0.1;
  request.length = 0.3;
  const Vector2 touch{0.0, 0.045};  // where the rod's axis is when it meets the block, in full run
  cell.world_.block(sim_bridge::Block{touch + Vector2{0.0, kBlockRadius + settings().cell.striker_radius}, kBlockRadius, 0.1});

  cell.submit(request);
  int touched = -1, stopped = -1;
  double force = 0.0, speed = 0.0;
  for (int i = 0; i < 8000; ++i) {
    if (touched < 0) speed = cell.world_.v_WT().norm();
    cell.tick();
    force = std::max(force, cell.world_.block_force());
    if (touched < 0 && cell.world_.block_force() > 0.0) touched = i;
    if (stopped < 0 && cell.channels_->status.latest().stopped()) stopped = i;
  }
  ASSERT_GE(touched, 0);
  ASSERT_GE(stopped, touched);
  std::cout << "speed " << stroke.speed << " m/s: met the block at " << speed << " m/s, stop after " << stopped - touched << " ms, at most "
            << force << " N\n";
  EXPECT_NEAR(speed, stroke.speed, 0.02 * stroke.speed);
  EXPECT_LE(stopped - touched, stroke.most_ms);
  EXPECT_LE(force, stroke.most_force_N);

  const StrokeStatus status = cell.status_of(request.id);
  EXPECT_EQ(status.phase, StrokePhase::kStopped);
  EXPECT_NE(status.text.find("is off by"), std::string::npos) << status.text;
  LoopStatus loop = cell.channels_->status.latest();
  EXPECT_EQ(loop.action, safety::Action::kProtectiveStop);
  EXPECT_TRUE(loop.causes.has(safety::Cause::kFollowingError));
  EXPECT_TRUE(loop.at_rest);
  EXPECT_LT(cell.world_.block_force(), 40.0) << "the set-point has given way: it does not press on";

  // It stands, with the block there and without it, whatever is asked.
  cell.world_.block(std::nullopt);
  cell.run(500);
  const JointVector rest = cell.world_.joint_state().q;
  EXPECT_EQ(cell.ask(StrokeKind::kPark).reason, RefusalReason::kStopped);
  EXPECT_EQ(cell.ask(request).reason, RefusalReason::kStopped);
  cell.run(2000);
  EXPECT_LT((cell.world_.joint_state().q - rest).cwiseAbs().maxCoeff(), 1e-4);

  const StrokeStatus recovered = cell.ask(StrokeKind::kRecover);
  EXPECT_EQ(recovered.phase, StrokePhase::kDone) << recovered.text;
  cell.run(1000);
  EXPECT_LT((cell.world_.joint_state().q - rest).cwiseAbs().maxCoeff(), 1e-4) << "a recovery moves nothing";
  EXPECT_LT((cell.command_.q - rest).cwiseAbs().maxCoeff(), cell.config_.give_way_tolerance) << "the set-point is where the arm is";
  const StrokeStatus again = cell.ask(request);
  EXPECT_EQ(again.phase, StrokePhase::kDone) << again.text;
  EXPECT_LT(cell.jump_, 5e-5) << "from the first command to the last, the set-point never jumped";
}

INSTANTIATE_TEST_SUITE_P(OfAStroke, Collision,
                         ::testing::Values(Stroke{StrokeKind::kPush, 0.15, 40.0, 140.0}, Stroke{StrokeKind::kPush, 0.5, 15.0, 230.0},
                                           Stroke{StrokeKind::kHit, 0.6, 15.0, 260.0}));

// What is no collision: hits up to what the arm attains and pushes through clusters of light and heavy discs.
TEST(NoCollision, IsSeenInAnyStrokeOnDiscs) {
  Cell cell;
  std::mt19937 random{5};
  const auto uniform = [&](double from, double to) { return std::uniform_real_distribution{from, to}(random); };
  int hits = 0, pushes = 0;
  double fastest = 0.0;
  for (int i = 0; hits + pushes < 60 && i < 600; ++i) {
    ASSERT_EQ(cell.ask(StrokeKind::kPark).phase, StrokePhase::kDone);
    cell.place("random:n=" + std::to_string(2 + i % 8) + ",seed=" + std::to_string(i + 1) + ",rmin=0.02,rmax=0.045");
    const auto discs = cell.world_.truth().discs;
    const SimDisc& disc = discs[random() % discs.size()];
    const double angle = uniform(-std::numbers::pi, std::numbers::pi);
    StrokeRequest request;
    request.kind = i % 2 == 0 ? StrokeKind::kHit : StrokeKind::kPush;
    request.direction_W = {std::cos(angle), std::sin(angle)};
    const bool hit = request.kind == StrokeKind::kHit;
    request.p_WS = disc.p_WD - (disc.radius + settings().cell.striker_radius + (hit ? 0.0 : 0.02)) * request.direction_W;
    request.speed = hit ? uniform(0.3, 1.9) : uniform(0.05, 0.2);
    request.run_in = 0.06;
    request.length = uniform(0.05, 0.15);
    // A planner does not let the rod come down on a disc, or close to one.
    const auto in_the_way = [&](const SimDisc& other) {
      for (const double back : {0.0, 0.03, 0.06, 0.09, 0.12}) {
        const double room = (request.p_WS - back * request.direction_W - other.p_WD).norm() - other.radius - settings().cell.striker_radius;
        if (room < (back == 0.0 && hit ? -1e-9 : 0.01)) return true;
      }
      return false;
    };
    if (std::any_of(discs.begin(), discs.end(), in_the_way)) continue;
    StrokeStatus status = cell.ask(request);
    if (status.reason == RefusalReason::kTooFast && status.attainable > 0.0) {
      request.speed = 0.98 * status.attainable;
      status = cell.ask(request);
    }
    if (status.phase == StrokePhase::kRefused) continue;
    ASSERT_EQ(status.phase, StrokePhase::kDone) << to_string(request.kind) << ' ' << i << ": " << status.text;
    ++(hit ? hits : pushes);
    if (hit) fastest = std::max(fastest, status.contact_speed);
  }
  std::cout << hits << " hits up to " << fastest << " m/s, " << pushes << " pushes: following error at most " << 100.0 * cell.error_share_
            << " % of the allowed\n";
  EXPECT_GE(hits, 20);
  EXPECT_GE(pushes, 20);
  EXPECT_GE(fastest, 1.0);
  EXPECT_LT(cell.error_share_, 0.7);
}

}  // namespace
}  // namespace breakshot::control::test
