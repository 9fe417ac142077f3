#pragma once

#include "common/task.hpp"
#include "common/time.hpp"
#include "mes_gateway/protocol/messages.hpp"

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace breakshot::mes {

/// What an order may ask for, and what it gets where it asks for nothing.
struct OrderLimits {
  std::uint32_t robot_id = 1;
  Rect workspace;                    ///< an order's region must lie within it, m
  double default_gap = 0.015;        ///< m
  double most_gap = 0.10;            ///< m
  std::uint32_t most_strokes = 100;  ///< most that max_hits or max_pushes may say
  std::uint32_t default_hits = 8;
  std::uint32_t default_pushes = 24;
  Duration default_timeout = std::chrono::seconds{60};
  Duration most_timeout = std::chrono::minutes{10};
  std::uint32_t most_discs = 50;
};

/// The two clocks that a gateway lives by: the cell's for its own time-outs, the wall's for what it tells the factory.
struct Now {
  Time cell{};
  std::int64_t utc_ns = 0;
};

/// Takes orders, keeps the one that runs, and says how it stands. One order at a time.
///
/// Pure: no DDS, no clock, no threads; messages and the time go in, messages come out. The rules of docs/mes.md hold here: every command gets
/// exactly one verdict (CLEAR's when the recovery is over); a command id that comes again gets the ack it got before and does nothing; stop-class verbs are obeyed in every
/// state and at any age; nothing starts by itself.
class OrderDesk {
 public:
  explicit OrderDesk(const OrderLimits& limits, std::uint64_t first_request_seq);

  /// @return the ack to send; nothing when the command is for another robot, or when its answer comes later (take_answer())
  std::optional<Ack> on_command(const Command& command, const Now& now);
  void on_task_status(const TaskStatus& status, const Now& now);
  /// Whether planner, controller and perception are there and well; `why` says what is missing. Orders are accepted only then.
  void on_cell_ready(bool ready, const std::string& why) {
    cell_ready_ = ready;
    not_ready_why_ = why;
  }
  /// Why the controller is stopped until somebody recovers it; empty: it is not. It takes no orders then, and one that runs ends.
  void on_stop(const std::string& why) { stop_why_ = why; }
  /// Time-outs, and what a stop means. Call it at 10 Hz or more.
  void tick(const Now& now);

  /// The ack of a command that on_command() left unanswered, once.
  std::optional<Ack> take_answer() { return std::exchange(answer_, std::nullopt); }

  /// The request that the planner has not acknowledged yet, at most once per resend period.
  std::optional<TaskRequest> take_request(const Now& now);

  /// How the newest order stands; nothing before the first.
  const std::optional<JobState>& job() const noexcept { return job_; }
  PackState state() const noexcept { return state_; }
  bool accepting() const noexcept { return cell_ready_ && stop_why_.empty() && !clearing_ && !active(); }
  bool paused() const noexcept { return state_ == PackState::kHolding || state_ == PackState::kHeld; }
  const std::string& not_ready_why() const noexcept { return not_ready_why_; }

 private:
  /// A CLEAR that the controller has not answered yet.
  struct Clearing {
    Command command;
    PackState before;                  ///< state that it was given in
    Time since{};                      ///< it came
    std::uint64_t request = 0;         ///< TaskRequest::seq of the recovery; 0: an earlier request is still on its way
    std::optional<std::string> ended;  ///< what the controller ended; its health has not said so yet
  };
  struct Answered {
    Command command;
    Ack ack;
  };
  struct Source {
    std::uint64_t session = 0;
    std::uint64_t seq = 0;
  };

  bool active() const noexcept;
  std::optional<Ack> judge(const Command& command, const Now& now);
  Ack start(const Command& command, const Now& now);
  Ack stop(const Command& command, const Now& now);
  Ack pause_or_resume(const Command& command, const Now& now);
  Ack reset(const Command& command);
  std::optional<Ack> clear(const Command& command, const Now& now);
  void on_recovery_status(const TaskStatus& status);
  void end_clearing(Verdict verdict, Reason reason, std::string text);
  void tick_clearing(const Now& now);
  void tick_stop(const Now& now);
  std::string stopped_text() const;
  std::optional<Ack> check_spec(const Command& command) const;
  Ack reply(const Command& command, Verdict verdict, Reason reason, const std::string& text) const;
  void request(TaskRequest::Verb verb, const Now& now);
  void change(JobPhase phase, PackState state, const Now& now, Reason result = Reason::kNone, std::string text = {});
  void remember(const Command& command, const Ack& ack);

  OrderLimits limits_;
  bool cell_ready_ = false;
  std::string not_ready_why_ = "no process of the cell has been heard yet";
  std::string stop_why_;
  std::optional<Time> stopped_since_;  // while an order runs
  std::optional<Clearing> clearing_;
  std::optional<Ack> answer_;
  PackState state_ = PackState::kIdle;
  std::optional<JobState> job_;
  TaskRequest task_;              // of the newest order, as last sent
  bool request_pending_ = false;  // the planner has not acknowledged task_.seq
  Time request_since_{};
  Time request_sent_{};
  Time status_heard_{};
  std::map<Id, Answered> answered_;  // by command id
  std::deque<Id> answered_order_;    // oldest first; bounds answered_
  std::map<Id, Source> sources_;
};

}  // namespace breakshot::mes
