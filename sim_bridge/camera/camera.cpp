#include "sim_bridge/camera/camera.hpp"

#include "sim_bridge/camera/changing_light.hpp"
#include "sim_bridge/camera/depth_flaws.hpp"
#include "sim_bridge/camera/headless_context.hpp"
#include "sim_bridge/camera/marker_mesh.hpp"
#include "sim_bridge/camera/mesh.hpp"
#include "sim_bridge/camera/motion.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "sim_bridge/camera/rasteriser.hpp"
#include "sim_bridge/camera/sensor.hpp"
#include "sim_bridge/camera/shadow.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

/// Discs must be well below the camera: rays are followed from the plane of the top to the table.
constexpr double kMaxDiscHeight = 0.10;    // m
constexpr double kMinCameraHeight = 0.15;  // m
constexpr double kMaxExposure = 0.1;       // s

/// What is drawn of one link, ready to be placed.
struct LinkVisual {
  Solid solid;  ///< in S
  Shape shape;
  Capsule shadow;  ///< in L
};

std::vector<LinkVisual> make_visuals(const LinkDescription& link, double piece) {
  std::vector<LinkVisual> visuals;
  for (const Shape& shape : link.visuals) visuals.push_back({make_solid(shape, piece), shape, make_capsule(shape)});
  return visuals;
}

/// A level rectangle as a box without sides.
Solid make_floor(const Vector2& size) {
  Shape slab;
  slab.kind = Shape::Kind::kBox;
  slab.size = {size.x(), size.y(), 0.001};
  slab.X_LS.translation().z() = -0.0005;
  return make_solid(slab);
}

CameraModel moved(CameraModel model, const CameraMove& move) {
  model.X_WC.translation() += move.by_W;
  if (const double angle = move.turn_C.norm(); angle > 0.0) model.X_WC.rotate(Eigen::AngleAxisd{angle, move.turn_C / angle});
  return model;
}

}  // namespace

class Camera::Implementation {
 public:
  Implementation(const CameraModel& model, const CameraSettings& settings, const ArmDescription& arm, const Pose& X_WB)
      : projector_{moved(model, settings.move)},
        settings_{settings},
        light_{settings.light},
        sensor_{settings.noise, settings.seed, settings.depth_min, settings.depth_max},
        exposure_{settings.exposure},
        drift_{settings.drift, settings.seed},
        moving_shadow_{settings.moving_shadow, light_, projector_, settings.seed},
        depth_flaws_{settings.depth_flaws, model.fx, settings.noise.depth_baseline, settings.seed},
        current_{context_},
        rasteriser_{projector_, light_, settings.shine, settings.table},
        drawn_{model.width, model.height},
        raised_{drawn_},
        background_{model.width, model.height},
        image_{model.width, model.height},
        moving_tiles_{drawn_} {
    if (!(model.X_WC.translation().z() >= kMinCameraHeight)) {
      throw CameraError{"camera: height over the table: found " + std::to_string(model.X_WC.translation().z()) + " m; allowed from " +
                        std::to_string(kMinCameraHeight) + " m"};
    }
    if (!(settings.exposure_time >= 0.0 && settings.exposure_time <= kMaxExposure)) {
      throw CameraError{"camera: exposure_time in s: found " + std::to_string(settings.exposure_time) + "; allowed 0 to " +
                        std::to_string(kMaxExposure)};
    }
    sensor_.set_exposure(exposure_);
    if (moving_shadow_.active()) shaded_.resize(image_.rgb.size());
    if (depth_flaws_.active()) flawed_.resize(image_.depth.size());
    for (const LinkDescription& link : arm.links) links_.push_back(make_visuals(link, piece_for(projector_)));
    draw_background(make_visuals(arm.base, piece_for(projector_)), X_WB);
    warm_up();
    current_.reset();
  }

  void render(const WorldSnapshot& snapshot, std::uint64_t frame, std::span<std::uint8_t> rgb, std::span<std::uint16_t> depth) {
    check(snapshot, rgb, depth);
    draw(snapshot);
    if (drift_.active()) sensor_.set_exposure(drift_.at(exposure_, snapshot.stamp));
    if (moving_shadow_.active()) moving_shadow_.cast(image_.rgb, snapshot.stamp, shaded_);
    if (depth_flaws_.active()) depth_flaws_.apply(image_.depth, model().width, raised_, frame, flawed_);
    sensor_.expose(moving_shadow_.active() ? shaded_ : image_.rgb, frame, rgb);
    sensor_.measure(depth_flaws_.active() ? flawed_ : image_.depth, frame, depth);
  }

