#include "mes_gateway/order_desk.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace breakshot::mes {

namespace {

// The planner takes a request within milliseconds; the reliable topic resends lost datagrams by itself, so this covers a planner that restarts.
constexpr Duration kResendEvery = std::chrono::milliseconds{250};
constexpr Duration kPlannerSilent = std::chrono::seconds{5};
// Ids remembered for idempotency. At one command a second this is more than an hour, far beyond any resend.
constexpr std::size_t kRemembered = 4096;
// The planner tells of a stopped stroke with its figures before this; an order that stands between two strokes is ended here.
constexpr Duration kStopGrace = std::chrono::milliseconds{500};
constexpr std::size_t kAckText = 128;  // Ack::text

/// Stop-class verbs are obeyed in every state and at any age, and never refused for how they were sent.
bool stops(Verb verb) noexcept { return verb == Verb::kPause || verb == Verb::kStop || verb == Verb::kAbort || verb == Verb::kCancel; }

/// Same content, whatever the header says: a resent command has a new sequence number and stamp.
bool same_content(const Command& a, const Command& b) noexcept {
  const auto same_spec = [](const JobSpec& x, const JobSpec& y) {
    return x.min_gap == y.min_gap && x.region.min == y.region.min && x.region.max == y.region.max && x.expect_discs == y.expect_discs &&
           x.max_hits == y.max_hits && x.max_pushes == y.max_pushes && x.timeout_ms == y.timeout_ms && x.speed_scale == y.speed_scale;
  };
  return a.order_id == b.order_id && a.order_rev == b.order_rev && a.verb == b.verb && a.mode == b.mode && same_spec(a.spec, b.spec);
}

bool all_zero(const Rect& rect) noexcept { return rect.min.isZero(0.0) && rect.max.isZero(0.0); }

JobPhase job_phase(TaskPhase phase) noexcept {
  switch (phase) {
    case TaskPhase::kPaused: return JobPhase::kInterrupted;
    case TaskPhase::kSingulated: return JobPhase::kEnded;
    case TaskPhase::kFailed:
    case TaskPhase::kCancelled: return JobPhase::kAborted;
    default: return JobPhase::kRunning;
  }
}

/// The order's result in the factory's words; the text says which failure it was.
Reason job_result(const TaskStatus& status) noexcept {
  if (status.phase != TaskPhase::kFailed) return Reason::kNone;
  switch (status.failure) {
    case TaskFailure::kBadRequest: return Reason::kUnsupportedParam;
    case TaskFailure::kControllerFault:
    case TaskFailure::kForeignObject:
    case TaskFailure::kNoScene: return Reason::kNotReady;
    case TaskFailure::kWrongDiscCount:
    case TaskFailure::kTimeout:
    case TaskFailure::kStrokeLimit:
    case TaskFailure::kDiscLost:
    case TaskFailure::kNoFeasibleStroke: return Reason::kOutOfLimits;
    case TaskFailure::kNone: break;
  }
  return Reason::kInternal;
}

}  // namespace

OrderDesk::OrderDesk(const OrderLimits& limits, std::uint64_t first_request_seq) : limits_{limits} { task_.seq = first_request_seq; }

bool OrderDesk::active() const noexcept {
  return job_ && (job_->phase == JobPhase::kRunning || job_->phase == JobPhase::kInterrupted || job_->phase == JobPhase::kAllowedToStart);
}

std::optional<Ack> OrderDesk::on_command(const Command& command, const Now& now) {
  if (command.header.robot_id != limits_.robot_id) return std::nullopt;
  if (clearing_ && command.command_id == clearing_->command.command_id) return std::nullopt;  // its answer is on its way
  if (const auto known = answered_.find(command.command_id); known != answered_.end()) {
    if (!same_content(known->second.command, command)) {
      return reply(command, Verdict::kRejected, Reason::kSameRevDiffers,
                   "this command_id was used before for another command; use a new one");
    }
    Ack again = known->second.ack;
    if (again.verdict == Verdict::kAccepted) again.verdict = Verdict::kDuplicate;
    again.state = state_;
    return again;
  }
  auto ack = judge(command, now);
  if (ack) remember(command, *ack);
  return ack;
}

