#include "common/gap.hpp"
#include "tests/hil/cell_under_test.hpp"

#include <gtest/gtest.h>

namespace breakshot::hil {
namespace {

// Perception reports gaps with an error of a few tenths of a millimetre, so an order that it takes for done may be short by as much in truth.
constexpr double kPerceptionError = 0.001;  // m

/// One cell for all formations: starting five processes takes longer than some orders.
class Formations : public ::testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() { cell = std::make_unique<CellUnderTest>(CellOptions{{"planner.strategy=paper"}, {}, true}); }
  static void TearDownTestSuite() { cell.reset(); }
  static std::unique_ptr<CellUnderTest> cell;
};
std::unique_ptr<CellUnderTest> Formations::cell;

TEST_P(Formations, AreSingulatedByThePapersStrategy) {
  ASSERT_TRUE(cell->set_table(GetParam()));
  const auto job = cell->run_order();
  ASSERT_TRUE(job) << cell->logs();
  EXPECT_EQ(job->phase, mes::JobPhase::kEnded) << job->text << '\n' << cell->logs();

  const auto truth = cell->truth_at_rest();
  ASSERT_TRUE(truth);
  const auto& config = cell->config();
  EXPECT_GE(smallest_gap_between(truth->discs), config.target_gap - kPerceptionError);
  for (const auto& disc : truth->discs) {
    EXPECT_TRUE(disc.on_table);
    EXPECT_TRUE(config.workspace.contains(disc.p_WD)) << disc.p_WD.transpose();
  }
  EXPECT_GE(truth->strikes, 1U) << "discs do not part by themselves";
  EXPECT_EQ(job->discs_seen, truth->discs.size());
}

INSTANTIATE_TEST_SUITE_P(OfThePaper, Formations, ::testing::Values("A", "B", "C", "D", "E", "F"));

}  // namespace
}  // namespace breakshot::hil
