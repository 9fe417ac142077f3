#include "common/config/formation.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/faults.hpp"
#include "sim_bridge/node/cell_world.hpp"
#include "sim_bridge/node/frame_delay.hpp"
#include "sim_bridge/node/mailbox.hpp"
#include "sim_bridge/node/pace.hpp"
#include "sim_bridge/node/physics_figures.hpp"
#include "sim_bridge/node/scene_watch.hpp"
#include "sim_bridge/sim_bridge_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <limits>
#include <thread>

namespace breakshot::sim_bridge {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr Duration kTick = milliseconds{1};
const std::string kConfig = std::string{BREAKSHOT_SOURCE_DIR} + "/config/cell.yaml";

TEST(Pace, KeepsUpCatchesUpAndSlips) {
  const Time t = time_from_ns(1'000'000'000);
  EXPECT_EQ(pace(t, t, kTick, 50).ticks, 0);
  EXPECT_EQ(pace(t, t - kTick, kTick, 50).ticks, 0);
  EXPECT_EQ(pace(t, t + kTick + Duration{999'999}, kTick, 50).ticks, 1);
  EXPECT_EQ(pace(t, t + 50 * kTick, kTick, 50).ticks, 50);
  EXPECT_EQ(pace(t, t + 50 * kTick, kTick, 50).slip, Duration::zero());
  // However late: after the slip and the ticks the world is at the wall's time to a tick.
  for (const std::int64_t late_us : std::initializer_list<std::int64_t>{51'000, 51'500, 2'000'000, 7'200'000'000}) {
    const Time wall = t + std::chrono::microseconds{late_us};
    const Pace now = pace(t, wall, kTick, 50);
    EXPECT_EQ(now.ticks, 50);
    const Time world = t + now.slip + now.ticks * kTick;
    EXPECT_LE(world, wall);
    EXPECT_GT(world + kTick, wall);
  }
}

TEST(Faults, AreCheckedAtTheDoor) {
  Faults faults;
  EXPECT_THAT(faults.set(0, 0.0).value(), HasSubstr("allowed: 1 to 10"));
  EXPECT_THAT(faults.set(11, 0.0).value(), HasSubstr("fault 11 is unknown"));
  EXPECT_THAT(faults.set(1, 1.5).value(), HasSubstr("camera_dark: value 1.5"));
  EXPECT_TRUE(faults.set(4, -1.0));
  EXPECT_THAT(faults.set(10, 0.2).value(), HasSubstr("camera_moved: value 0.2"));
  EXPECT_TRUE(faults.set(6, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(faults.set(1, 0.0));
  EXPECT_TRUE(faults.has(Fault::kCameraDark));
  EXPECT_FALSE(faults.has(Fault::kCameraSilent));
  EXPECT_FALSE(faults.states_broken());
  EXPECT_FALSE(faults.set(8, 0.0));
  EXPECT_TRUE(faults.states_broken());
  faults.clear();
  EXPECT_FALSE(faults.has(Fault::kCameraDark));
  for (std::uint8_t i = 1; i < 10; ++i) EXPECT_STRNE(to_string(Fault{i}), "invalid");
}

TEST(Mailbox, KeepsTheNewestInOrder) {
  Mailbox<int> box{3};
  for (int i = 0; i < 5; ++i) box.put(i);
  std::vector<int> out;
  box.take_all(out);
  EXPECT_EQ(out, (std::vector{2, 3, 4}));
  box.take_all(out);
  EXPECT_TRUE(out.empty());
  box.wake();
  box.wait_all(out, seconds{10});
  EXPECT_TRUE(out.empty());
}

TEST(SceneWatch, WaitsOnlyForAPerceptionThatIsThere) {
  SceneWatch watch;
  EXPECT_EQ(watch.wait_for(1, seconds{10}), SceneWatch::Outcome::kNobody);
  watch.saw(3);
  EXPECT_EQ(watch.wait_for(3, seconds{10}), SceneWatch::Outcome::kSeen);
  EXPECT_EQ(watch.wait_for(4, milliseconds{1}), SceneWatch::Outcome::kTimeout);
  EXPECT_EQ(watch.wait_for(5, seconds{10}), SceneWatch::Outcome::kNobody);
  watch.saw(5);
  auto waiting = std::async(std::launch::async, [&] { return watch.wait_for(6, seconds{60}); });
  watch.saw(6);
  EXPECT_EQ(waiting.get(), SceneWatch::Outcome::kSeen);
}

TEST(PhysicsFigures, CountTicksSlipsAndTails) {
  PhysicsFigures figures;
  const SimWorld world{load_arm(std::string{BREAKSHOT_SOURCE_DIR} + "/config/arms/ur5e_striker.urdf", "base_link", "striker_tip"), {}};
  for (int i = 0; i < 990; ++i) figures.record({1, {}}, std::chrono::microseconds{50}, std::chrono::microseconds{100}, world);
  for (int i = 0; i < 10; ++i) figures.record({5, milliseconds{3}}, milliseconds{8}, std::chrono::microseconds{100}, world);
  figures.waited();
  const auto summary = figures.summary(time_from_ns(1));
  EXPECT_EQ(summary.ticks, 1040U);
  EXPECT_EQ(summary.rounds, 1001U);
  EXPECT_EQ(summary.slipped, 30U);
  EXPECT_TRUE(summary.waiting);
  EXPECT_LE(summary.wakeup_p99_us, 64.0);
  EXPECT_EQ(summary.wakeup_max_us, 8000.0);
}

/// The world as the process makes it from the shipped configuration.
class CellWorldTest : public testing::Test {
 protected:
  void reset(const std::string& formation) {
    WorldOrder order;
    order.control_seq = 41;
    order.discs = discs_of(load_formation(formation, cell), config, cell);
    ASSERT_EQ(world.carry_out(order), std::nullopt);
  }
  std::optional<std::string> set(Fault fault, double value = 0.0) {
    WorldOrder order;
    order.control_seq = ++seq;
    order.verb = SimControl::Verb::kSetFault;
    order.fault = static_cast<std::uint8_t>(fault);
    order.fault_value = value;
    return world.carry_out(order);
  }
  JointCommand hold() {
    JointCommand command;
    command.seq = ++seq;
    command.session = 5;
    command.due = world.now() + kTick;
    command.q = world.world().joint_state().q;
    command.qd = command.qdd = JointVector::Zero(command.q.size());
    return command;
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) world.tick();
  }

  ConfigDocument document = load_cell_document(kConfig);
  CellConfig cell = load_cell_config(document);
  SimBridgeConfig config = load_sim_bridge_config(document, cell);
  CellWorld world{load_arm(cell.arm.urdf, cell.arm.base_link, cell.arm.tip_link), config, time_from_ns(1'000'000'000), 77};
  std::uint64_t seq = 100;
};

TEST_F(CellWorldTest, EveryFormationCanBePlaced) {
  for (const std::string& name : formation_names(cell)) {
    reset(name);
    EXPECT_GE(world.truth().discs.size(), 2U) << name;
  }
  EXPECT_EQ(world.truth().control_seq, 41U);
}

TEST_F(CellWorldTest, RefusedOrdersChangeNothing) {
  reset("fig11");
  const std::size_t before = world.truth().discs.size();
  WorldOrder order;
  order.control_seq = 43;
  order.discs = {SimDisc{.p_WD = {0.0, 0.0}}, SimDisc{.p_WD = {0.01, 0.0}}};
  EXPECT_THAT(world.carry_out(order).value(), HasSubstr("overlap"));
  EXPECT_EQ(world.truth().control_seq, 41U);
  EXPECT_EQ(world.truth().discs.size(), before);
}

TEST_F(CellWorldTest, TakesPicturesAtTheFrameRateAndWithLatency) {
  std::vector<Shot> shots;
  for (int i = 0; i < 1000; ++i) {
    if (auto shot = world.shot()) shots.push_back(std::move(*shot));
    world.tick();
  }
  ASSERT_EQ(shots.size(), 30U);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    EXPECT_EQ(shots[i].seq, i + 1);
    EXPECT_NEAR(to_seconds(shots[i].due - shots[i].snapshot.stamp), 0.066, 0.020);
    if (i == 0) continue;
    EXPECT_GT(shots[i].due, shots[i - 1].due);
    EXPECT_NEAR(to_seconds(shots[i].snapshot.stamp - shots[i - 1].snapshot.stamp), 1.0 / 30.0, 1e-3);
  }
  world.slip(seconds{10});
  EXPECT_TRUE(world.shot());
  EXPECT_FALSE(world.shot());
}

TEST_F(CellWorldTest, CameraFaultsReachThePictures) {
  EXPECT_EQ(set(Fault::kCameraDark, 0.02), std::nullopt);
  EXPECT_EQ(set(Fault::kCameraLate, 0.5), std::nullopt);
  EXPECT_EQ(set(Fault::kCameraFrozen), std::nullopt);
  const auto shot = world.shot();
  ASSERT_TRUE(shot);
  EXPECT_DOUBLE_EQ(shot->brightness, 0.02);
  EXPECT_NEAR(to_seconds(shot->due - shot->snapshot.stamp), 0.566, 0.020);
  EXPECT_TRUE(shot->frozen);
  EXPECT_EQ(set(Fault::kCameraSilent), std::nullopt);
  run(100);
  EXPECT_FALSE(world.shot());
}

TEST_F(CellWorldTest, DeafDrivesBrake) {
  for (int i = 0; i < 30; ++i) {
    const JointCommand command = hold();
    world.take({&command, 1});
    world.tick();
  }
  EXPECT_FALSE(world.published_state()->braked);
  EXPECT_EQ(set(Fault::kDrivesDeaf), std::nullopt);
  for (int i = 0; i < 30; ++i) {
    const JointCommand command = hold();
    world.take({&command, 1});
    world.tick();
  }
  EXPECT_TRUE(world.published_state()->braked);
}

TEST_F(CellWorldTest, WeakDrivesLetTheArmSink) {
  const JointVector before = world.world().joint_state().q;
  EXPECT_EQ(set(Fault::kDrivesWeak, 0.05), std::nullopt);
  run(200);
  EXPECT_GT((world.world().joint_state().q - before).norm(), 0.01);
}

TEST_F(CellWorldTest, ABlockStandsUntilTheFaultsAreCleared) {
  reset("A");
  EXPECT_THAT(set(Fault::kBlock).value(), HasSubstr("found 0 discs"));
  EXPECT_FALSE(world.faults().has(Fault::kBlock));
  WorldOrder order;
  order.control_seq = ++seq;
  order.verb = SimControl::Verb::kSetFault;
  order.fault = static_cast<std::uint8_t>(Fault::kBlock);
  order.discs = {SimDisc{.p_WD = world.truth().discs[0].p_WD, .radius = 0.02, .height = 0.1}};
  EXPECT_THAT(world.carry_out(order).value(), HasSubstr("overlaps disc 0"));
  order.discs[0].p_WD = {0.2, 0.2};
  EXPECT_EQ(world.carry_out(order), std::nullopt);
  EXPECT_TRUE(world.faults().has(Fault::kBlock));
  WorldOrder under;
  under.discs = {SimDisc{.p_WD = {0.2, 0.22}}};
  EXPECT_THAT(world.carry_out(under).value(), HasSubstr("overlaps the block"));
  WorldOrder clear;
  clear.verb = SimControl::Verb::kClearFaults;
  EXPECT_EQ(world.carry_out(clear), std::nullopt);
  EXPECT_EQ(world.carry_out(under), std::nullopt);
}

TEST_F(CellWorldTest, StatesCanBeSilentOrFrozen) {
  const auto before = world.published_state();
  ASSERT_TRUE(before);
  EXPECT_EQ(before->session, 77U);
  EXPECT_EQ(before->seq, 1U);
  EXPECT_EQ(set(Fault::kStatesFrozen), std::nullopt);
  run(5);
  EXPECT_EQ(world.published_state()->seq, 1U);
  EXPECT_EQ(set(Fault::kStatesSilent), std::nullopt);
  EXPECT_FALSE(world.published_state());
  WorldOrder order;
  order.verb = SimControl::Verb::kClearFaults;
  EXPECT_EQ(world.carry_out(order), std::nullopt);
  EXPECT_EQ(world.published_state()->seq, 6U);
}

TEST(SimBridgeConfigTest, IsStrict) {
  const auto load = [](const std::string& override) {
    const std::vector<std::string> overrides{override};
    const ConfigDocument document = load_cell_document(kConfig, overrides);
    return load_sim_bridge_config(document, load_cell_config(document));
  };
  EXPECT_DOUBLE_EQ(load("sim_bridge.physics.friction=0.4").sim.physics.friction, 0.4);
  EXPECT_EQ(load("sim_bridge.formation=random:n=5,seed=2").formation, "random:n=5,seed=2");
  EXPECT_THROW(load("sim_bridge.physics.friction=-0.1"), ConfigError);
  EXPECT_THROW(load("sim_bridge.physics.friction=.nan"), ConfigError);
  EXPECT_THROW(load("sim_bridge.camera.frame_rate=0"), ConfigError);
  EXPECT_THROW(load("sim_bridge.physics={}"), ConfigError);
  try {
    load("sim_bridge.drives.lag_ms=500");
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("sim_bridge.drives.lag_ms"));
  }
}

TEST(DiscsOf, GivesMassByAreaAndJittersGapsRepeatably) {
  const ConfigDocument document = load_cell_document(kConfig);
  const CellConfig cell = load_cell_config(document);
  SimBridgeConfig config = load_sim_bridge_config(document, cell);
  Formation pair;
  pair.discs = {{.p_WD = {0.0, 0.0}, .radius = 0.03}, {.p_WD = {0.09, 0.0}, .radius = 0.06}};
  const auto exact = discs_of(pair, config, cell);
  EXPECT_DOUBLE_EQ(exact[0].mass, 0.1);
  EXPECT_DOUBLE_EQ(exact[1].mass, 0.4);
  EXPECT_EQ(exact[1].p_WD, Vector2(0.09, 0.0));
  config.gap_jitter = 0.5e-3;
  const auto opened = discs_of(pair, config, cell);
  const double gap = (opened[1].p_WD - opened[0].p_WD).norm() - 0.09;
  EXPECT_GE(gap, 0.0);
  EXPECT_LE(gap, 1e-3);
  EXPECT_EQ(opened[1].p_WD, discs_of(pair, config, cell)[1].p_WD);
}

TEST(FrameDelay, StaysWithinItsJitterAndKeepsTheOrder) {
  using std::chrono::milliseconds;
  FrameDelay delay{milliseconds{66}, milliseconds{20}, 5}, same{milliseconds{66}, milliseconds{20}, 5};
  Time exposed = time_from_ns(1'000'000'000), last{};
  Duration least = std::chrono::hours{1}, most{};
  for (int i = 0; i < 2000; ++i, exposed += milliseconds{33}) {
    const Time due = delay.due(exposed);
    EXPECT_EQ(due, same.due(exposed));
    EXPECT_GT(due, last);
    least = std::min<Duration>(least, due - exposed);
    most = std::max<Duration>(most, due - exposed);
    last = due;
  }
  EXPECT_GE(least, milliseconds{46});
  EXPECT_LE(most, milliseconds{86});
  EXPECT_LT(least, milliseconds{48}) << "the whole range is used";
  EXPECT_GT(most, milliseconds{84});
}

TEST(FrameDelay, FasterThanItsJitterTheOrderIsStillKept) {
  using std::chrono::milliseconds;
  FrameDelay delay{milliseconds{66}, milliseconds{60}, 5};
  Time exposed = time_from_ns(1'000'000'000), last{};
  for (int i = 0; i < 2000; ++i, exposed += milliseconds{8}) {
    const Time due = delay.due(exposed);
    EXPECT_GT(due, last);
    EXPECT_GE(due, exposed);
    last = due;
  }
  FrameDelay exact{milliseconds{66}, Duration::zero(), 5};
  EXPECT_EQ(exact.due(exposed) - exposed, milliseconds{66});
}

}  // namespace
}  // namespace breakshot::sim_bridge
