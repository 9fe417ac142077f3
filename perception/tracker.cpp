#include "perception/tracker.hpp"

#include <algorithm>
#include <limits>

namespace breakshot::perception {
namespace {

constexpr Duration kForget = std::chrono::seconds{10};  // longer than any stroke hides a disc
constexpr double kSlack = 0.010;                        // m: a partial outline may jump when the rest of it comes into view

}  // namespace

Tracker::Tracker(const PerceptionSettings& settings) : settings_{settings} {}

void Tracker::update(Scene& scene) {
  std::erase_if(tracks_, [&](const Track& track) { return scene.exposed - track.seen > kForget; });

  // Nearest first, one to one, within reach of a disc of that colour. Between frames discs move less than they lie apart, save in a
  // break; there the colours keep most of them apart.
  matches_.clear();
  for (std::size_t t = 0; t < tracks_.size(); ++t) {
    const double elapsed = to_seconds(scene.exposed - tracks_[t].seen);
    const Vector2 expected = tracks_[t].p_WD + (tracks_[t].in_last_frame && continuous_ ? elapsed : 0.0) * tracks_[t].v_WD_W;
    const double reach = settings_.max_disc_speed * elapsed + kSlack;
    for (std::size_t d = 0; d < scene.discs.size(); ++d) {
      if (scene.discs[d].colour != tracks_[t].colour) continue;
      if ((scene.discs[d].p_WD - tracks_[t].p_WD).norm() > reach) continue;
      matches_.push_back({(scene.discs[d].p_WD - expected).norm(), t, d});
    }
  }
  std::sort(matches_.begin(), matches_.end(), [](const Match& a, const Match& b) { return a.distance < b.distance; });

  bool came_or_went = !continuous_;
  double fastest = 0.0;
  std::vector<bool> track_taken(tracks_.size(), false);
  std::vector<bool> disc_taken(scene.discs.size(), false);
  for (const Match& match : matches_) {
    if (track_taken[match.track] || disc_taken[match.disc]) continue;
    track_taken[match.track] = true;
    disc_taken[match.disc] = true;
    Track& track = tracks_[match.track];
    SceneDisc& disc = scene.discs[match.disc];
    disc.id = track.id;
    if (track.in_last_frame && continuous_) {
      disc.v_WD_W = (disc.p_WD - track.p_WD) / to_seconds(scene.exposed - track.seen);
      fastest = std::max(fastest, disc.v_WD_W.norm());
    } else {
      came_or_went = true;
    }
    track = {disc.id, disc.colour, disc.p_WD, disc.v_WD_W, scene.exposed, true};
  }
  for (std::size_t t = 0; t < track_taken.size(); ++t) {
    if (track_taken[t]) continue;
    came_or_went = came_or_went || tracks_[t].in_last_frame;
    tracks_[t].in_last_frame = false;
  }
  for (std::size_t d = 0; d < disc_taken.size(); ++d) {
    if (disc_taken[d]) continue;
    came_or_went = true;
    SceneDisc& disc = scene.discs[d];
    disc.id = next_id_++;
    tracks_.push_back({disc.id, disc.colour, disc.p_WD, Vector2::Zero(), scene.exposed, true});
  }
  scene.max_speed = came_or_went ? std::numeric_limits<double>::infinity() : fastest;
  continuous_ = true;
}

}  // namespace breakshot::perception
