#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace breakshot::sim_bridge {

/// What can be broken on purpose, by SimControl{kSetFault, fault, fault_value} on `sim/control`. The numbers are on the wire: never reuse one.
/// Several may be set at a time; each lasts until kClearFaults.
enum class Fault : std::uint8_t {
  kCameraDark = 1,    ///< hardly any light: value is the share that is left, 0 to 1
  kCameraSilent = 2,  ///< no frames (value is not used)
  kCameraFrozen = 3,  ///< the last picture again and again, under new numbers and stamps (value is not used)
  kCameraLate = 4,    ///< frames come later by value, 0 to 2 s
  kDrivesDeaf = 5,    ///< commands do not reach the drives, which brake by themselves (value is not used)
  kDrivesWeak = 6,    ///< the drives give only this share of their torque: value, 0 to 1
  kStatesSilent =
      7,  ///< no joint states (value is not used). In lockstep mode the world then goes on at wall speed without waiting for commands
  kStatesFrozen = 8,  ///< the last joint state again and again (value is not used); lockstep as with kStatesSilent
  kBlock = 9,  ///< an upright post stands on the table: SimControl::discs has one entry that says where and how big (value is not used)
  kCameraMoved = 10,  ///< somebody has knocked the camera: it stands value aside, along x of W, -0.1 to 0.1 m
};

/// "camera_dark", ...; "invalid" for a number that is no fault.
const char* to_string(Fault fault) noexcept;

/// The faults that are set.
class Faults {
 public:
  /// Sets a fault from its number on the wire. @return what is wrong with number or value, or nothing
  std::optional<std::string> set(std::uint8_t fault, double value);
  void clear() noexcept { values_.fill(std::nullopt); }

  bool has(Fault fault) const noexcept { return get(fault).has_value(); }
  std::optional<double> get(Fault fault) const noexcept { return values_[static_cast<std::size_t>(fault)]; }
  /// True when joint states do not reach the controller as they should, so that its commands cannot be waited for.
  bool states_broken() const noexcept { return has(Fault::kStatesSilent) || has(Fault::kStatesFrozen); }

 private:
  static constexpr std::size_t kFaults = 11;
  std::array<std::optional<double>, kFaults> values_;
};

}  // namespace breakshot::sim_bridge
