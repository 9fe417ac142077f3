#include "sim_bridge/arm/servo_drives.hpp"

#include "tests/sim_bridge/cell_arm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace breakshot::sim_bridge {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr Duration kTick = milliseconds{1};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Drives that stand at zero, and a commander that asks them for a motion of the first joint.
class ServoDrivesTest : public testing::Test {
 protected:
  JointCommand command(double position, double speed, Time due) {
    JointCommand command;
    command.seq = ++seq;
    command.session = 7;
    command.due = due;
    command.q = position * JointVector::Unit(6, 0);
    command.qd = speed * JointVector::Unit(6, 0);
    command.qdd = JointVector::Zero(6);
    return command;
  }
  /// Takes the drives to 1 rad/s and 1 rad per second of `now`, commanding one tick ahead; returns with now one tick past the last command.
  void cruise(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const double speed = std::min(1.0, 0.01 * (i + 1));
      q += speed * 1e-3;
      ASSERT_EQ(drives.take(command(q, speed, now + kTick), now), CommandVerdict::kTaken) << i;
      now += kTick;
      drives.watch(now);
    }
  }
  std::uint64_t count(CommandVerdict verdict) const { return drives.verdicts()[static_cast<std::size_t>(verdict)]; }

  DriveSettings settings;
  ServoDrives drives{cell_arm(), settings, JointVector::Zero(6)};
  Time now = time_from_ns(1'000'000'000);
  std::uint64_t seq = 0;
  double q = 0.0;
};

TEST_F(ServoDrivesTest, StandsStillUntilCommanded) {
  EXPECT_TRUE(drives.braked());
  EXPECT_EQ(drives.command_seq(), 0U);
  EXPECT_EQ(drives.reference(now + milliseconds{500}).q, JointVector::Zero(6));
}

TEST_F(ServoDrivesTest, PassesEverySetPointAtItsDuePlusLag) {
  Time first_due{};
  for (int i = 0; i < 50; ++i) {
    const double t = 1e-3 * (i + 1);
    const Time due = now + kTick;
    if (i == 0) first_due = due;
    ASSERT_EQ(drives.take(command(0.5 * t * t, t, due), now), CommandVerdict::kTaken);
    now += kTick;
    if (now - settings.lag < first_due + kTick) continue;
    const double then = t - to_seconds(settings.lag);
    EXPECT_NEAR(drives.reference(now).q[0], 0.5 * then * then, 1e-12);
    EXPECT_NEAR(drives.reference(now).qd[0], then, 1e-9);
    // Between the set-points too, because the motion is a cubic.
    EXPECT_NEAR(drives.reference(now - microseconds{400}).q[0], 0.5 * (then - 4e-4) * (then - 4e-4), 1e-9);
  }
}

TEST_F(ServoDrivesTest, GoesStraightOnPastTheNewestSetPoint) {
  cruise(300);
  const double before = drives.reference(now + milliseconds{4}).q[0];
  EXPECT_NEAR(drives.reference(now + milliseconds{10}).q[0] - before, 6e-3, 1e-9);
  EXPECT_FALSE(drives.braked());
}

TEST_F(ServoDrivesTest, BrakesAfterTwentyTicksOfSilenceAndThenStands) {
  cruise(300);
  const Time last = now - kTick;
  while (!drives.braked()) {
    now += kTick;
    drives.watch(now);
  }
  EXPECT_EQ(now - last, settings.silence_limit + kTick);
  const double from = drives.reference(now).q[0];
  const double stop_s = 1.0 / settings.brake_deceleration;
  double speed = 1.0;
  for (Time t = now; t < now + from_seconds(stop_s); t += kTick) {
    EXPECT_LE(drives.reference(t).qd[0], speed + 1e-12);
    speed = drives.reference(t).qd[0];
  }
  const DriveReference rest = drives.reference(now + from_seconds(stop_s));
  EXPECT_EQ(rest.qd, JointVector::Zero(6));
  EXPECT_NEAR(rest.q[0] - from, 0.5 * stop_s, 1e-9);
  EXPECT_TRUE(drives.holds_still(now + from_seconds(stop_s)));
}