  void set_exposure(const Exposure& exposure) {
    sensor_.set_exposure(exposure);
    exposure_ = exposure;
  }
  const CameraModel& model() const { return projector_.model(); }

 private:
  void check(const WorldSnapshot& snapshot, std::span<std::uint8_t> rgb, std::span<std::uint16_t> depth) const {
    if (snapshot.X_WL.size() != links_.size()) {
      throw CameraError{"camera: the snapshot has " + std::to_string(snapshot.X_WL.size()) + " link poses; the arm has " +
                        std::to_string(links_.size()) + " moving links"};
    }
    for (const DiscState& disc : snapshot.discs) {
      if (disc.colour >= settings_.palette.size()) {
        throw CameraError{"camera: a disc has colour " + std::to_string(disc.colour) + "; the palette has " +
                          std::to_string(settings_.palette.size()) + " colours"};
      }
      const bool drawable =
          disc.p_WD.allFinite() && disc.radius > 0.0 && disc.radius < 1.0 && disc.height > 0.0 && disc.height <= kMaxDiscHeight;
      if (!drawable) {
        throw CameraError{"camera: a disc at (" + std::to_string(disc.p_WD.x()) + ", " + std::to_string(disc.p_WD.y()) + ") with radius " +
                          std::to_string(disc.radius) + " and height " + std::to_string(disc.height) +
                          " m; allowed are finite places, radii up to 1 m and heights up to " + std::to_string(kMaxDiscHeight) + " m"};
      }
    }
    if (!snapshot.V_WL.empty() && snapshot.V_WL.size() != links_.size()) {
      throw CameraError{"camera: the snapshot has " + std::to_string(snapshot.V_WL.size()) + " link velocities; the arm has " +
                        std::to_string(links_.size()) + " moving links"};
    }
    if (rgb.size() != image_.rgb.size() || depth.size() != image_.depth.size()) {
      throw CameraError{"camera: room for " + std::to_string(rgb.size()) + " bytes of colour and " + std::to_string(depth.size()) +
                        " depths; needed are " + std::to_string(image_.rgb.size()) + " and " + std::to_string(image_.depth.size())};
    }
  }

  void add_link(const std::vector<LinkVisual>& visuals, const Pose& X_WL) {
    for (const LinkVisual& visual : visuals) {
      scene_.arm.add(visual.solid, X_WL * visual.shape.X_LS, visual.shape.rgb, projector_, scene_.solid_tiles);
      if (!light_.shadows) continue;
      scene_.shadows.add_capsule({X_WL * visual.shadow.start, X_WL * visual.shadow.end, visual.shadow.radius}, light_, projector_);
    }
  }

  void add_disc(const DiscState& disc) {
    DiscMesh::VisibilityAt visibility;
    if (light_.shadows) {
      scene_.shadows.add_disc(disc, light_, projector_);
      scene_.shadows.select_around({disc.p_WD.x(), disc.p_WD.y(), 0.0}, disc.radius + disc.height, light_);
      if (scene_.shadows.any_selected()) visibility = [this](const Vector3& p_W) { return scene_.shadows.visibility(p_W, light_); };
    }
    scene_.discs.add(disc, settings_.palette[disc.colour], projector_, visibility, scene_.disc_tiles);
  }

  void draw_background(const std::vector<LinkVisual>& base, const Pose& X_WB) {
    const TableSettings& table = settings_.table;
    Shape slab;
    slab.kind = Shape::Kind::kBox;
    slab.size = {table.size.x(), table.size.y(), table.thickness};
    Pose X_WSlab = Pose::Identity();
    X_WSlab.translation().z() = -0.5 * table.thickness;
    Pose X_WFloor = Pose::Identity();
    X_WFloor.translation().z() = -table.height_over_floor;

    scene_.clear();
    scene_.table.add(make_floor({6.0, 6.0}), X_WFloor, table.floor_rgb, projector_, scene_.solid_tiles);
    scene_.table.add(make_solid(slab, piece_for(projector_)), X_WSlab, table.rgb, projector_, scene_.solid_tiles);
    for (const MarkerPrint& marker : table.markers) add_marker(marker, projector_, scene_.table, scene_.solid_tiles);
    scene_.solid_tiles.mark_all();
    rasteriser_.draw(scene_, IdealImage{model().width, model().height}, image_);

    scene_.clear();
    add_link(base, X_WB);
    background_ = image_;
    rasteriser_.draw(scene_, image_, background_);
    image_ = background_;
  }

