#include "controller/loop/stroke_executor.hpp"

#include "controller/loop/event_text.hpp"
#include "controller/motion/join.hpp"

#include <algorithm>
#include <utility>

namespace breakshot::control {

using motion::Trajectory;
using safety::Action;

namespace {

/// One runs, one is to follow it, one may be on its way back.
constexpr std::size_t kBuffers = 3;
/// What planning and the way to the loop usually take at the most: planning some ms, a poll, a busy machine. Doubled when it was not enough.
constexpr Duration kPlanAhead = std::chrono::milliseconds{100};
/// A join from which there is no way: the next try is so much later, and so many are made.
constexpr std::size_t kJoinStep = 20;
constexpr int kJoinAttempts = 5;
/// A join so near to the running trajectory's end saves nothing, ticks.
constexpr std::size_t kLastJoin = 50;
/// How long a request waits for the loop to recover and for the arm to rest: a stop takes up to 0.3 s, giving way some tenths more.
constexpr Duration kMaxWait = std::chrono::seconds{2};
/// Resends come within seconds; a planner that restarts counts its ids from the start again and must not be taken for one.
constexpr Duration kRememberFor = std::chrono::seconds{5};
constexpr std::size_t kRememberMost = 16;
constexpr std::size_t kMaxText = 255;  // StrokeStatus::text

bool same(const StrokeRequest& a, const StrokeRequest& b) noexcept {
  return a.id == b.id && a.kind == b.kind && a.p_WS == b.p_WS && a.direction_W == b.direction_W && a.speed == b.speed &&
         a.run_in == b.run_in && a.length == b.length && a.park_after == b.park_after;
}

bool strikes(StrokeKind kind) noexcept { return kind == StrokeKind::kHit || kind == StrokeKind::kPush; }

}  // namespace

StrokeExecutor::StrokeExecutor(motion::StrokePlanner& planner, LoopChannels& channels) : planner_{planner}, channels_{channels} {
  for (std::size_t i = 0; i < kBuffers; ++i) {
    buffers_.push_back(std::make_unique<Trajectory>());
    free_.push_back(buffers_.back().get());
  }
}

void StrokeExecutor::submit(const StrokeRequest& request, Time now) {
  loop_ = channels_.status.latest();
  start_up();
  if (repeats(request, now)) return;
  if (!closed_.empty()) return refuse(request, RefusalReason::kNotReady, closed_, now);
  if (stage_ == Stage::kIdle && !following_) return begin(request, now);
  // An id of 0 is that of no stroke in what the loop tells.
  const bool known_apart = request.id != status_.id && request.id != 0;
  if (strikes(request.kind) && strikes(request_.kind) && stage_ != Stage::kIdle && !following_ && !next_ && known_apart) {
    following_.emplace(request);
    following_->plan_ahead = kPlanAhead;
    return wait_in_line(now);
  }
  if (request.kind != StrokeKind::kPark) {
    const std::string after = following_ ? " and stroke " + std::to_string(following_->status.id) + " is to follow" : "";
    return refuse(request, RefusalReason::kBusy,
                  "stroke " + std::to_string(status_.id) + " is under way" + after + "; wait for its final status", now);
  }
  if (next_) refuse(*next_, RefusalReason::kBusy, "another park request came after it", now);
  next_ = request;
  cancel("a park request came", now);
}

void StrokeExecutor::cancel(const std::string& why, Time now) {
  // What the loop has, it gives back or has begun already: its events will say.
  if (following_ && following_->trajectory == nullptr) refuse_following(RefusalReason::kStopped, why, now);
  if (stage_ == Stage::kWaiting) finish(StrokePhase::kRefused, RefusalReason::kNotReady, why, now);
  channels_.requests.push({.kind = LoopRequest::Kind::kStop});
}

void StrokeExecutor::close(const std::string& why, Time now) {
  closed_ = why;
  if (next_) refuse(*std::exchange(next_, std::nullopt), RefusalReason::kNotReady, why, now);
  cancel(why, now);
}

void StrokeExecutor::poll(Time now) {
  const Trajectory* returned = nullptr;
  while (channels_.returns.pop(returned)) {
    const auto owner = std::find_if(buffers_.begin(), buffers_.end(), [&](const auto& buffer) { return buffer.get() == returned; });
    if (owner != buffers_.end()) free_.push_back(owner->get());
  }
  LoopEvent event;
  while (channels_.events.pop(event)) {
    if (observer_) observer_(event);
    handle(event);
  }
  // After the events: the status is never older than what they tell.
  loop_ = channels_.status.latest();
  start_up();
  carry_on(now);
  if (stage_ == Stage::kIdle && next_ && !following_) begin(*std::exchange(next_, std::nullopt), now);
  if (stage_ == Stage::kWaiting) request_.kind == StrokeKind::kRecover ? wait_for_recovery(now) : wait_or_plan(now);
}

void StrokeExecutor::start_up() {
  if (started_up_) return;
  started_up_ = loop_.ready();
  if (!started_up_) ask_to_recover();
}

bool StrokeExecutor::next(StrokeStatus& out) {
  if (outbox_.empty()) return false;
  out = std::move(outbox_.front());
  outbox_.pop_front();
  return true;
}

void StrokeExecutor::begin(const StrokeRequest& request, Time now) {
  request_ = request;
  status_ = {};
  status_.id = request.id;
  if (stop_bars(request)) return finish(StrokePhase::kRefused, RefusalReason::kStopped, why_not_ready(), now);
  if (!loop_.fresh) {
    const bool recovery = request.kind == StrokeKind::kRecover;
    return finish(StrokePhase::kRefused, RefusalReason::kNotReady, recovery ? why_not_recovered() : why_not_ready(), now);
  }
  stage_ = Stage::kWaiting;
  wait_until_ = now + kMaxWait;
  recovery_sent_ = false;
  ended_ = {};
  details_.clear();
}

bool StrokeExecutor::stop_bars(const StrokeRequest& request) const noexcept {
  if (!loop_.stopped() || request.kind == StrokeKind::kRecover) return false;
  safety::CauseSet own;
  own.add(safety::Cause::kStopRequested, request.kind == StrokeKind::kPark);
  return !safety::lasting(loop_.causes).without(own).empty();
}

void StrokeExecutor::wait_or_plan(Time now) {
  if (stop_bars(request_)) return finish(StrokePhase::kRefused, RefusalReason::kStopped, why_not_ready(), now);
  if (loop_.ready()) return plan(now);
  if (now >= wait_until_) return finish(StrokePhase::kRefused, RefusalReason::kNotReady, why_not_ready(), now);
  ask_to_recover();
}

void StrokeExecutor::wait_for_recovery(Time now) {
  if (!loop_.stopped()) {
    return finish(StrokePhase::kDone, RefusalReason::kNone, ended_.empty() ? "nothing was stopped" : "ended: " + describe(ended_), now);
  }
  if (now >= wait_until_ || loop_.action == Action::kFault) {
    return finish(StrokePhase::kRefused, RefusalReason::kNotReady, why_not_recovered(), now);
  }
  ended_ = safety::lasting(loop_.causes);
  ask_to_recover();
}

void StrokeExecutor::ask_to_recover() {
  if (!loop_.stopped() || !loop_.at_rest || !loop_.in_the_way.empty() || recovery_sent_) return;
  recovery_sent_ = channels_.requests.push({.kind = LoopRequest::Kind::kRecover});
}

void StrokeExecutor::plan(Time now) {
  if (free_.empty()) return;  // the loop gives one back with the next tick
  Trajectory* buffer = free_.back();
  const int joints = planner_.kinematics().joints();
  const JointVector q_start = JointVector::Map(loop_.setpoint.q.data(), joints);
  const auto times = planner_.plan(request_, q_start, *buffer);
  if (!times) {
    status_.attainable = times.error().attainable;
    return finish(StrokePhase::kRefused, times.error().reason, times.error().text, now);
  }
  stage_ = Stage::kHanded;
  running_ = buffer;
  running_number_ = handed_ + 1;
  hand_over(status_, *times, {}, now);
  send(status_);
}

void StrokeExecutor::hand_over(StrokeStatus& status, const motion::StrokeTimes& times, LoopRequest::Join join, Time now) {
  Trajectory* const buffer = free_.back();
  free_.pop_back();
  status.phase = StrokePhase::kAccepted;
  status.planned_contact = times.contact;
  status.planned_total = times.total;
  status.stamp = now;
  if (times.singularity_margin > 0.0) status.text = "singularity margin " + std::to_string(times.singularity_margin) + " m/rad";
  ++handed_;
  if (trajectory_observer_) trajectory_observer_(handed_, *buffer);
  channels_.requests.push({.kind = LoopRequest::Kind::kStart, .trajectory = buffer, .trajectory_number = handed_, .join = join});
}

void StrokeExecutor::wait_in_line(Time now) {
  following_->status = {};
  following_->status.id = following_->request.id;
  following_->status.stamp = now;
  following_->status.text = "waits for stroke " + std::to_string(status_.id);
  following_->told = false;
}

void StrokeExecutor::carry_on(Time now) {
  if (!following_ || following_->trajectory != nullptr) return;
  if (next_) return refuse_following(RefusalReason::kStopped, "a park request came", now);
  if (stage_ == Stage::kIdle) {
    const StrokeRequest request = following_->request;
    following_.reset();
    return begin(request, now);
  }
  if (stop_bars(following_->request)) return refuse_following(RefusalReason::kStopped, why_not_ready(), now);
  if (stage_ == Stage::kHanded) plan_join(now);
  if (!following_ || std::exchange(following_->told, true)) return;
  outbox_.push_back(following_->status);  // not newest_: that is the stroke under way
}

void StrokeExecutor::plan_join(Time now) {
  Following& next = *following_;
  // Slowed down, not yet begun, or over: it will be, or there will be a rest to start from.
  if (loop_.joinable != running_number_ || next.attempts >= kJoinAttempts || free_.empty()) return;
  const auto ahead = static_cast<std::size_t>(std::max<std::int64_t>(loop_.cursor, 0) + next.plan_ahead / running_->tick);
  const auto join = find_join(std::max(ahead, next.not_before));
  if (!join) return;
  Trajectory* const buffer = free_.back();
  const auto times = planner_.plan(next.request, motion::state_at(*running_, *join), *buffer);
  if (!times) {
    // From wherever it starts: what is asked is wrong, or out of reach.
    if (times.error().reason != RefusalReason::kJointLimit) return refuse_following(times.error().reason, times.error().text, now);
    ++next.attempts;
    next.not_before = *join + kJoinStep;
    return;
  }
  next.trajectory = buffer;
  next.number = handed_ + 1;
  next.told = false;
  hand_over(next.status, *times, {running_number_, *join}, now);
}

std::optional<std::size_t> StrokeExecutor::find_join(std::size_t earliest) const noexcept {
  const std::size_t tick = std::max(earliest, motion::first_join(*running_));
  if (tick + kLastJoin >= running_->size) return std::nullopt;
  return tick;
}

void StrokeExecutor::take_over() {
  request_ = following_->request;
  status_ = std::move(following_->status);
  newest_ = status_;
  running_ = following_->trajectory;
  running_number_ = following_->number;
  following_.reset();
  stage_ = Stage::kHanded;
  details_.clear();
}

void StrokeExecutor::handle_following(const LoopEvent& event) {
  if (event.kind != LoopEvent::Kind::kNotStarted) return;
  // The place was passed before the loop had it: plan for one further on. Or the arm was slowed down or stopped, which carry_on() sees.
  following_->trajectory = nullptr;
  following_->plan_ahead *= 2;
  wait_in_line(event.time);
}

void StrokeExecutor::handle(const LoopEvent& event) {
  using Kind = LoopEvent::Kind;
  if (following_ && following_->trajectory != nullptr && event.stroke_id == following_->status.id) return handle_following(event);
  if (event.kind == Kind::kSafety && (event.violation || event.following.joint >= 0)) details_ = describe(event);
  // Asked again until the wait ends: it could not, or something stopped the arm anew.
  if (event.kind == Kind::kNotRecovered || event.kind == Kind::kRecovered) recovery_sent_ = false;
  if (stage_ != Stage::kHanded || event.stroke_id != status_.id) return;
  switch (event.kind) {
    case Kind::kPhase:
      status_.phase = event.phase;
      status_.stamp = event.time;
      return send(status_);
    case Kind::kContact: {
      kinematics::Jacobian J_W;
      const int joints = planner_.kinematics().joints();
      planner_.kinematics().tip_in_world(JointVector::Map(event.q.data(), joints), J_W);
      const Eigen::Matrix<double, 6, 1> V_WT = J_W * JointVector::Map(event.qd.data(), joints);
      status_.contact_speed = V_WT.head<2>().dot(request_.direction_W);
      status_.stamp = event.time;
      return send(status_);
    }
    case Kind::kDone:
      if (!event.joined) return finish(StrokePhase::kDone, RefusalReason::kNone, {}, event.time);
      finish(StrokePhase::kDone, RefusalReason::kNone, "went on to stroke " + std::to_string(following_->status.id) + " without a rest",
             event.time);
      return take_over();
    case Kind::kStopped:
      return finish(StrokePhase::kStopped, RefusalReason::kNone, details_.empty() ? describe(event.causes) : details_, event.time);
    case Kind::kNotStarted:
      // A state was late in that very tick, or a stop came in between: plan again from where the arm is then, as long as the wait allows.
      stage_ = Stage::kWaiting;
      return;
    case Kind::kRecovered:
    case Kind::kNotRecovered:
    case Kind::kSafety: return;
  }
}

bool StrokeExecutor::repeats(const StrokeRequest& request, Time now) {
  if (stage_ != Stage::kIdle && same(request, request_)) {
    // While it waits there is nothing to tell yet; its first status will be the answer to both.
    if (stage_ == Stage::kHanded) send(status_);
    return true;
  }
  if (following_ && same(request, following_->request)) {
    if (following_->told) outbox_.push_back(following_->status);
    return true;
  }
  if (next_ && same(request, *next_)) return true;
  const auto known = std::find_if(remembered_.rbegin(), remembered_.rend(),
                                  [&](const Remembered& past) { return same(request, past.request) && now - past.ended < kRememberFor; });
  if (known == remembered_.rend()) return false;
  outbox_.push_back(known->status);
  return true;
}

void StrokeExecutor::refuse(const StrokeRequest& request, RefusalReason reason, const std::string& text, Time now) {
  StrokeStatus status;
  status.id = request.id;
  status.phase = StrokePhase::kRefused;
  status.reason = reason;
  status.stamp = now;
  status.text = text.substr(0, kMaxText);
  outbox_.push_back(status);  // not newest_: the stroke under way is what the periodic status tells of
}

void StrokeExecutor::refuse_following(RefusalReason reason, const std::string& text, Time now) {
  refuse(following_->request, reason, text, now);
  following_.reset();
}

void StrokeExecutor::send(StrokeStatus status) {
  newest_ = status;
  outbox_.push_back(std::move(status));
}

void StrokeExecutor::finish(StrokePhase phase, RefusalReason reason, const std::string& text, Time now) {
  status_.phase = phase;
  status_.reason = reason;
  status_.stamp = now;
  status_.text = text.substr(0, kMaxText);
  stage_ = Stage::kIdle;
  remembered_.push_back({request_, status_, now});
  if (remembered_.size() > kRememberMost) remembered_.pop_front();
  send(status_);
  if (phase == StrokePhase::kStopped && following_) refuse_following(RefusalReason::kStopped, status_.text, now);
}

std::string StrokeExecutor::why_not_ready() const {
  if (loop_.action == Action::kFault) return describe(loop_.causes) + "; only a restart of the controller ends this";
  if (loop_.stopped()) return describe(loop_.causes) + "; nothing moves before a recovery (./breakshot recover)";
  if (!loop_.causes.empty()) return describe(loop_.causes);
  if (!loop_.fresh) return "no fresh joint state";
  if (!loop_.obeyed) return "the drives do not take this controller's commands";
  return "the arm is not at rest";
}

std::string StrokeExecutor::why_not_recovered() const {
  if (loop_.action == Action::kFault) return why_not_ready();
  if (!loop_.in_the_way.empty()) return "in the way: " + describe(loop_.in_the_way);
  if (!loop_.fresh) return "in the way: no fresh joint state";
  if (!loop_.at_rest) return "in the way: the arm is not at rest";
  return "in the way: the arm does not rest where it is told to";
}

}  // namespace breakshot::control
