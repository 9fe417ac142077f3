#include "planner/task/stroke_link.hpp"

namespace breakshot::task {

const StrokeRequest& StrokeLink::begin(StrokeRequest stroke, Time now) {
  stroke.id = next_id_++;
  request_ = stroke;
  status_.reset();
  active_ = true;
  sent_ = now;
  silent_ = unwell_ = Duration::zero();
  return request_;
}

bool StrokeLink::on_status(const StrokeStatus& status) {
  if (!active_ || status.id != request_.id) return false;
  silent_ = Duration::zero();
  // Final is final: a status that was overtaken on the way changes nothing.
  if (status_ && is_final(status_->phase)) return false;
  const bool news = !status_ || status_->phase != status.phase;
  status_ = status;
  if (!waits()) unwell_ = Duration::zero();
  return news;
}

StrokeLink::Need StrokeLink::check(Time now, Duration passed) {
  if (!active_) return Need::kNothing;
  silent_ += passed;
  unwell_ += passed;
  if (waits()) {
    if (unwell_ > settings_.controller_silence) return Need::kGiveUp;
    if (now - sent_ < settings_.resend) return Need::kNothing;
    request_.id = next_id_++;  // the refused id is spent
    status_.reset();
    sent_ = now;
    return Need::kSend;
  }
  if (status_ && is_final(status_->phase)) return Need::kNothing;
  if (silent_ > settings_.controller_silence) return Need::kGiveUp;
  if (!status_ && now - sent_ >= settings_.resend) {
    sent_ = now;
    return Need::kSend;
  }
  return Need::kNothing;
}

}  // namespace breakshot::task
