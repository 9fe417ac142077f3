#include "sim_bridge/camera/camera.hpp"

#include "sim_bridge/camera/headless_context.hpp"
#include "sim_bridge/camera/mesh.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "sim_bridge/camera/rasteriser.hpp"
#include "sim_bridge/camera/sensor.hpp"
#include "sim_bridge/camera/shadow.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

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

}  // namespace

class Camera::Implementation {
 public:
  Implementation(const CameraModel& model, const CameraSettings& settings, const ArmDescription& arm, const Pose& X_WB)
      : projector_{model},
        settings_{settings},
        light_{settings.light},
        sensor_{settings.noise, settings.seed, settings.depth_min, settings.depth_max},
        disc_{make_unit_disc()},
        current_{context_},
        rasteriser_{projector_, light_, settings.table},
        mesh_tiles_{model.width, model.height},
        arm_shadow_tiles_{model.width, model.height},
        shadow_tiles_{model.width, model.height},
        drawn_{model.width, model.height},
        background_{model.width, model.height},
        image_{model.width, model.height} {
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
    }
    if (rgb.size() != image_.rgb.size() || depth.size() != image_.depth.size()) {
      throw CameraError{"camera: room for " + std::to_string(rgb.size()) + " bytes of colour and " + std::to_string(depth.size()) +
                        " depths; needed are " + std::to_string(image_.rgb.size()) + " and " + std::to_string(image_.depth.size())};
    }
  }

  void add_link(const std::vector<LinkVisual>& visuals, const Pose& X_WL) {
    for (const LinkVisual& visual : visuals) {
      arm_mesh().add(visual.solid, X_WL * visual.shape.X_LS, Vector3::Ones(), visual.shape.rgb, projector_, mesh_tiles_);
      if (!light_.shadows) continue;
      shadows_.add_capsule({X_WL * visual.shadow.start, X_WL * visual.shadow.end, visual.shadow.radius}, light_, projector_,
                           arm_shadow_tiles_);
    }
  }

  SceneMesh& arm_mesh() { return meshes_[0]; }
  SceneMesh& disc_mesh() { return meshes_[1]; }
  SceneMesh& table_mesh() { return meshes_[2]; }

  void begin() {
    for (SceneMesh& mesh : meshes_) mesh.clear();
    shadows_.clear();
    mesh_tiles_.clear();
    arm_shadow_tiles_.clear();
    shadow_tiles_.clear();
  }

  /// Draws what was added over the background into `target`.
  void finish(const IdealImage& background, IdealImage& target) {
    shadows_.add_arm_patches(arm_shadow_tiles_, projector_);
    shadow_tiles_.mark(arm_shadow_tiles_);
    rasteriser_.draw(meshes_, mesh_tiles_, shadows_, shadow_tiles_, background, target);
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

    begin();
    table_mesh().add(make_floor({6.0, 6.0}), X_WFloor, Vector3::Ones(), table.floor_rgb, projector_, mesh_tiles_);
    table_mesh().add(make_solid(slab), X_WSlab, Vector3::Ones(), table.rgb, projector_, mesh_tiles_);
    mesh_tiles_.mark_all();
    finish(IdealImage{model().width, model().height}, image_);

    begin();
    add_link(base, X_WB);
    background_ = image_;
    finish(image_, background_);
    image_ = background_;
  }

  /// The driver compiles its code for a state of GL when that is first drawn with, which takes longer than a frame may.
  void warm_up() {
    begin();
    disc_mesh().add(disc_, Pose::Identity(), {0.03, 0.03, 0.02}, {0.5F, 0.5F, 0.5F}, projector_, mesh_tiles_);
    shadows_.add_disc(DiscState{}, light_, projector_, shadow_tiles_);
    IdealImage scratch{model().width, model().height};
    finish(background_, scratch);
  }

  void draw(const WorldSnapshot& snapshot) {
    begin();
    for (const DiscState& disc : snapshot.discs) {
      if (!disc.on_table) continue;
      Pose X_WD = Pose::Identity();
      X_WD.translation().head<2>() = disc.p_WD;
      X_WD.linear() = Eigen::AngleAxisd{disc.yaw, Vector3::UnitZ()}.toRotationMatrix();
      disc_mesh().add(disc_, X_WD, {disc.radius, disc.radius, disc.height}, settings_.palette[disc.colour], projector_, mesh_tiles_);
      if (light_.shadows) shadows_.add_disc(disc, light_, projector_, shadow_tiles_);
    }
    for (std::size_t i = 0; i < links_.size(); ++i) add_link(links_[i], snapshot.X_WL[i]);

    const HeadlessContext::Current current{context_};
    // What the last frame drew and this one does not: background again.
    drawn_.for_each_run([&](const PixelRect& run) { restore(run); });
    finish(background_, image_);
    drawn_ = mesh_tiles_;
    drawn_.mark(shadow_tiles_);
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
  Solid disc_;
  std::vector<std::vector<LinkVisual>> links_;

  HeadlessContext context_;
  std::optional<HeadlessContext::Current> current_;  ///< only while the object is constructed
  Rasteriser rasteriser_;

  std::array<SceneMesh, kSurfaces> meshes_{SceneMesh{Surface::kArm}, SceneMesh{Surface::kDisc}, SceneMesh{Surface::kTable}};
  ShadowMesh shadows_;
  TileGrid mesh_tiles_, arm_shadow_tiles_, shadow_tiles_;
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
