#include "sim_bridge/faults.hpp"
#include "tests/hil/cell_under_test.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace breakshot::hil {
namespace {

/// A cell with a rack on the table, for orders that do not go as asked.
class Orders : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { cell = std::make_unique<CellUnderTest>(); }
  static void TearDownTestSuite() { cell.reset(); }
  void SetUp() override {
    ASSERT_TRUE(cell->clear_faults());
    ASSERT_TRUE(cell->set_table("E"));
  }
  static std::unique_ptr<CellUnderTest> cell;
};
std::unique_ptr<CellUnderTest> Orders::cell;

TEST_F(Orders, WithAbsurdNumbersAreRefusedAndTheArmRests) {
  const auto before = cell->truth_at_rest();
  ASSERT_TRUE(before);
  mes::JobSpec absurd;
  absurd.min_gap = 5.0;
  const auto ack = cell->place_order(mes::random_id(), absurd);
  ASSERT_TRUE(ack) << cell->logs();
  EXPECT_EQ(ack->verdict, mes::Verdict::kRejected);
  EXPECT_EQ(ack->reason, mes::Reason::kOutOfLimits);
  EXPECT_NE(ack->text.find("min_gap_m"), std::string::npos) << ack->text;

  absurd.min_gap = std::numeric_limits<double>::quiet_NaN();
  const auto malformed = cell->place_order(mes::random_id(), absurd);
  ASSERT_TRUE(malformed);
  EXPECT_EQ(malformed->reason, mes::Reason::kMalformed);

  const auto after = cell->truth_at_rest();
  ASSERT_TRUE(after);
  EXPECT_LT((after->p_WT - before->p_WT).norm(), 1e-3);
  EXPECT_EQ(after->strikes, before->strikes);
}

TEST_F(Orders, ThatAreCancelledInMidTaskEndWithTheArmAtRest) {
  const mes::Id order = mes::random_id();
  const auto ack = cell->place_order(order);
  ASSERT_TRUE(ack && ack->verdict == mes::Verdict::kAccepted) << cell->logs();
  // In mid-task: the striker has left its rest.
  std::optional<SimTruth> truth = cell->truth();
  for (int i = 0; truth && truth->v_WT_W.norm() < 0.05 && i < 100'000; ++i) truth = cell->truth();
  ASSERT_TRUE(truth);
  ASSERT_GE(truth->v_WT_W.norm(), 0.05);

  const auto cancelled = cell->mes().send(cell->mes().command(mes::Verb::kCancel, order), std::chrono::seconds{20});
  ASSERT_TRUE(cancelled);
  EXPECT_EQ(cancelled->verdict, mes::Verdict::kAccepted) << cancelled->text;
  const auto job =
      cell->follow(order, [](const mes::JobState& j) { return j.phase == mes::JobPhase::kAborted || j.phase == mes::JobPhase::kEnded; });
  ASSERT_TRUE(job) << cell->logs();
  EXPECT_EQ(job->phase, mes::JobPhase::kAborted);
  const auto rest = cell->truth_at_rest();
  ASSERT_TRUE(rest);
  EXPECT_LE(job->hits + job->pushes, 1U) << "no stroke is begun after a cancel";
  const auto later = cell->truth_at_rest();
  ASSERT_TRUE(later);
  EXPECT_EQ(later->strikes, rest->strikes) << "nothing is struck once the order has ended";

  // The cell is not spoilt: the next order runs to its end.
  ASSERT_TRUE(cell->set_table("A"));
  const auto next = cell->run_order();
  ASSERT_TRUE(next) << cell->logs();
  EXPECT_EQ(next->phase, mes::JobPhase::kEnded) << next->text;
}

TEST_F(Orders, StopWithAReasonWhenTheCameraGoesDark) {
  const mes::Id order = mes::random_id();
  const auto ack = cell->place_order(order);
  ASSERT_TRUE(ack && ack->verdict == mes::Verdict::kAccepted) << cell->logs();
  ASSERT_TRUE(cell->set_fault(static_cast<std::uint8_t>(sim_bridge::Fault::kCameraDark), 0.0));
  const auto job =
      cell->follow(order, [](const mes::JobState& j) { return j.phase == mes::JobPhase::kAborted || j.phase == mes::JobPhase::kEnded; });
  ASSERT_TRUE(job) << cell->logs();
  EXPECT_EQ(job->phase, mes::JobPhase::kAborted);
  EXPECT_NE(job->text.find("no scene"), std::string::npos) << job->text;
  ASSERT_TRUE(cell->truth_at_rest());

  // Light again: the cell works again, without a restart.
  ASSERT_TRUE(cell->clear_faults());
  ASSERT_TRUE(cell->set_table("A"));
  const auto next = cell->run_order();
  ASSERT_TRUE(next) << cell->logs();
  EXPECT_EQ(next->phase, mes::JobPhase::kEnded) << next->text;
}

TEST_F(Orders, WithAnotherNumberOfDiscsThanExpectedAreAborted) {
  mes::JobSpec spec;
  spec.expect_discs = 7;
  const auto job = cell->run_order(spec);
  ASSERT_TRUE(job) << cell->logs();
  EXPECT_EQ(job->phase, mes::JobPhase::kAborted);
  EXPECT_NE(job->text.find("disc count"), std::string::npos) << job->text;
}

TEST_F(Orders, StrokesToUnreachablePosesAreRefusedWithAReason) {
  const auto before = cell->truth_at_rest();
  ASSERT_TRUE(before);
  StrokeRequest far;
  far.id = 1'000'001;
  far.kind = StrokeKind::kHit;
  far.p_WS = {3.0, 0.0};
  far.direction_W = {1.0, 0.0};
  far.speed = 0.5;
  far.run_in = 0.05;
  const auto status = cell->stroke(far);
  ASSERT_TRUE(status) << cell->logs();
  EXPECT_EQ(status->phase, StrokePhase::kRefused);
  EXPECT_TRUE(status->reason == RefusalReason::kUnreachable || status->reason == RefusalReason::kOutOfBounds) << to_string(status->reason);
  EXPECT_FALSE(status->text.empty());

  StrokeRequest fast = far;
  fast.id = 1'000'002;
  fast.p_WS = {0.0, 0.0};
  fast.speed = 50.0;
  const auto too_fast = cell->stroke(fast);
  ASSERT_TRUE(too_fast);
  EXPECT_EQ(too_fast->phase, StrokePhase::kRefused);

  const auto after = cell->truth_at_rest();
  ASSERT_TRUE(after);
  EXPECT_LT((after->p_WT - before->p_WT).norm(), 1e-3);
}

}  // namespace
}  // namespace breakshot::hil
