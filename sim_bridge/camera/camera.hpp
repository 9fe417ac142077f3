#pragma once

#include "common/camera_model.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <cstdint>
#include <memory>
#include <span>

namespace breakshot::sim_bridge {

/// Renders what a fixed RGB-D camera over the table sees: colour and depth, perspective, lens, light and shadow, motion blur, noise and what stereo
/// gets wrong. docs/simulator.md lists the effects.
///
/// The table, the floor and the arm's base never change, so they are rendered once; a frame draws only the tiles that discs, moving links and
/// their shadows touch, and the sensor's noise over the whole image.
///
/// **Threads.** A camera belongs to no thread: each call makes its GL context current on the calling thread and releases it before it
/// returns. Calls must not overlap in time (a second thread inside render() gets a CameraError). Several cameras are independent.
///
/// **Repeatable.** The same snapshot (its stamp counts where light changes with time), frame number, settings and driver give the same bytes, whatever was rendered before.
class Camera {
 public:
  /// Starts GL, compiles the shaders and renders the background: 0.2 to 0.5 s.
  ///
  /// Sets the environment variable LP_NUM_THREADS to 0 unless it is set, so that software rendering stays on the calling thread; as with
  /// every setenv, construct the first camera before other threads read the environment.
  /// @param arm     its visuals are drawn; a description without links draws no arm
  /// @param X_WB    pose of the arm's base
  /// @throws CameraError when there is no usable EGL driver (says what to install), or a parameter is out of its range
  Camera(const CameraModel& model, const CameraSettings& settings, const ArmDescription& arm, const Pose& X_WB);
  ~Camera();
  Camera(Camera&&) noexcept;
  Camera& operator=(Camera&&) noexcept;

  /// Takes one picture.
  ///
  /// Discs that are not on the table are not drawn.
  /// @param frame   number of the frame: chooses the noise and the flaws of depth
  /// @param rgb     receives 3 * width * height bytes, row by row from the top left
  /// @param depth   receives width * height values along the optical axis in 0.1 mm, registered to the colour image; 0: no measurement
  /// @throws CameraError when X_WL does not have one pose per link of the arm, a colour index is not in the palette, a span has the wrong
  ///     size, another thread is rendering, or GL fails
  /// Cost: CPU time on one core at 1280 x 720: 8 ms for six discs, 15 to 27 ms while an arm is over the table, more when other processes
  /// load the machine's second core. No allocation of ours once the scene's size is steady.
  void render(const WorldSnapshot& snapshot, std::uint64_t frame, std::span<std::uint8_t> rgb, std::span<std::uint16_t> depth);

  /// Changes light and white balance, on which drift then builds, from the next frame on. @throws CameraError when out of range
  void set_exposure(const Exposure& exposure);

  /// Where the camera truly is: as calibrated, and then moved.
  const CameraModel& model() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace breakshot::sim_bridge