  /// The driver compiles its code for a state of GL when that is first drawn with, which takes longer than a frame may.
  void warm_up() {
    scene_.clear();
    add_disc(DiscState{});
    IdealImage scratch{model().width, model().height};
    rasteriser_.draw(scene_, background_, scratch);
  }

  void draw(const WorldSnapshot& snapshot) {
    scene_.clear();
    // The arm first: its capsules shade the discs.
    add_arm(snapshot, 0.0);
    for (const DiscState& disc : snapshot.discs) {
      if (disc.on_table) add_disc(disc);
    }

    const HeadlessContext::Current current{context_};
    // What the last frame drew and this one does not: background again.
    drawn_.for_each_run([&](const PixelRect& run) { restore(run); });
    rasteriser_.draw(scene_, background_, image_);
    drawn_ = scene_.tiles();
    raised_ = scene_.solid_tiles;
    raised_.mark(scene_.disc_tiles);
    if (settings_.exposure_time > 0.0) blur(snapshot);
  }

  void add_arm(const WorldSnapshot& snapshot, double seconds) {
    for (std::size_t i = 0; i < links_.size(); ++i) {
      add_link(links_[i], snapshot.V_WL.empty() ? snapshot.X_WL[i] : moved(snapshot.X_WL[i], snapshot.V_WL[i], seconds));
    }
  }

  double motion_of_arm(const WorldSnapshot& snapshot) const {
    double most = 0.0;
    for (std::size_t i = 0; i < snapshot.V_WL.size(); ++i) {
      const Pose& X_WL = snapshot.X_WL[i];
      for (const LinkVisual& visual : links_[i]) {
        const Capsule capsule_W{X_WL * visual.shadow.start, X_WL * visual.shadow.end, visual.shadow.radius};
        most = std::max(most, motion_px(capsule_W, X_WL, snapshot.V_WL[i], settings_.exposure_time, model()));
      }
    }
    return most;
  }

  /// Replaces what moves while the shutter is open by the average of pictures over that time. Without motion it leaves the picture alone.
  void blur(const WorldSnapshot& snapshot) {
    const double arm_motion = motion_of_arm(snapshot);
    const bool arm_moves = arm_motion > kStillMotion;
    double most = arm_motion;
    for (const DiscState& disc : snapshot.discs) {
      if (disc.on_table) most = std::max(most, motion_px(disc, settings_.exposure_time, model()));
    }
    if (most <= kStillMotion) return;
    const std::size_t samples = samples_for(most);
    const auto seconds = [&](std::size_t sample) { return settings_.exposure_time * sample_time(sample, samples); };
    const auto moves = [&](const DiscState& disc) {
      // A disc under the shadow of a moving arm changes as a whole.
      if (motion_px(disc, settings_.exposure_time, model()) > kStillMotion) return true;
      if (!arm_moves || !light_.shadows) return false;
      scene_.shadows.select_around({disc.p_WD.x(), disc.p_WD.y(), 0.0}, disc.radius + disc.height, light_);
      return scene_.shadows.any_selected();
    };

    moving_tiles_.clear();
    for (std::size_t sample = 0; sample < samples; ++sample) {
      scene_.clear();
      if (arm_moves) add_arm(snapshot, seconds(sample));
      for (const DiscState& disc : snapshot.discs) {
        if (disc.on_table && moves(disc)) add_disc(moved(disc, seconds(sample)));
      }
      moving_tiles_.mark(scene_.tiles());
    }
    sum_rgb_.resize(image_.rgb.size());
    sum_depth_.resize(image_.depth.size());
    count_depth_.resize(image_.depth.size());
    for_each_moving_row([&](std::size_t first, std::size_t count) {
      std::fill_n(&sum_rgb_[3 * first], 3 * count, std::uint16_t{0});
      std::fill_n(&sum_depth_[first], count, 0U);
      std::fill_n(&count_depth_[first], count, std::uint8_t{0});
    });
    for (std::size_t sample = 0; sample < samples; ++sample) {
      scene_.clear();
      add_arm(snapshot, seconds(sample));
      for (const DiscState& disc : snapshot.discs) {
        if (disc.on_table) add_disc(moved(disc, seconds(sample)));
      }
      moving_tiles_.for_each_run([&](const PixelRect& run) { restore(run); });
      rasteriser_.draw_sample(scene_, sample, moving_tiles_, background_, image_);
      for_each_moving_row([&](std::size_t first, std::size_t count) { add_row(first, count); });
    }
    for_each_moving_row([&](std::size_t first, std::size_t count) { take_average(first, count, static_cast<std::uint32_t>(samples)); });
    drawn_.mark(moving_tiles_);
    raised_.mark(moving_tiles_);
  }

