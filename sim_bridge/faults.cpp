#include "sim_bridge/faults.hpp"

namespace breakshot::sim_bridge {

const char* to_string(Fault fault) noexcept {
  switch (fault) {
    case Fault::kCameraDark: return "camera_dark";
    case Fault::kCameraSilent: return "camera_silent";
    case Fault::kCameraFrozen: return "camera_frozen";
    case Fault::kCameraLate: return "camera_late";
    case Fault::kDrivesDeaf: return "drives_deaf";
    case Fault::kDrivesWeak: return "drives_weak";
    case Fault::kStatesSilent: return "states_silent";
    case Fault::kStatesFrozen: return "states_frozen";
    case Fault::kBlock: return "block";
    case Fault::kCameraMoved: return "camera_moved";
  }
  return "invalid";
}

std::optional<std::string> Faults::set(std::uint8_t fault, double value) {
  if (fault == 0 || fault >= kFaults) {
    return "fault " + std::to_string(fault) + " is unknown; allowed: 1 to " + std::to_string(kFaults - 1) + " (sim_bridge/faults.hpp)";
  }
  const Fault kind{fault};
  double most = 1e300;
  double least = -1e300;
  if (kind == Fault::kCameraDark || kind == Fault::kDrivesWeak) {
    least = 0.0;
    most = 1.0;
  }
  if (kind == Fault::kCameraLate) {
    least = 0.0;
    most = 2.0;
  }
  if (kind == Fault::kCameraMoved) {
    least = -0.1;
    most = 0.1;
  }
  if (!(value >= least && value <= most)) {
    return std::string{to_string(kind)} + ": value " + std::to_string(value) + "; allowed: " + std::to_string(least) + " to " +
           std::to_string(most);
  }
  values_[fault] = value;
  return std::nullopt;
}

}  // namespace breakshot::sim_bridge
