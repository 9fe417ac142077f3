#pragma once

#include "common/camera_model.hpp"
#include "common/time.hpp"
#include "perception/arm_mask.hpp"
#include "perception/camera_check.hpp"
#include "perception/settings.hpp"

#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::perception {

/// Watches by the markers on the table whether the camera is where its calibration says.
///
/// What counts is by how much places of the table seem shifted, because that is what strokes would miss by. Where markers do not tell that well enough
/// (beyond the only one that the arm leaves in view) nothing is concluded. An alarm comes with the second frame in a row that shows it, and goes the same way.
class CameraWatch {
 public:
  /// @param arm  what hides markers; kept by reference
  CameraWatch(const CameraModel& camera, const CameraWatchSettings& settings, const ArmMask& arm);

  /// To be called for every good frame; looks at those that are due, and when asked to look `now`. @return the alarm while there is one, for people
  /// Cost of a look: about 2 ms.
  const std::optional<std::string>& on_frame(const cv::Mat3b& rgb, Time exposed, bool now);

  /// Looks at one frame by itself, for the markers near where they must be; `everywhere`: all over the image, which takes ten times as long.
  CameraCheck look(const cv::Mat3b& rgb, bool everywhere = false) const;

  /// Of the last look.
  const CameraCheck& last() const noexcept { return last_; }

 private:
  struct Watched {
    TableMarker marker;
    std::array<Vector2, 4> corners_W, corners_px;
    cv::Rect near;  // where it is looked for
  };
  struct Sighting {
    const Watched* watched;
    std::array<Vector2, 4> corners_px;
  };

  bool hidden(const Watched& watched) const noexcept;
  void find(const cv::Mat3b& rgb, const cv::Rect& where, std::vector<Sighting>& sightings) const;
  void judge(const std::vector<Sighting>& sightings, CameraCheck& check) const;

  CameraModel camera_;
  CameraWatchSettings settings_;
  const ArmMask& arm_;
  cv::Ptr<cv::aruco::Dictionary> dictionary_;
  cv::Ptr<cv::aruco::DetectorParameters> parameters_;
  std::vector<Watched> watched_;

  std::optional<Time> looked_;
  bool doubtful_ = false;  // the last look contradicts what is believed
  int unseen_ = 0;         // looks in a row that found no marker
  CameraCheck last_;
  std::optional<std::string> alarm_;
};

}  // namespace breakshot::perception