std::optional<Ack> OrderDesk::judge(const Command& command, const Now& now) {
  const auto reject = [&](Reason reason, const std::string& text) { return reply(command, Verdict::kRejected, reason, text); };
  if (command.header.major != kMajor) {
    return reject(Reason::kVersion,
                  fmt::format("protocol version {}.{}; this cell speaks {}.x", command.header.major, command.header.minor, kMajor));
  }
  if (command.verb > Verb::kQuery) {
    return reject(Reason::kMalformed,
                  fmt::format("verb is {}; allowed: 0 to {}", static_cast<unsigned>(command.verb), static_cast<unsigned>(Verb::kQuery)));
  }
  if (!stops(command.verb)) {
    auto& source = sources_[command.header.source_id];
    const bool older =
        command.header.session < source.session || (command.header.session == source.session && command.header.seq <= source.seq);
    if (older) return reject(Reason::kStale, "session or seq is not newer than the last command of this source");
    source = {command.header.session, command.header.seq};
    const double age_ms = static_cast<double>(now.utc_ns - command.header.stamp_utc_ns) * 1e-6;
    if (command.valid_for_ms != 0 && age_ms > static_cast<double>(command.valid_for_ms)) {
      return reject(Reason::kStale, fmt::format("the command is {:.0f} ms old; it was valid for {} ms", age_ms, command.valid_for_ms));
    }
  }
  switch (command.verb) {
    case Verb::kStoreAndStart: return start(command, now);
    case Verb::kCancel:
    case Verb::kStop:
    case Verb::kAbort: return stop(command, now);
    case Verb::kPause:
    case Verb::kResume: return pause_or_resume(command, now);
    case Verb::kClear: return clear(command, now);
    case Verb::kReset: return reset(command);
    case Verb::kQuery:
      if (!job_ || job_->order_id != command.order_id) return reject(Reason::kUnknownOrder, "no such order");
      return reply(command, Verdict::kAccepted, Reason::kNone, fmt::format("the order is {}", to_string(job_->phase)));
    default:
      return reject(Reason::kUnsupportedParam,
                    fmt::format("{} is not served; served are STORE_AND_START, CANCEL, STOP, ABORT, PAUSE, RESUME, CLEAR, RESET, QUERY",
                                to_string(command.verb)));
  }
}

std::optional<Ack> OrderDesk::check_spec(const Command& command) const {
  const JobSpec& spec = command.spec;
  const auto reject = [&](Reason reason, const std::string& text) { return reply(command, Verdict::kRejected, reason, text); };
  for (const double number :
       {spec.min_gap, spec.speed_scale, spec.region.min.x(), spec.region.min.y(), spec.region.max.x(), spec.region.max.y()}) {
    if (!std::isfinite(number)) return reject(Reason::kMalformed, "a number of the order is NaN or infinite");
  }
  if (spec.min_gap < 0.0 || spec.min_gap > limits_.most_gap) {
    return reject(Reason::kOutOfLimits, fmt::format("min_gap_m is {}; allowed: 0 (as configured) to {}", spec.min_gap, limits_.most_gap));
  }
  if (!(spec.speed_scale > 0.0 && spec.speed_scale <= 1.0)) {
    return reject(Reason::kOutOfLimits, fmt::format("speed_scale is {}; allowed: above 0 to 1", spec.speed_scale));
  }
  if (!all_zero(spec.region)) {
    const Rect& w = limits_.workspace;
    const bool inside = w.contains(spec.region.min) && w.contains(spec.region.max);
    if (!inside || (spec.region.min.array() >= spec.region.max.array()).any()) {
      return reject(Reason::kOutOfLimits,
                    fmt::format("region_xyxy_m is not a rectangle within [{}, {}, {}, {}]", w.min.x(), w.min.y(), w.max.x(), w.max.y()));
    }
  }
  const auto most_ms = std::chrono::duration_cast<std::chrono::milliseconds>(limits_.most_timeout).count();
  if (spec.timeout_ms > most_ms)
    return reject(Reason::kOutOfLimits, fmt::format("timeout_ms is {}; allowed: 0 to {}", spec.timeout_ms, most_ms));
  if (spec.max_hits > limits_.most_strokes || spec.max_pushes > limits_.most_strokes) {
    return reject(Reason::kOutOfLimits,
                  fmt::format("max_hits is {}, max_pushes is {}; allowed: 0 to {}", spec.max_hits, spec.max_pushes, limits_.most_strokes));
  }
  if (spec.expect_discs > limits_.most_discs) {
    return reject(Reason::kOutOfLimits, fmt::format("expect_discs is {}; allowed: 0 to {}", spec.expect_discs, limits_.most_discs));
  }
  return std::nullopt;
}