TEST_F(ServoDrivesTest, ObeysOneCommanderAtATime) {
  cruise(50);
  JointCommand stranger = command(q, 0.0, now + kTick);
  stranger.session = 8;
  EXPECT_EQ(drives.take(stranger, now), CommandVerdict::kOtherSession);
  EXPECT_EQ(drives.take(command(q, 0.5, now + kTick), now), CommandVerdict::kTaken);

  // Once the first one is silent, and the arm stands, another may take over - from where the arm is.
  now += milliseconds{500};
  drives.watch(now);
  ASSERT_TRUE(drives.braked());
  now += milliseconds{500};
  const JointVector here = drives.reference(now).q;
  stranger.q = here;
  stranger.qd.setZero();
  stranger.seq = 1;
  stranger.due = now + kTick;
  EXPECT_EQ(drives.take(stranger, now), CommandVerdict::kTaken);
  EXPECT_FALSE(drives.braked());
  EXPECT_EQ(drives.take(command(here[0], 0.0, now + 2 * kTick), now), CommandVerdict::kOtherSession);
  EXPECT_EQ(count(CommandVerdict::kOtherSession), 2U);
}

TEST_F(ServoDrivesTest, TakingOverIsSmooth) {
  cruise(300);
  now += milliseconds{25};
  drives.watch(now);
  ASSERT_TRUE(drives.braked());
  now += milliseconds{10};
  const DriveReference braking = drives.reference(now);
  ASSERT_GT(braking.qd[0], 0.5);
  const Time due = now + kTick;
  ASSERT_EQ(drives.take(command(braking.q[0] + 3e-3 * braking.qd[0], braking.qd[0], due), now), CommandVerdict::kTaken);
  EXPECT_NEAR((drives.reference(now).q - braking.q).norm(), 0.0, 1e-12);
  EXPECT_NEAR((drives.reference(now).qd - braking.qd).norm(), 0.0, 1e-12);
}

TEST_F(ServoDrivesTest, RefusesAndCountsWhatIsAbsurd) {
  cruise(50);
  const DriveReference before = drives.reference(now);
  const std::uint64_t taken = drives.command_seq();

  JointCommand bad = command(kNan, 0.0, now + kTick);
  EXPECT_EQ(drives.take(bad, now), CommandVerdict::kMalformed);
  bad = command(q, 0.0, now + kTick);
  bad.qdd[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(drives.take(bad, now), CommandVerdict::kMalformed);
  bad.qdd = JointVector::Zero(5);
  EXPECT_EQ(drives.take(bad, now), CommandVerdict::kMalformed);
  EXPECT_EQ(drives.take(command(7.0, 0.0, now + kTick), now), CommandVerdict::kOutOfRange);
  EXPECT_EQ(drives.take(command(q, 3.2, now + kTick), now), CommandVerdict::kTooFast);
  EXPECT_EQ(drives.take(command(q + 0.5, 0.0, now + kTick), now), CommandVerdict::kJump);
  EXPECT_EQ(drives.take(command(q, 0.0, now + milliseconds{101}), now), CommandVerdict::kBadDue);
  EXPECT_EQ(drives.take(command(q, 0.0, now - milliseconds{21}), now), CommandVerdict::kBadDue);
  EXPECT_EQ(drives.take(command(q, 0.0, now - milliseconds{2}), now), CommandVerdict::kOld);
  bad = command(q, 0.0, now + kTick);
  bad.seq = taken;
  EXPECT_EQ(drives.take(bad, now), CommandVerdict::kOld);

  EXPECT_EQ(drives.command_seq(), taken);
  EXPECT_EQ(drives.reference(now).q, before.q);
  EXPECT_EQ(count(CommandVerdict::kMalformed), 3U);
  EXPECT_EQ(count(CommandVerdict::kTaken), 50U);
}

TEST_F(ServoDrivesTest, StaysInsideTheRangesWhateverTheExtrapolationSays) {
  ArmDescription arm = cell_arm();
  arm.joints[0].upper = 0.2;
  drives = ServoDrives{arm, settings, JointVector::Zero(6)};
  cruise(240);
  for (int i = 0; i < 500; ++i) {
    now += kTick;
    drives.watch(now);
    EXPECT_LE(drives.reference(now).q[0], 0.2);
  }
  EXPECT_EQ(drives.reference(now).qd, JointVector::Zero(6));
}

}  // namespace
}  // namespace breakshot::sim_bridge
