#pragma once

#include "common/camera_model.hpp"
#include "sim_bridge/camera/shadow.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <cstddef>
#include <span>

namespace breakshot::sim_bridge {

// What moves while the shutter is open. The stamp of a picture is the middle of its exposure.

/// Less than this over the whole exposure is no motion, px.
inline constexpr double kStillMotion = 0.25;

DiscState moved(DiscState disc, double seconds);
Pose moved(const Pose& X_WL, const LinkVelocity& velocity, double seconds);

/// How far a disc's picture moves within a time, px.
double motion_px(const DiscState& disc, double seconds, const CameraModel& camera);
/// The same for a solid of a link, at the faster of its ends.
double motion_px(const Capsule& capsule_W, const Pose& X_WL, const LinkVelocity& velocity, double seconds, const CameraModel& camera);

/// How many pictures are to be averaged for a motion: a multiple of the four places in a pixel, at most 16.
std::size_t samples_for(double motion_px);
/// When the `sample`-th of them is taken, in exposures from the stamp: evenly, symmetric about it.
double sample_time(std::size_t sample, std::size_t samples);

}  // namespace breakshot::sim_bridge
