#include "perception/node/perception_node.hpp"

#include "common/config/camera_file.hpp"
#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/process/health_publisher.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/kinematics/arm_kinematics.hpp"
#include "perception/camera_match.hpp"
#include "perception/image_check.hpp"
#include "perception/joint_history.hpp"
#include "perception/node/frame_intake.hpp"
#include "perception/perceiver.hpp"
#include "perception/perception_config.hpp"

#include <fmt/core.h>
#include <spdlog/spdlog.h>
#include <opencv2/core/utility.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <numbers>
#include <span>
#include <string>
#include <vector>

namespace breakshot::perception {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr Duration kLongestNap = std::chrono::milliseconds{20};

/// What the health thread tells of the frames: written by the one thread, read by the other.
class FrameFigures {
 public:
  struct Summary {
    std::uint64_t frames = 0;
    double hz = 0.0, p99_us = 0.0, max_us = 0.0;  // over the last frames that the buffer holds
    double age_ms = 0.0;                          // from exposure to the scene of the newest frame
    SceneQuality quality = SceneQuality::kOk;
    std::string text, foreign;
    std::size_t discs = 0;
    CameraCheck camera;
    Time arrived{};
  };

  explicit FrameFigures(Time started) { summary_.arrived = started; }

  void add(const Scene& scene, const CameraCheck& camera, Time arrived, Duration compute, double age_ms) {
    const std::lock_guard lock{mutex_};
    entries_[summary_.frames % entries_.size()] = {arrived, 1e6 * to_seconds(compute)};
    ++summary_.frames;
    summary_.quality = scene.quality;
    summary_.text = scene.text;
    summary_.foreign = scene.foreign.empty() ? std::string{} : describe(scene.foreign.front());
    summary_.discs = scene.discs.size();
    summary_.camera = camera;
    summary_.age_ms = age_ms;
    summary_.arrived = arrived;
  }

  Summary summary() const {
    const std::lock_guard lock{mutex_};
    Summary s = summary_;
    const auto held = static_cast<std::size_t>(std::min<std::uint64_t>(s.frames, entries_.size()));
    if (held < 2) return s;
    std::array<double, kEntries> us{};
    Time oldest = s.arrived;
    for (std::size_t i = 0; i < held; ++i) {
      us[i] = entries_[i].compute_us;
      oldest = std::min(oldest, entries_[i].arrived);
    }
    std::sort(us.begin(), us.begin() + static_cast<std::ptrdiff_t>(held));
    s.max_us = us[held - 1];
    s.p99_us = us[(held - 1) * 99 / 100];
    s.hz = static_cast<double>(held - 1) / std::max(1e-3, to_seconds(s.arrived - oldest));
    return s;
  }

 private:
  static constexpr std::size_t kEntries = 128;
  struct Entry {
    Time arrived{};
    double compute_us = 0.0;
  };
  mutable std::mutex mutex_;
  std::array<Entry, kEntries> entries_{};
  Summary summary_;
};

class PerceptionNode {
 public:
  PerceptionNode(process::Process& process, const PerceptionConfig& config, const CameraModel& camera, const ArmDescription& arm)
      : process_{process},
        config_{config},
        kinematics_{arm, process.cell().arm.X_WB},
        perceiver_{config.settings, camera, arm, process.cell().arm.X_WB},
        participant_{process.cell().dds.cell, "breakshot-perception"},
        intake_{participant_, config.depth_wait} {}

  void run() {
    const process::HealthPublisher health{process_, participant_, [this](Health& h) { return report(h); }};
    process_.ready("waits for frames on cell/color");
    while (!process_.stop_requested()) {
      ++cycles_;
      check_camera();
      const FramePair* frames = intake_.take(kLongestNap);
      if (frames != nullptr) handle(*frames);
    }
    const auto s = figures_.summary();
    spdlog::info("code=stopped frames={} dropped={} compute_p99_us={:.0f}", s.frames, intake_.dropped(), s.p99_us);
  }

 private:
  void check_camera() {
    CameraModel announced;
    while (infos_.take(announced)) {
      if (const auto what = camera_mismatch(perceiver_.camera(), announced)) {
        throw process::ProcessError(fmt::format("cell/camera_info: {} ({}); calibrate again or give the camera its own file", *what,
                                                process_.cell().camera_file.string()));
      }
      verified_ = true;
    }
  }

  void handle(const FramePair& frames) {
    const Time start = process::monotonic_now();
    process_.clock().observe(frames.color.exposed);
    // In lockstep mode stamps are not of the monotonic clock, and the age of a frame is no time that anybody waited.
    const bool real_time = process_.cell().mode == CellMode::kRealTime;
    const auto too_old = real_time ? stale(frames.color, start, config_.stale_limit) : std::nullopt;
    Scene scene = too_old ? perceiver_.refuse(frames.color, *too_old)
                          : perceiver_.process(frames.color, frames.has_depth ? &frames.depth : nullptr, links_at(frames.color.exposed));
    if (real_time) scene.age = process::monotonic_now() - frames.color.exposed;
    scenes_.write(scene);
    const Time end = process::monotonic_now();
    figures_.add(scene, perceiver_.camera_check(), end, end - start, 1e3 * to_seconds(scene.age));
    if (scene.quality != quality_) tell_change(scene);
  }

