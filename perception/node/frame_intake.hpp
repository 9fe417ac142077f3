#pragma once

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/frames.hpp"

#include <atomic>
#include <cstdint>
#include <optional>

namespace breakshot::perception {

/// A colour frame, and the depth frame of the same number when it came in time.
struct FramePair {
  ColorFrame color;
  DepthFrame depth;
  bool has_depth = false;
};

/// Takes frames from DDS: always the newest colour frame, with its depth frame. Buffers are kept from frame to frame.
class FrameIntake {
 public:
  /// @param depth_wait  how long a colour frame waits for its depth frame
  FrameIntake(dds::Participant& participant, Duration depth_wait) : depth_wait_{depth_wait}, colors_{participant}, depths_{participant} {}

  /// Waits at most `timeout` for a colour frame. @return null when none came; valid until the next call
  const FramePair* take(Duration timeout);

  /// Colour frames that were sent and not processed, by the gaps in their numbers. Readable from any thread.
  std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  void take_depth();

  Duration depth_wait_;
  dds::Reader<ColorFrame> colors_;
  dds::Reader<DepthFrame> depths_;
  FramePair pair_;
  std::optional<std::uint64_t> last_seq_;
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace breakshot::perception