Ack OrderDesk::start(const Command& command, const Now& now) {
  if (const auto refused = check_spec(command)) return *refused;
  if (command.order_id == Id{}) return reply(command, Verdict::kRejected, Reason::kMalformed, "order_id is all zero");
  if (active()) return reply(command, Verdict::kRejected, Reason::kOtherOrderActive, "order " + to_text(job_->order_id) + " is active");
  if (job_ && job_->order_id == command.order_id && command.order_rev <= job_->order_rev) {
    return reply(command, Verdict::kRejected, Reason::kOrderClosed,
                 "this order and revision has ended; send a new order_id or a higher order_rev");
  }
  if (clearing_) return reply(command, Verdict::kRejected, Reason::kBadState, "a recovery (CLEAR) is under way");
  if (!stop_why_.empty()) return reply(command, Verdict::kRejected, Reason::kSafetyStop, stopped_text());
  if (!cell_ready_) return reply(command, Verdict::kRejected, Reason::kNotReady, not_ready_why_);

  const JobSpec& spec = command.spec;
  task_.order_id = command.order_id;
  task_.order_rev = command.order_rev;
  task_.min_gap = spec.min_gap > 0.0 ? spec.min_gap : limits_.default_gap;
  task_.region = all_zero(spec.region) ? limits_.workspace : spec.region;
  task_.expect_discs = spec.expect_discs;
  task_.max_hits = spec.max_hits != 0 ? spec.max_hits : limits_.default_hits;
  task_.max_pushes = spec.max_pushes != 0 ? spec.max_pushes : limits_.default_pushes;
  task_.timeout = spec.timeout_ms != 0 ? Duration{std::chrono::milliseconds{spec.timeout_ms}} : limits_.default_timeout;
  task_.speed_scale = spec.speed_scale;
  request(TaskRequest::Verb::kStart, now);

  job_ = JobState{};
  job_->header.robot_id = limits_.robot_id;
  job_->order_id = command.order_id;
  job_->order_rev = command.order_rev;
  job_->accepted_utc_ns = now.utc_ns;
  status_heard_ = now.cell;
  change(JobPhase::kAllowedToStart, PackState::kStarting, now);
  return reply(command, Verdict::kAccepted, Reason::kNone, "");
}

Ack OrderDesk::stop(const Command& command, const Now& now) {
  // STOP and ABORT mean the machine, whatever order it works on; CANCEL means one order.
  if (command.verb == Verb::kCancel && (!job_ || job_->order_id != command.order_id)) {
    return reply(command, Verdict::kRejected, Reason::kUnknownOrder, "no such order");
  }
  if (!active()) {
    if (command.verb == Verb::kCancel)
      return reply(command, Verdict::kRejected, Reason::kOrderClosed, fmt::format("the order is {}", to_string(job_->phase)));
    return reply(command, Verdict::kAccepted, Reason::kNone, "nothing runs");
  }
  request(TaskRequest::Verb::kCancel, now);
  change(job_->phase, command.verb == Verb::kAbort ? PackState::kAborting : PackState::kStopping, now);
  return reply(command, Verdict::kAccepted, Reason::kNone, "the arm parks, then the order is ABORTED");
}

Ack OrderDesk::pause_or_resume(const Command& command, const Now& now) {
  const bool pause = command.verb == Verb::kPause;
  if (!active()) return reply(command, Verdict::kRejected, Reason::kBadState, "nothing runs");
  if (state_ == PackState::kStopping || state_ == PackState::kAborting) {
    return reply(command, Verdict::kRejected, Reason::kBadState, "the order is being cancelled");
  }
  if (!pause && !paused()) return reply(command, Verdict::kRejected, Reason::kBadState, "the order is not paused");
  request(pause ? TaskRequest::Verb::kPause : TaskRequest::Verb::kResume, now);
  change(job_->phase, pause ? PackState::kHolding : PackState::kUnholding, now);
  return reply(command, Verdict::kAccepted, Reason::kNone, "");
}

