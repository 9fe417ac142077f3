#pragma once

#include "client/order_client.hpp"
#include "common/config/cell_config.hpp"
#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "launcher/process_group.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::hil {

struct CellOptions {
  std::vector<std::string> overrides;  ///< "section.key=value", as for --set
  std::vector<std::string> without;    ///< processes that are not started
  bool lockstep = true;
};

/// The whole cell, every process real, over real DDS, in lockstep: the world waits for the controller, so the outcome does not depend on how
/// loaded the machine is. Domains are this test process's own, so that test programs may run side by side.
class CellUnderTest {
 public:
  explicit CellUnderTest(CellOptions options = {});
  ~CellUnderTest();
  CellUnderTest(const CellUnderTest&) = delete;
  CellUnderTest& operator=(const CellUnderTest&) = delete;
  CellUnderTest(CellUnderTest&&) = delete;
  CellUnderTest& operator=(CellUnderTest&&) = delete;

  launcher::ProcessGroup& processes() { return *group_; }
  client::OrderClient& mes() { return *mes_; }
  /// Section `cell` as the processes read it.
  const CellConfig& config() const noexcept { return config_; }
  /// Command line of a process of this cell, for starting another one beside it.
  std::vector<std::string> arguments() const { return arguments_; }

  /// Puts a formation on the table and waits until the camera's frames show it. @return false when it never did
  bool set_table(const std::string& formation);
  bool set_fault(std::uint8_t fault, double value = 0.0);
  /// Stands an upright post on the table that nobody knows of, until clear_faults().
  bool set_block(const Vector2& p_W, double radius, double height);
  bool clear_faults();

  /// The simulator's next truth; nothing within ten seconds means that it stands still.
  std::optional<SimTruth> truth();
  /// Truth once the striker has not moved for 0.3 s of cell time; nothing when it never rests.
  std::optional<SimTruth> truth_at_rest(Duration patience = std::chrono::seconds{30});

  /// Sends an order and follows it to its end. @return its last state; nothing when it was rejected or never ended
  std::optional<mes::JobState> run_order(const mes::JobSpec& spec = {}, Duration patience = std::chrono::minutes{4});
  /// Sends an order, waiting for a cell that is still getting ready. @return the ack
  std::optional<mes::Ack> place_order(const mes::Id& order, const mes::JobSpec& spec = {});
  /// Sends a CLEAR, what `./breakshot recover` does. @return the ack
  std::optional<mes::Ack> recover();
  /// Follows an order until `done` says so. @return its last state then
  std::optional<mes::JobState> follow(const mes::Id& order, const std::function<bool(const mes::JobState&)>& done,
                                      Duration patience = std::chrono::minutes{4});

  /// Sends a stroke straight to the controller, as a planner would, and waits for its final status.
  std::optional<StrokeStatus> stroke(StrokeRequest request);

  /// Of the test itself, on the cell's domain.
  dds::Participant& participant() { return *participant_; }

  /// The last lines of every process, for the message of a test that failed.
  std::string logs() const;

 private:
  bool control(SimControl request);

  int cell_domain_;
  int mes_domain_;
  std::string flights_;  ///< folder of the controller's flight records; stays when the test fails
  std::vector<std::string> arguments_;
  std::unique_ptr<launcher::ProcessGroup> group_;
  std::unique_ptr<client::OrderClient> mes_;
  std::unique_ptr<dds::Participant> participant_;
  std::unique_ptr<dds::Writer<SimControl>> control_;
  std::unique_ptr<dds::Writer<StrokeRequest>> strokes_;
  std::unique_ptr<dds::Reader<StrokeStatus>> stroke_statuses_;
  std::unique_ptr<dds::Reader<SimTruth>> truths_;
  std::uint64_t control_seq_ = 0;
  CellConfig config_;
};

}  // namespace breakshot::hil
