#include "perception/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace breakshot::perception {
namespace {

constexpr Duration kForget = std::chrono::seconds{10};  // longer than any stroke hides a disc
constexpr double kSlack = 0.010;                        // m: a partial outline may jump when the rest of it comes into view

constexpr double kNoise =
    8e-6;  // m: of a place from frame to frame, before it has been learnt; the cell's camera has half of it (perception_rendered_test)
constexpr double kLeastNoise = 3e-6, kMostNoise = 80e-6;
constexpr double kHardlyMoved = 150e-6;  // m from frame to frame: further is motion, and teaches nothing about noise
constexpr double kLearnt = 1.0 / 64.0;   // share of one displacement in what is believed of the noise
constexpr double kTwoAxes95 = 2.4477;    // 95 % of a normal distribution of two axes lie within so many standard deviations

}  // namespace

Tracker::Tracker(const PerceptionSettings& settings) : settings_{settings}, noise2_{kNoise * kNoise} {}

void Tracker::remember(Track& track, bool follows) noexcept {
  if (!follows) track.held = 0;
  std::shift_right(track.places.begin(), track.places.end(), 1);
  track.places[0] = {track.seen, track.p_WD};
  track.held = std::min(track.held + 1, kPlaces);
}

// A displacement is the difference of two places along two axes.
void Tracker::learn_noise(double moved) noexcept {
  noise2_ += kLearnt * (moved * moved / 4.0 - noise2_);
  noise2_ = std::clamp(noise2_, kLeastNoise * kLeastNoise, kMostNoise * kMostNoise);
}

bool Tracker::rests(const Track& track) const noexcept {
  double t_sum = 0.0, tt_sum = 0.0;
  Vector2 p_sum = Vector2::Zero(), tp_sum = Vector2::Zero();
  for (std::size_t k = 0; k < track.held; ++k) {
    const double t = to_seconds(track.places[k].seen - track.seen);
    const Vector2 p = track.places[k].p_WD - track.p_WD;
    t_sum += t;
    tt_sum += t * t;
    p_sum += p;
    tp_sum += t * p;
    if (k == 0) continue;
    const double n = static_cast<double>(k + 1);
    const double spread = tt_sum - t_sum * t_sum / n;  // of the times
    const Vector2 slope = (tp_sum - t_sum * p_sum / n) / spread;
    if (slope.norm() + kTwoAxes95 * std::sqrt(noise2_ / spread) < kRestSpeed) return true;
  }
  return false;
}

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
  bool all_rest = true;
  std::vector<bool> track_taken(tracks_.size(), false);
  std::vector<bool> disc_taken(scene.discs.size(), false);
  for (const Match& match : matches_) {
    if (track_taken[match.track] || disc_taken[match.disc]) continue;
    track_taken[match.track] = true;
    disc_taken[match.disc] = true;
    Track& track = tracks_[match.track];
    SceneDisc& disc = scene.discs[match.disc];
    disc.id = track.id;
    const bool follows = track.in_last_frame && continuous_;
    if (follows) {
      disc.v_WD_W = (disc.p_WD - track.p_WD) / to_seconds(scene.exposed - track.seen);
      fastest = std::max(fastest, disc.v_WD_W.norm());
    } else {
      came_or_went = true;
    }
    if (const double moved = (disc.p_WD - track.p_WD).norm(); follows && moved < kHardlyMoved) learn_noise(moved);
    track.p_WD = disc.p_WD;
    track.v_WD_W = disc.v_WD_W;
    track.seen = scene.exposed;
    track.in_last_frame = true;
    remember(track, follows);
    all_rest = all_rest && rests(track);
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
    tracks_.push_back({disc.id, disc.colour, disc.p_WD, Vector2::Zero(), scene.exposed, true, {}, 0});
    remember(tracks_.back(), false);
  }
  scene.at_rest = all_rest && !came_or_went;
  scene.max_speed = came_or_went ? std::numeric_limits<double>::infinity() : fastest;
  continuous_ = true;
}

}  // namespace breakshot::perception