std::string OrderDesk::stopped_text() const { return "stopped; first ./breakshot recover (CLEAR). Cause: " + stop_why_; }

// The recovery itself. Its outcome is the controller's to tell, so the ack waits for it.
std::optional<Ack> OrderDesk::clear(const Command& command, const Now& now) {
  if (active()) return reply(command, Verdict::kRejected, Reason::kBadState, "an order runs; STOP or CANCEL ends it first");
  if (clearing_) return reply(command, Verdict::kRejected, Reason::kBadState, "another recovery (CLEAR) is under way");
  clearing_ = Clearing{command, state_, now.cell, 0, std::nullopt};
  state_ = PackState::kClearing;
  status_heard_ = now.cell;
  tick_clearing(now);
  return std::nullopt;
}

Ack OrderDesk::reset(const Command& command) {
  if (active() || clearing_) return reply(command, Verdict::kRejected, Reason::kBadState, fmt::format("the cell is {}", to_string(state_)));
  if (!stop_why_.empty()) return reply(command, Verdict::kRejected, Reason::kSafetyStop, stopped_text());
  if (state_ == PackState::kAborted) return reply(command, Verdict::kRejected, Reason::kBadState, "the cell is ABORTED: CLEAR first");
  state_ = PackState::kIdle;
  return reply(command, Verdict::kAccepted, Reason::kNone, "");
}

void OrderDesk::on_recovery_status(const TaskStatus& status) {
  if (!clearing_ || clearing_->request == 0 || status.request_seq != clearing_->request) return;
  switch (status.phase) {
    case TaskPhase::kRecovering: return;
    case TaskPhase::kRecovered: clearing_->ended = status.text; return;
    case TaskPhase::kFailed: return end_clearing(Verdict::kRejected, Reason::kSafetyStop, status.text);
    default: return end_clearing(Verdict::kRejected, Reason::kBadState, "the planner has not ended its last order yet; try again");
  }
}

void OrderDesk::end_clearing(Verdict verdict, Reason reason, std::string text) {
  const Clearing clearing = *std::exchange(clearing_, std::nullopt);
  const bool done = verdict == Verdict::kAccepted;
  state_ = done && clearing.before == PackState::kAborted ? PackState::kStopped : clearing.before;
  answer_ = reply(clearing.command, verdict, reason, text);
  remember(clearing.command, *answer_);
}

void OrderDesk::tick_clearing(const Now& now) {
  if (!clearing_) return;
  if (clearing_->request == 0 && !request_pending_) {
    request(TaskRequest::Verb::kRecover, now);
    clearing_->request = task_.seq;
  }
  // An order that follows the ack at once is to be taken: the ack waits for the controller's health to agree.
  if (clearing_->ended && stop_why_.empty()) return end_clearing(Verdict::kAccepted, Reason::kNone, *clearing_->ended);
  if (clearing_->ended && now.cell - clearing_->since > kPlannerSilent) {
    return end_clearing(Verdict::kRejected, Reason::kSafetyStop, "stopped again: " + stop_why_);
  }
  if (now.cell - status_heard_ > kPlannerSilent || now.cell - clearing_->since > 2 * kPlannerSilent) {
    request_pending_ = false;
    end_clearing(Verdict::kRejected, Reason::kNotReady,
                 fmt::format("the planner has not answered for {:.0f} s", to_seconds(kPlannerSilent)));
  }
}

void OrderDesk::tick_stop(const Now& now) {
  if (stop_why_.empty() || clearing_) {
    stopped_since_.reset();
  } else if (!active()) {
    state_ = PackState::kAborted;
  } else if (!stopped_since_) {
    stopped_since_ = now.cell;
  } else if (now.cell - *stopped_since_ > kStopGrace) {
    // Otherwise its next stroke would run as soon as somebody recovers the controller.
    request(TaskRequest::Verb::kCancel, now);
    change(JobPhase::kAborted, PackState::kAborted, now, Reason::kSafetyStop, "stopped: " + stop_why_);
  }
}

