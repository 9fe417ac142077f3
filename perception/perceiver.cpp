#include "perception/perceiver.hpp"

#include "perception/arm_mask.hpp"
#include "perception/camera_watch.hpp"
#include "perception/disc_fit.hpp"
#include "perception/foreign_objects.hpp"
#include "perception/hue_check.hpp"
#include "perception/image_check.hpp"
#include "perception/outline_guess.hpp"
#include "perception/paper_contours.hpp"
#include "perception/segmentation.hpp"
#include "perception/table_light.hpp"
#include "perception/tracker.hpp"
#include "perception/view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace breakshot::perception {
namespace {

void check(bool ok, const std::string& what) {
  if (!ok) throw std::invalid_argument("perception: " + what);
}

void validate(const PerceptionSettings& s, const CameraModel& camera) {
  check(!s.colours.empty() && s.colours.size() <= 250, "found " + std::to_string(s.colours.size()) + " disc colours; allowed 1 to 250");
  check(s.disc_height >= 0.0, "disc_height must not be negative");
  check(0.0 < s.radius_min && s.radius_min < s.radius_max, "radius_min must be positive and below radius_max");
  check(s.arm_margin >= 0.0, "arm_margin must not be negative");
  check(s.morphology_px >= 1 && s.morphology_px % 2 == 1, "morphology_px must be odd");
  check(s.paper.thickness_px >= 1 && s.paper.thickness_px % 2 == 1, "paper.thickness_px must be odd");
  check(camera.width >= 64 && camera.height >= 64 && camera.fx > 0.0 && camera.fy > 0.0, "the camera model is not set");
  check(camera.X_WC.translation().z() > s.disc_height + 0.05, "the camera must be at least 50 mm above the discs");
}

// P(gap < touch_gap) for a normal error of the fitted gap.
double touch_probability(double gap, double sigma, double touch_gap) noexcept {
  return 0.5 * std::erfc((gap - touch_gap) / (std::numbers::sqrt2 * std::max(sigma, 1e-9)));
}

// Variance of the gap between two fitted circles, m^2. Centre and radius of one circle are correlated when only an arc of it was seen.
double gap_variance(const DiscFit& a, const DiscFit& b, double common_sigma) noexcept {
  const Vector2 n_AB = (b.p_WD - a.p_WD).normalized();
  const Vector3 from_a{-n_AB.x(), -n_AB.y(), -1.0};
  const Vector3 from_b{n_AB.x(), n_AB.y(), -1.0};
  // What all edges share shifts both radii alike: the covariances hold it as if it were independent.
  return from_a.dot(a.covariance * from_a) + from_b.dot(b.covariance * from_b) + 2.0 * common_sigma * common_sigma;
}

double gap_between(const DiscFit& a, const DiscFit& b) noexcept { return (a.p_WD - b.p_WD).norm() - a.radius - b.radius; }

}  // namespace

class Perceiver::Impl {
 public:
  Impl(const PerceptionSettings& settings, const CameraModel& camera, const ArmDescription& arm, const Pose& X_WB)
      : settings_{settings},
        view_{camera, settings.disc_height},
        arm_{camera, arm, X_WB, settings.arm_margin},
        watch_{camera, settings_.watch, arm_},
        image_check_{camera.width, camera.height, settings.dark_level},
        meter_{settings.table_rgb},
        segmenter_{settings_},
        guesser_{view_, settings_, arm_},
        fitter_{view_, settings_, segmenter_, arm_},
        contours_{view_, settings_},
        foreign_{view_, settings_, arm_},
        tracker_{settings_},
        has_arm_{!arm.links.empty()} {
    // The smallest patch worth a look: half of the smallest disc's top face, the rest behind the arm.
    const double pixels_per_metre = camera.fx / (camera.X_WC.translation().z() - settings.disc_height);
    const double radius_px = settings.radius_min * pixels_per_metre;
    min_area_px_ = static_cast<int>(0.5 * std::numbers::pi * radius_px * radius_px);
  }