  template <typename Visit>
  void for_each_moving_row(Visit&& visit) const {
    moving_tiles_.for_each_run([&](const PixelRect& run) {
      for (int row = run.y; row < run.y + run.height; ++row) {
        visit(pixel_index(run.x, row, model().width), static_cast<std::size_t>(run.width));
      }
    });
  }

  void add_row(std::size_t first, std::size_t count) {
    for (std::size_t i = 3 * first; i < 3 * (first + count); ++i) sum_rgb_[i] = static_cast<std::uint16_t>(sum_rgb_[i] + image_.rgb[i]);
    for (std::size_t i = first; i < first + count; ++i) {
      sum_depth_[i] += image_.depth[i];
      count_depth_[i] = static_cast<std::uint8_t>(count_depth_[i] + (image_.depth[i] != 0 ? 1 : 0));
    }
  }

  void take_average(std::size_t first, std::size_t count, std::uint32_t samples) {
    for (std::size_t i = 3 * first; i < 3 * (first + count); ++i) {
      image_.rgb[i] = static_cast<std::uint8_t>((sum_rgb_[i] + samples / 2) / samples);
    }
    // Samples without depth do not count.
    for (std::size_t i = first; i < first + count; ++i) {
      image_.depth[i] = static_cast<std::uint16_t>(count_depth_[i] == 0 ? 0U : (sum_depth_[i] + count_depth_[i] / 2U) / count_depth_[i]);
    }
  }

  void restore(const PixelRect& run) {
    for (int row = run.y; row < run.y + run.height; ++row) {
      const auto first = static_cast<std::ptrdiff_t>(row) * model().width + run.x;
      std::copy_n(background_.rgb.begin() + 3 * first, 3 * run.width, image_.rgb.begin() + 3 * first);
      std::copy_n(background_.depth.begin() + first, run.width, image_.depth.begin() + first);
    }
  }

  Projector projector_;
  CameraSettings settings_;
  Light light_;
  Sensor sensor_;
  Exposure exposure_;  ///< without drift
  Drift drift_;
  MovingShadow moving_shadow_;
  DepthFlaws depth_flaws_;
  std::vector<std::vector<LinkVisual>> links_;

  HeadlessContext context_;
  std::optional<HeadlessContext::Current> current_;  ///< only while the object is constructed
  Rasteriser rasteriser_;

  Scene scene_{projector_, light_.lamps.size()};
  TileGrid drawn_;         ///< tiles of image_ that are not background
  TileGrid raised_;        ///< those of them where something stands up from the table
  IdealImage background_;  ///< table, floor and the arm's base
  IdealImage image_;       ///< the last frame

  // Of a frame in which something moves:
  TileGrid moving_tiles_;
  std::vector<std::uint16_t> sum_rgb_;
  std::vector<std::uint32_t> sum_depth_;
  std::vector<std::uint8_t> count_depth_;
  // What comes between the picture and the sensor, when there is such:
  std::vector<std::uint8_t> shaded_;
  std::vector<std::uint16_t> flawed_;
};

Camera::Camera(const CameraModel& model, const CameraSettings& settings, const ArmDescription& arm, const Pose& X_WB)
    : implementation_{std::make_unique<Implementation>(model, settings, arm, X_WB)} {}
Camera::~Camera() = default;
Camera::Camera(Camera&&) noexcept = default;
Camera& Camera::operator=(Camera&&) noexcept = default;

void Camera::render(const WorldSnapshot& snapshot, std::uint64_t frame, std::span<std::uint8_t> rgb, std::span<std::uint16_t> depth) {
  implementation_->render(snapshot, frame, rgb, depth);
}
void Camera::set_exposure(const Exposure& exposure) { implementation_->set_exposure(exposure); }
const CameraModel& Camera::model() const { return implementation_->model(); }

}  // namespace breakshot::sim_bridge
