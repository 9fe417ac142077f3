#include "planner/task/stroke_link.hpp"

namespace breakshot::task {

const StrokeRequest& StrokeLink::begin(StrokeRequest stroke, Time now) {
  stroke.id = next_id_++;
  request_ = stroke;
  status_.reset();
  active_ = true;
  sent_ = heard_ = well_since_ = now;
  return request_;
}

bool StrokeLink::on_status(const StrokeStatus& status, Time now) {
  if (!active_ || status.id != request_.id) return false;
  heard_ = now;
  // Final is final: a status that was overtaken on the way changes nothing.
  if (status_ && is_final(status_->phase)) return false;
  const bool news = !status_ || status_->phase != status.phase;
  status_ = status;
  if (!waits()) well_since_ = now;
  return news;
}

StrokeLink::Need StrokeLink::check(Time now) {
  if (!active_) return Need::kNothing;
  if (waits()) {
    if (now - well_since_ > settings_.controller_silence) return Need::kGiveUp;
    if (now - sent_ < settings_.resend) return Need::kNothing;
    request_.id = next_id_++;  // the refused id is spent
    status_.reset();
    sent_ = now;
    return Need::kSend;
  }
  if (status_ && is_final(status_->phase)) return Need::kNothing;
  if (now - heard_ > settings_.controller_silence) return Need::kGiveUp;
  if (!status_ && now - sent_ >= settings_.resend) {
    sent_ = now;
    return Need::kSend;
  }
  return Need::kNothing;
}

}  // namespace breakshot::task