  Scene process(const ColorFrame& color, const DepthFrame* depth, std::span<const Pose> X_WL) {
    arm_.place(X_WL);
    Scene scene;
    scene.seq = ++scenes_;
    scene.frame_seq = color.seq;
    scene.exposed = color.exposed;
    if (const auto fault = image_check_.check(color)) return refused(scene, *fault);
    if (depth != nullptr) {
      if (const auto fault = depth_fault(*depth, color)) {
        scene.text = *fault + "; went on without depth";
        depth = nullptr;
      }
    }
    std::string why;
    const auto light = settings_.method == Method::kRobust ? meter_.measure(color, why) : std::optional{TableLight{}};
    const std::string who = "colour frame " + std::to_string(color.seq) + ": ";
    if (!light) return refused(scene, {SceneQuality::kBadImage, who + why});
    // OpenCV has no header over constant pixels; nothing here writes to it.
    const cv::Mat3b rgb(color.height, color.width, reinterpret_cast<cv::Vec3b*>(const_cast<std::uint8_t*>(color.rgb.data())));
    const auto& regions = segmenter_.segment(rgb, *light, min_area_px_);
    if (settings_.method == Method::kRobust) {
      fitter_.adapt(*light);
      fit_discs(rgb, depth, regions);
      if (!X_WL.empty() || depth != nullptr) drop_doubtful();
    } else {
      fits_ = paper_discs(view_, settings_, regions);
    }
    order_fits();
    if (settings_.method == Method::kRobust && mirrored_hues(rgb, *light, settings_.colours, view_, fits_)) {
      const char* what = "found the discs' hues mirrored about green: red and blue look swapped";
      return refused(scene, {SceneQuality::kBadImage, who + what});
    }
    if (settings_.method == Method::kRobust) {
      using enum ForeignObjects::ArmKnown;
      scene.foreign = foreign_.find(regions, fits_, depth, !X_WL.empty() || !has_arm_ ? kYes : kNo);
    }
    add_discs(scene);
    add_contacts(scene, regions);
    tracker_.update(scene);
    watch_camera(rgb, scene);
    return scene;
  }

  Scene refuse(const ColorFrame& color, const std::string& why) {
    Scene scene;
    scene.seq = ++scenes_;
    scene.frame_seq = color.seq;
    scene.exposed = color.exposed;
    return refused(scene, {SceneQuality::kBadImage, why});
  }

  const CameraModel& camera() const noexcept { return view_.camera; }
  const CameraCheck& camera_check() const noexcept { return watch_.last(); }

 private:
  // Beside its period, whenever things come to rest: that is what somebody decides on. (A camera that is knocked sets all discs moving.)
  void watch_camera(const cv::Mat3b& rgb, Scene& scene) {
    constexpr double kMoving = 0.01, kSlow = 0.05;  // m/s
    const bool came_to_rest = std::exchange(last_speed_, scene.max_speed) >= kMoving && scene.max_speed < kSlow;
    const auto& alarm = watch_.on_frame(rgb, scene.exposed, came_to_rest);
    if (!alarm) return;
    // Places that come from a wrong pose look right and are not: better none.
    scene.quality = SceneQuality::kMisplaced;
    scene.text = *alarm;
    scene.discs.clear();
    scene.contacts.clear();
    scene.foreign.clear();
    scene.at_rest = false;
    scene.max_speed = std::numeric_limits<double>::infinity();
  }

  // What a bad frame makes of a scene.
  Scene refused(Scene scene, const ImageFault& fault) {
    scene.quality = fault.quality;
    scene.text = fault.text;
    scene.max_speed = std::numeric_limits<double>::infinity();
    tracker_.interrupt();
    return scene;
  }

  // Twice: the second time each disc knows its neighbours' fits, not guesses, and which guesses were no discs at all.
  void fit_discs(const cv::Mat3b& rgb, const DepthFrame* depth, const std::vector<Region>& regions) {
    guesses_ = guesser_.guess(regions);
    for (int round = 0; round < 2; ++round) {
      fits_.clear();
      for (std::size_t i = 0; i < guesses_.size(); ++i) {
        if (const auto fit = fitter_.fit(rgb, depth, guesses_[i], guesses_, i, round > 0)) fits_.push_back(*fit);
      }
      drop_overlapping();
      guesses_.clear();
      for (const DiscFit& fit : fits_) guesses_.push_back({fit.p_WD, fit.radius, fit.colour, fit.region});
    }
  }