  void tell_change(const Scene& scene) {
    const CameraCheck& camera = perceiver_.camera_check();
    const bool was_misplaced = std::exchange(quality_, scene.quality) == SceneQuality::kMisplaced;
    if (quality_ == SceneQuality::kMisplaced) {
      spdlog::error("code=camera_moved shift_mm={:.2f} moved_mm={:.2f} turned_deg={:.3f} markers={}/{} {}", 1e3 * camera.shift,
                    1e3 * camera.moved, kDegrees * camera.turned, camera.seen, camera.expected, scene.text);
    } else if (quality_ != SceneQuality::kOk) {
      spdlog::warn("code=image quality=\"{}\" text=\"{}\"", to_string(quality_), scene.text);
    } else if (was_misplaced) {
      spdlog::info("code=camera_back shift_mm={:.2f} markers={}/{}", 1e3 * camera.shift, camera.seen, camera.expected);
    } else {
      spdlog::info("code=image quality=ok frame={}", scene.frame_seq);
    }
  }

  // Poses of the arm's links at the exposure of a frame; nothing when no joint states came.
  std::span<const Pose> links_at(Time exposed) {
    const auto q = joints_.at(exposed);
    const bool known = q && q->size() == kinematics_.joints();
    if (arm_known_.exchange(known) != known) spdlog::info("code=arm known_by={}", known ? "joints" : "depth");
    if (!known) return {};
    X_WL_.resize(static_cast<std::size_t>(kinematics_.joints()));
    (void)kinematics_.links_in_world(*q, X_WL_);
    return X_WL_;
  }

  static std::string in_place(const CameraCheck& camera) {
    if (camera.verdict != CameraCheck::Verdict::kInPlace) return {};
    return fmt::format("; the camera is in place to {:.2f} mm ({} markers)", 1e3 * camera.shift, camera.seen);
  }

  bool report(Health& h) {
    const auto s = figures_.summary();
    const double silence = to_seconds(process::monotonic_now() - s.arrived);
    h.cycles = s.frames;
    h.loop_hz = s.hz;
    h.compute.p99_us = s.p99_us;
    h.compute.max_us = s.max_us;
    h.dropped = intake_.dropped();
    h.state = HealthState::kDegraded;
    if (silence > to_seconds(config_.silence_limit)) {
      h.loop_hz = 0.0;
      h.text = fmt::format("no camera frames on cell/color for {:.0f} s", silence);
    } else if (s.quality != SceneQuality::kOk) {
      h.text = fmt::format("{} image: {}", to_string(s.quality), s.text).substr(0, 255);
    } else if (!s.foreign.empty()) {
      h.text = fmt::format("foreign on the table: {}", s.foreign).substr(0, 255);
    } else if (s.frames > 0 && !verified_) {
      h.text = "the camera's calibration is not confirmed: nothing on cell/camera_info yet";
    } else {
      h.state = HealthState::kReady;
      h.text = s.frames == 0 ? "waits for the first frame on cell/color"
                             : fmt::format("sees {} discs; {:.1f} ms a frame at the most, scenes {:.0f} ms after exposure{}{}", s.discs,
                                           1e-3 * s.max_us, s.age_ms, in_place(s.camera),
                                           arm_known_ ? "" : "; no joint states: the arm is known by depth only");
    }
    const std::uint64_t cycles = cycles_;
    return std::exchange(reported_cycles_, cycles) != cycles;
  }

  process::Process& process_;
  const PerceptionConfig& config_;
  kinematics::ArmKinematics kinematics_;
  Perceiver perceiver_;
  dds::Participant participant_;
  FrameIntake intake_;
  dds::Reader<CameraModel> infos_{participant_};
  JointHistory joints_;
  dds::Subscription<JointState> joint_states_{participant_, [this](JointState&& state) { joints_.add(state); }};
  std::vector<Pose> X_WL_;
  dds::Writer<Scene> scenes_{participant_};
  FrameFigures figures_{process::monotonic_now()};
  std::atomic<std::uint64_t> cycles_{0};
  std::uint64_t reported_cycles_ = 0;
  std::atomic<bool> verified_{false}, arm_known_{false};
  SceneQuality quality_ = SceneQuality::kOk;
};

}  // namespace

void run_perception(process::Process& process) {
  const PerceptionConfig config = load_perception_config(process.config(), process.cell());
  const CameraModel camera = load_camera(process.cell().camera_file);
  // A frame takes a few milliseconds on one core; OpenCV's pool would only take the cores of the controller and the simulator.
  cv::setNumThreads(1);
  PerceptionNode{process, config, camera, load_cell_arm(process.cell())}.run();
}

}  // namespace breakshot::perception
