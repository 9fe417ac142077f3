#include "sim_bridge/faults.hpp"
#include "tests/hil/cell_under_test.hpp"

#include <gtest/gtest.h>

namespace breakshot::hil {
namespace {

using std::chrono::seconds;

bool is_final(const mes::JobState& job) { return job.phase == mes::JobPhase::kAborted || job.phase == mes::JobPhase::kEnded; }

// Somebody knocks the camera by 3 mm. It is seen, measured and said; nothing is struck; and when the camera is back, the cell works again.
TEST(Camera, AMovedCameraStopsTheWorkUntilItIsBack) {
  CellUnderTest cell;
  ASSERT_TRUE(cell.set_table("A"));
  dds::Reader<Health> healths{cell.participant()};
  const auto perception_says = [&](HealthState state, const std::string& words) {
    const auto give_up = std::chrono::steady_clock::now() + seconds{60};
    Health health;
    while (std::chrono::steady_clock::now() < give_up) {
      if (!healths.take(health, seconds{5}) || health.process != "perception") continue;
      if (health.state == state && health.text.find(words) != std::string::npos) return true;
    }
    ADD_FAILURE() << health.process << " says \"" << health.text << "\"";
    return false;
  };
  ASSERT_TRUE(perception_says(HealthState::kReady, "the camera is in place to 0."));
  const auto before = cell.truth();
  ASSERT_TRUE(before);

  ASSERT_TRUE(cell.set_fault(static_cast<std::uint8_t>(sim_bridge::Fault::kCameraMoved), 0.003));
  // An order may still be taken before anybody has looked; then it is given up.
  const mes::Id order = mes::random_id();
  auto ack = cell.mes().send(cell.mes().command(mes::Verb::kStoreAndStart, order), seconds{20});
  ASSERT_TRUE(ack) << cell.logs();
  if (ack->verdict != mes::Verdict::kRejected) {
    const auto job = cell.follow(order, is_final);
    ASSERT_TRUE(job) << cell.logs();
    EXPECT_EQ(job->phase, mes::JobPhase::kAborted);
    EXPECT_NE(job->text.find("the camera has moved by"), std::string::npos) << job->text;
  }
  ASSERT_TRUE(perception_says(HealthState::kDegraded, "the camera has moved by 3.")) << cell.logs();
  ack = cell.mes().send(cell.mes().command(mes::Verb::kStoreAndStart, mes::random_id()), seconds{20});
  ASSERT_TRUE(ack) << cell.logs();
  EXPECT_EQ(ack->verdict, mes::Verdict::kRejected);
  EXPECT_EQ(ack->reason, mes::Reason::kNotReady);
  EXPECT_NE(ack->text.find("the camera has moved by"), std::string::npos) << ack->text;
  EXPECT_EQ(cell.truth()->strikes, before->strikes);

  ASSERT_TRUE(cell.clear_faults());
  ASSERT_TRUE(perception_says(HealthState::kReady, "the camera is in place to 0.")) << cell.logs();
  const auto job = cell.run_order();
  ASSERT_TRUE(job) << cell.logs();
  EXPECT_EQ(job->phase, mes::JobPhase::kEnded) << job->text;
}

}  // namespace
}  // namespace breakshot::hil