void OrderDesk::on_task_status(const TaskStatus& status, const Now& now) {
  status_heard_ = now.cell;
  if (status.request_seq == task_.seq) request_pending_ = false;
  on_recovery_status(status);
  if (!active() || request_pending_) return;
  if (status.order_id != job_->order_id || status.order_rev != job_->order_rev) {
    change(JobPhase::kAborted, PackState::kAborted, now, Reason::kInternal,
           "the planner lost the order (it was restarted); nothing resumes by itself");
    return;
  }
  const JobState before = *job_;
  job_->discs_seen = status.discs_seen;
  job_->discs_singulated = status.discs_singulated;
  job_->hits = status.hits;
  job_->pushes = status.pushes;
  job_->min_gap = status.smallest_gap;
  job_->progress = status.discs_seen == 0 ? 0.0 : std::min(1.0, static_cast<double>(status.discs_singulated) / status.discs_seen);
  if (job_->started_utc_ns == 0) job_->started_utc_ns = now.utc_ns;

  PackState state = state_;
  switch (status.phase) {
    case TaskPhase::kSingulated: state = PackState::kComplete; break;
    case TaskPhase::kCancelled: state = state_ == PackState::kAborting ? PackState::kAborted : PackState::kStopped; break;
    case TaskPhase::kFailed: state = status.failure == TaskFailure::kControllerFault ? PackState::kAborted : PackState::kStopped; break;
    case TaskPhase::kPaused: state = PackState::kHeld; break;
    default:
      if (state_ == PackState::kStarting || state_ == PackState::kUnholding || state_ == PackState::kHeld) state = PackState::kExecute;
      break;
  }
  const JobPhase phase = job_phase(status.phase);
  std::string text = status.text;
  if (status.phase == TaskPhase::kFailed) text = fmt::format("{}: {}", to_string(status.failure), status.text);
  const bool news = before.discs_seen != job_->discs_seen || before.discs_singulated != job_->discs_singulated ||
                    before.hits != job_->hits || before.pushes != job_->pushes || before.phase != phase || state != state_ ||
                    before.text != text;
  if (news) change(phase, state, now, job_result(status), std::move(text));
}

void OrderDesk::tick(const Now& now) {
  tick_clearing(now);
  tick_stop(now);
  if (!active()) return;
  if (now.cell - status_heard_ > kPlannerSilent || (request_pending_ && now.cell - request_since_ > kPlannerSilent)) {
    request_pending_ = false;
    change(JobPhase::kAborted, PackState::kAborted, now, Reason::kInternal,
           fmt::format("the planner has not answered for {:.0f} s", to_seconds(kPlannerSilent)));
  }
}

std::optional<TaskRequest> OrderDesk::take_request(const Now& now) {
  if (!request_pending_ || now.cell - request_sent_ < kResendEvery) return std::nullopt;
  request_sent_ = now.cell;
  return task_;
}

Ack OrderDesk::reply(const Command& command, Verdict verdict, Reason reason, const std::string& text) const {
  Ack ack;
  ack.header.robot_id = limits_.robot_id;
  ack.command_id = command.command_id;
  ack.order_id = command.order_id;
  ack.order_rev = command.order_rev;
  ack.verdict = verdict;
  ack.reason = reason;
  ack.state = state_;
  ack.text = text.substr(0, kAckText);
  return ack;
}

void OrderDesk::request(TaskRequest::Verb verb, const Now& now) {
  task_.verb = verb;
  ++task_.seq;
  request_pending_ = true;
  request_since_ = now.cell;
  request_sent_ = now.cell - kResendEvery;  // take_request() hands it out at once
}

void OrderDesk::change(JobPhase phase, PackState state, const Now& now, Reason result, std::string text) {
  job_->phase = phase;
  job_->result = result;
  job_->text = std::move(text);
  ++job_->change_no;
  if (phase == JobPhase::kEnded || phase == JobPhase::kAborted) job_->ended_utc_ns = now.utc_ns;
  state_ = state;
}

void OrderDesk::remember(const Command& command, const Ack& ack) {
  answered_[command.command_id] = {command, ack};
  answered_order_.push_back(command.command_id);
  if (answered_order_.size() > kRemembered) {
    answered_.erase(answered_order_.front());
    answered_order_.pop_front();
  }
}

}  // namespace breakshot::mes
