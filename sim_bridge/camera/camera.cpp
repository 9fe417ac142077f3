#include "sim_bridge/camera/camera.hpp"

#include "sim_bridge/camera/headless_context.hpp"
#include "sim_bridge/camera/marker_mesh.hpp"
#include "sim_bridge/camera/mesh.hpp"
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

/// What is drawn of one link, ready to be placed.
struct LinkVisual {
  Solid solid;  ///< in S
  Shape shape;
  Capsule shadow;  ///< in L
};

std::vector<LinkVisual> make_visuals(const LinkDescription& link) {
  std::vector<LinkVisual> visuals;
  for (const Shape& shape : link.visuals) visuals.push_back({make_solid(shape), shape, make_capsule(shape)});
  return visuals;
}

/// A level rectangle as a box without sides, divided finely enough for a distorting lens.
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
        current_{context_},
        rasteriser_{projector_, light_, settings.shine, settings.table},
        drawn_{model.width, model.height},
        background_{model.width, model.height},
        image_{model.width, model.height} {
    if (!(model.X_WC.translation().z() >= kMinCameraHeight)) {
      throw CameraError{"camera: height over the table: found " + std::to_string(model.X_WC.translation().z()) + " m; allowed from " +
                        std::to_string(kMinCameraHeight) + " m"};
    }
    sensor_.set_exposure(settings.exposure);
    for (const LinkDescription& link : arm.links) links_.push_back(make_visuals(link));
    draw_background(make_visuals(arm.base), X_WB);
    warm_up();
    current_.reset();
  }

  void render(const WorldSnapshot& snapshot, std::uint64_t frame, std::span<std::uint8_t> rgb, std::span<std::uint16_t> depth) {
    check(snapshot, rgb, depth);
    draw(snapshot);
    sensor_.expose(image_.rgb, frame, rgb);
    sensor_.measure(image_.depth, frame, depth);
  }

  void set_exposure(const Exposure& exposure) { sensor_.set_exposure(exposure); }
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
    scene_.table.add(make_solid(slab), X_WSlab, table.rgb, projector_, scene_.solid_tiles);
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
    for (std::size_t i = 0; i < links_.size(); ++i) add_link(links_[i], snapshot.X_WL[i]);
    for (const DiscState& disc : snapshot.discs) {
      if (disc.on_table) add_disc(disc);
    }

    const HeadlessContext::Current current{context_};
    // What the last frame drew and this one does not: background again.
    drawn_.for_each_run([&](const PixelRect& run) { restore(run); });
    rasteriser_.draw(scene_, background_, image_);
    drawn_ = scene_.solid_tiles;
    drawn_.mark(scene_.disc_tiles);
    drawn_.mark(scene_.shadows.arm_tiles());
    drawn_.mark(scene_.shadows.disc_tiles());
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
  std::vector<std::vector<LinkVisual>> links_;

  HeadlessContext context_;
  std::optional<HeadlessContext::Current> current_;  ///< only while the object is constructed
  Rasteriser rasteriser_;

  Scene scene_{projector_, light_.lamps.size()};
  TileGrid drawn_;         ///< tiles of image_ that are not background
  IdealImage background_;  ///< table, floor and the arm's base
  IdealImage image_;       ///< the last frame
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