  // Discs stand on one table: two circles that overlap by more than their errors are one disc seen twice. The better seen one stays.
  void drop_overlapping() {
    constexpr double kOverlap = 3e-3;  // m
    std::stable_sort(fits_.begin(), fits_.end(), [](const DiscFit& a, const DiscFit& b) { return a.seen_share > b.seen_share; });
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      const auto later = fits_.begin() + static_cast<std::ptrdiff_t>(i) + 1;
      fits_.erase(std::remove_if(later, fits_.end(), [&](const DiscFit& other) { return gap_between(fits_[i], other) < -kOverlap; }),
                  fits_.end());
    }
  }

  // What hides discs is known, and a good part of this outline is missing all the same: a round end of something else.
  void drop_doubtful() {
    constexpr double kMissing = 0.35;
    std::erase_if(fits_, [](const DiscFit& fit) { return fit.missing_share > kMissing; });
  }

  void order_fits() {
    if (fits_.size() > kMaxSceneDiscs) fits_.resize(kMaxSceneDiscs);
    // By colour, then from left to right: an order that does not hang on how much of each disc was seen.
    std::sort(fits_.begin(), fits_.end(),
              [](const DiscFit& a, const DiscFit& b) { return a.colour != b.colour ? a.colour < b.colour : a.p_WD.x() < b.p_WD.x(); });
  }

  void add_discs(Scene& scene) const {
    for (const DiscFit& fit : fits_) {
      SceneDisc disc;
      disc.p_WD = fit.p_WD;
      disc.covariance = fit.covariance.topLeftCorner<2, 2>();
      disc.radius = fit.radius;
      disc.radius_sigma = std::sqrt(fit.covariance(2, 2));
      disc.colour = fit.colour;
      disc.complete = fit.complete;
      scene.discs.push_back(disc);
    }
  }

  void add_contacts(Scene& scene, const std::vector<Region>& regions) {
    for (const ContourContact& found : contours_.find(regions, fits_)) {
      if (scene.contacts.size() == kMaxSceneContacts) break;
      const DiscFit& a = fits_[found.a];
      const DiscFit& b = fits_[found.b];
      SceneContact contact;
      contact.a = static_cast<std::uint16_t>(found.a);
      contact.b = static_cast<std::uint16_t>(found.b);
      contact.gap = gap_between(a, b);
      contact.p_touch =
          settings_.method == Method::kPaper
              ? 1.0
              : touch_probability(contact.gap, std::sqrt(gap_variance(a, b, settings_.edge_common_sigma)), settings_.touch_gap);
      contact.push_start_W = found.push_start_W;
      contact.push_direction_W = found.push_direction_W;
      contact.contour_length = found.contour_length;
      scene.contacts.push_back(contact);
    }
  }

  PerceptionSettings settings_;
  View view_;
  ArmMask arm_;
  CameraWatch watch_;
  ImageCheck image_check_;
  LightMeter meter_;
  Segmenter segmenter_;
  OutlineGuesser guesser_;
  DiscFitter fitter_;
  PaperContours contours_;
  ForeignObjects foreign_;
  Tracker tracker_;
  bool has_arm_;
  int min_area_px_ = 0;
  double last_speed_ = 0.0;  // Scene::max_speed of the frame before
  std::uint64_t scenes_ = 0;
  std::vector<CircleGuess> guesses_;
  std::vector<DiscFit> fits_;
};

Perceiver::Perceiver(const PerceptionSettings& settings, const CameraModel& camera, const ArmDescription& arm, const Pose& X_WB) {
  validate(settings, camera);
  impl_ = std::make_unique<Impl>(settings, camera, arm, X_WB);
}
Perceiver::~Perceiver() = default;
Perceiver::Perceiver(Perceiver&&) noexcept = default;
Perceiver& Perceiver::operator=(Perceiver&&) noexcept = default;

Scene Perceiver::process(const ColorFrame& color, const DepthFrame* depth, std::span<const Pose> X_WL) {
  return impl_->process(color, depth, X_WL);
}
Scene Perceiver::refuse(const ColorFrame& color, const std::string& why) { return impl_->refuse(color, why); }
const CameraModel& Perceiver::camera() const noexcept { return impl_->camera(); }
const CameraCheck& Perceiver::camera_check() const noexcept { return impl_->camera_check(); }

}  // namespace breakshot::perception
