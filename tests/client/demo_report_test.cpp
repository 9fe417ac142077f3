#include "client/demo/report.hpp"

#include <gtest/gtest.h>

namespace breakshot::client {
namespace {

/// A run whose stroke the controller stopped. @param by_host  periods that the host took from it
RunRecord stopped_run(std::uint64_t by_host) {
  RunRecord run;
  run.task.emplace();
  run.task->failure = TaskFailure::kControllerFault;
  run.job.emplace();
  run.job->phase = mes::JobPhase::kAborted;
  run.job->text = "controller fault: the stroke was stopped: no fresh joint state";
  Health controller;
  controller.loop_hz = 985.0;
  controller.overruns = by_host + 2;
  controller.overruns_hosts = by_host;
  run.healths["controller"] = controller;
  return run;
}

TEST(DemoReport, SaysWhenTheMachineAndNotTheCellIsToBlame) {
  const std::string held_up = summary(stopped_run(181));
  EXPECT_NE(held_up.find("NOT SINGULATED"), std::string::npos) << held_up;
  EXPECT_NE(held_up.find("no fresh joint state"), std::string::npos) << held_up;
  EXPECT_NE(held_up.find("183 overruns (181 by the host)"), std::string::npos) << held_up;
  EXPECT_NE(held_up.find("run it again"), std::string::npos) << held_up;
  const std::string ours = summary(stopped_run(0));
  EXPECT_EQ(ours.find("by the host"), std::string::npos) << ours;
  EXPECT_EQ(ours.find("run it again"), std::string::npos) << ours;
}

TEST(DemoReport, NamesTheReasonOfARefusalAndInventsNoneForAStop) {
  Outcome outcome;
  outcome.stroke_phase = StrokePhase::kRefused;
  outcome.reason = RefusalReason::kTooFast;
  EXPECT_NE(outcome_line({}, outcome).find(to_string(RefusalReason::kTooFast)), std::string::npos);
  outcome.stroke_phase = StrokePhase::kStopped;
  outcome.reason = RefusalReason::kNone;
  EXPECT_EQ(outcome_line({}, outcome), "    stopped on the way");
}

}  // namespace
}  // namespace breakshot::client
