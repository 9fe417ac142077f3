#include "perception/node/frame_intake.hpp"

#include <chrono>

namespace breakshot::perception {

const FramePair* FrameIntake::take(Duration timeout) {
  if (!colors_.take(pair_.color, timeout)) return nullptr;
  while (colors_.take(pair_.color)) {
  }
  // Numbers that start anew are a camera that did.
  if (last_seq_ && pair_.color.seq > *last_seq_) dropped_ += pair_.color.seq - *last_seq_ - 1;
  last_seq_ = pair_.color.seq;
  take_depth();
  return &pair_;
}

void FrameIntake::take_depth() {
  const auto deadline = std::chrono::steady_clock::now() + depth_wait_;
  const auto matches = [&] { return pair_.depth.seq == pair_.color.seq && pair_.depth.exposed == pair_.color.exposed; };
  // A depth frame that is newer than the colour frame stays: it belongs to the next one.
  while (!matches() && pair_.depth.exposed < pair_.color.exposed) {
    const Duration left = std::max(Duration::zero(), Duration{deadline - std::chrono::steady_clock::now()});
    if (!depths_.take(pair_.depth, left)) break;
  }
  pair_.has_depth = matches();
}

}  // namespace breakshot::perception
