#include "controller/loop/stroke_executor.hpp"

#include "controller/loop/event_text.hpp"

#include <algorithm>
#include <utility>

namespace breakshot::control {

using motion::Trajectory;
using safety::Action;

namespace {

/// One runs, one may be on its way back.
constexpr std::size_t kBuffers = 2;
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
  if (stage_ == Stage::kIdle) return begin(request, now);
  if (request.kind != StrokeKind::kPark) {
    return refuse(request, RefusalReason::kBusy, "stroke " + std::to_string(status_.id) + " is under way; wait for its final status", now);
  }
  if (next_) refuse(*next_, RefusalReason::kBusy, "another park request came after it", now);
  next_ = request;
  cancel("a park request came", now);
}

void StrokeExecutor::cancel(const std::string& why, Time now) {
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
  if (stage_ == Stage::kIdle && next_) begin(*std::exchange(next_, std::nullopt), now);
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
  buffer->stroke_id = request_.id;
  free_.pop_back();
  status_.phase = StrokePhase::kAccepted;
  status_.planned_contact = times->contact;
  status_.planned_total = times->total;
  status_.stamp = now;
  if (times->singularity_margin > 0.0) status_.text = "singularity margin " + std::to_string(times->singularity_margin) + " m/rad";
  stage_ = Stage::kHanded;
  send(status_);
  ++handed_;
  if (trajectory_observer_) trajectory_observer_(handed_, *buffer);
  channels_.requests.push({.kind = LoopRequest::Kind::kStart, .trajectory = buffer, .trajectory_number = handed_});
}

void StrokeExecutor::handle(const LoopEvent& event) {
  using Kind = LoopEvent::Kind;
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
    case Kind::kDone: return finish(StrokePhase::kDone, RefusalReason::kNone, {}, event.time);
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
