#include "sim_bridge/camera/rasteriser.hpp"

#include "sim_bridge/camera/shaders.hpp"

#include <algorithm>

namespace breakshot::sim_bridge {
namespace {

using shaders::kLight, shaders::kOutputs, shaders::kShading, shaders::kShadowCommon;

constexpr std::size_t kLayers = 4;
/// Where the layers sample a pixel, px from its centre: the rotated grid that GL's standard 4x pattern has.
constexpr std::array<std::array<double, 2>, kLayers> kSamples{{{-0.125, -0.375}, {0.375, -0.125}, {-0.375, 0.125}, {0.125, 0.375}}};

/// One array plus another; the compiler does many at a time.
template <typename Sum, typename Value>
void add(const Value* values, std::size_t count, Sum* sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] = static_cast<Sum>(sums[i] + values[i]);
}

}  // namespace

Rasteriser::Rasteriser(const Projector& projector, const Light& light, const TableSettings& table)
    : width_{projector.model().width},
      height_{projector.model().height},
      table_{{"table", {shaders::kTableVertex}, {kLight, kShading, kOutputs, shaders::kTableFragment}}, VertexStream{4, 3, 3, 3}, -1},
      arm_{{"arm", {kLight, kShading, shaders::kArmVertex}, {kOutputs, shaders::kArmFragment}}, VertexStream{4, 3, 3, 3}, -1},
      discs_{{"discs", {kLight, shaders::kDiscVertex}, {kLight, kOutputs, shaders::kDiscFragment}}, VertexStream{4, 2, 4, 3, 1}, -1},
      clear_{{"clear", {shaders::kClearVertex}, {kOutputs, shaders::kClearFragment}}, VertexStream{2}, -1},
      arm_shadow_{{"arm shadow", {kLight, kShadowCommon, shaders::kArmShadowVertex}, {kLight, shaders::kArmShadowFragment}},
                  VertexStream{4, 2, 3, 4, 4},
                  -1},
      enlarge_{{"enlarge", {shaders::kEnlargeVertex}, {shaders::kEnlargeFragment}}, VertexStream{2}, -1},
      disc_shadows_{{"disc shadows", {kLight, kShadowCommon, shaders::kDiscShadowVertex}, {kLight, shaders::kDiscShadowFragment}},
                    VertexStream{4, 2, 4},
                    -1},
      layer_target_{width_, height_, {GL_RGBA8, GL_R16UI}, true},
      half_target_{(width_ + 1) / 2, (height_ + 1) / 2, {GL_R8}, false},
      shadow_target_{width_, height_, {GL_R8}, false},
      all_tiles_{width_, height_},
      shadow_tiles_{width_, height_},
      run_rgba_(4 * static_cast<std::size_t>(width_ * TileGrid::kTile)),
      run_depth_(static_cast<std::size_t>(width_ * TileGrid::kTile)),
      sum_rgba_(4 * static_cast<std::size_t>(width_ * height_)),
      sum_depth_(static_cast<std::size_t>(width_ * height_)),
      shadow_factor_(static_cast<std::size_t>(width_ * height_)) {
  for (Pass* pass : {&table_, &arm_, &discs_, &arm_shadow_, &disc_shadows_}) {
    pass->jitter = pass->program.uniform("jitter");
    pass->program.use();
    pass->program.set("light_W", light.direction_W);
    pass->program.set("tan_softness", light.tan_softness);
    pass->program.set("ambient", light.ambient);
    pass->program.set("p_WC", Vector3{projector.model().X_WC.translation()});
    pass->program.set("table_half", Vector2{0.5 * table.size});
    pass->program.set("texture_strength", table.texture);
    pass->program.set("near_plane", Projector::kNear);
  }
  glDisable(GL_DITHER);
  glFrontFace(GL_CW);  // image row 0 is GL's row 0, which mirrors what GL sees
  glClearColor(1.0F, 1.0F, 1.0F, 1.0F);
  glBlendFunc(GL_DST_COLOR, GL_ZERO);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  check_gl("setting up the renderer");
}

void Rasteriser::fill_quads(const TileGrid& tiles) {
  const auto to_clip = [](int pixel, int size) { return 2.0F * static_cast<float>(pixel) / static_cast<float>(size) - 1.0F; };
  quads_.clear();
  tiles.for_each_run([&](const PixelRect& run) {
    const float left = to_clip(run.x, width_), right = to_clip(run.x + run.width, width_);
    const float low = to_clip(run.y, height_), high = to_clip(run.y + run.height, height_);
    quads_.insert(quads_.end(), {{left, low}, {left, high}, {right, high}, {left, low}, {right, high}, {right, low}});
  });
}

void Rasteriser::draw_shadows(const ShadowMesh& shadows) {
  const bool arm = !shadows.arm_vertices().empty();
  if (arm) {
    half_target_.bind();
    glClear(GL_COLOR_BUFFER_BIT);
    glEnable(GL_BLEND);
    glBlendEquation(GL_MIN);  // a point in the shadow of two links is in the shadow of one arm
    arm_shadow_.program.use();
    arm_shadow_.stream.upload(shadows.arm_vertices());
    arm_shadow_.stream.draw(shadows.arm_vertices().size());
    glDisable(GL_BLEND);
  }

  shadow_target_.bind();
  glEnable(GL_SCISSOR_TEST);
  all_tiles_.for_each_run([&](const PixelRect& run) {
    glScissor(run.x, run.y, run.width, run.height);
    glClear(GL_COLOR_BUFFER_BIT);
  });
  glDisable(GL_SCISSOR_TEST);
  if (arm) {
    fill_quads(shadows.arm_tiles());
    half_target_.bind_as_texture();
    enlarge_.program.use();
    enlarge_.stream.upload(quads_);
    enlarge_.stream.draw(quads_.size());
  }
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);  // with glBlendFunc above: the shadows multiply
  disc_shadows_.program.use();
  disc_shadows_.stream.upload(shadows.disc_vertices());
  disc_shadows_.stream.draw(shadows.disc_vertices().size());
  glDisable(GL_BLEND);

  glPixelStorei(GL_PACK_ROW_LENGTH, width_);
  all_tiles_.for_each_run([&](const PixelRect& run) {
    glReadPixels(run.x, run.y, run.width, run.height, GL_RED, GL_UNSIGNED_BYTE,
                 &shadow_factor_[static_cast<std::size_t>(run.y * width_ + run.x)]);
  });
}

void Rasteriser::draw_layer(const Scene& scene, std::size_t layer) {
  const auto use = [&](const Pass& pass) {
    pass.program.use();
    glUniform2f(pass.jitter, static_cast<float>(-2.0 * kSamples[layer][0] / width_),
                static_cast<float>(-2.0 * kSamples[layer][1] / height_));
  };
  glDepthFunc(GL_ALWAYS);
  clear_.program.use();
  clear_.stream.draw(quads_.size());
  glDepthFunc(GL_LESS);

  // Front to back: what the arm hides is not shaded.
  glEnable(GL_CULL_FACE);
  use(arm_);
  arm_.stream.draw_indexed(scene.arm.indices().size());
  use(table_);
  table_.stream.draw_indexed(scene.table.indices().size());
  glDisable(GL_CULL_FACE);
  use(discs_);
  discs_.stream.draw(scene.discs.vertices().size());
}

void Rasteriser::add_layer(const TileGrid& tiles) {
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  tiles.for_each_run([&](const PixelRect& run) {
    glReadBuffer(GL_COLOR_ATTACHMENT0);
    glReadPixels(run.x, run.y, run.width, run.height, GL_RGBA, GL_UNSIGNED_BYTE, run_rgba_.data());
    glReadBuffer(GL_COLOR_ATTACHMENT1);
    glReadPixels(run.x, run.y, run.width, run.height, GL_RED_INTEGER, GL_UNSIGNED_SHORT, run_depth_.data());
    const auto width = static_cast<std::size_t>(run.width);
    for (std::size_t row = 0; row < static_cast<std::size_t>(run.height); ++row) {
      const std::size_t pixel =
          (static_cast<std::size_t>(run.y) + row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(run.x);
      add(&run_rgba_[4 * row * width], 4 * width, &sum_rgba_[4 * pixel]);
      add(&run_depth_[row * width], width, &sum_depth_[pixel]);
    }
  });
}

void Rasteriser::compose_mesh(const PixelRect& run, const IdealImage& background, IdealImage& image) const {
  for (int row = run.y; row < run.y + run.height; ++row) {
    const auto first = static_cast<std::size_t>(row * width_ + run.x);
    for (std::size_t pixel = first; pixel < first + static_cast<std::size_t>(run.width); ++pixel) {
      const std::uint16_t* sum = &sum_rgba_[4 * pixel];
      const std::uint32_t uncovered = sum[3] / 255U;  // layers that show the background
      const std::uint32_t shadow = shadow_factor_[pixel];
      const std::uint32_t factor = uncovered * (shadow + (shadow >> 7));  // 256 is 1, per layer
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::uint32_t value = 256U * sum[channel] + factor * background.rgb[3 * pixel + channel];
        image.rgb[3 * pixel + channel] = static_cast<std::uint8_t>((value + 512) >> 10);
      }
      const std::uint32_t behind = background.depth[pixel];
      if (behind != 0) {
        image.depth[pixel] = static_cast<std::uint16_t>((sum_depth_[pixel] + uncovered * behind + kLayers / 2) / kLayers);
      } else {
        // No depth behind: the layers that see nothing do not count.
        const auto covered = static_cast<std::uint32_t>(kLayers) - uncovered;
        image.depth[pixel] = static_cast<std::uint16_t>(covered == 0 ? 0 : sum_depth_[pixel] / covered);
      }
    }
  }
}

void Rasteriser::compose_shadow(const PixelRect& run, const IdealImage& background, IdealImage& image) const {
  for (int row = run.y; row < run.y + run.height; ++row) {
    const auto first = static_cast<std::size_t>(row * width_ + run.x);
    const auto width = static_cast<std::size_t>(run.width);
    for (std::size_t pixel = first; pixel < first + width; ++pixel) {
      const std::uint32_t shadow = shadow_factor_[pixel];
      const std::uint32_t factor = shadow + (shadow >> 7);
      for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
        image.rgb[i] = static_cast<std::uint8_t>((factor * background.rgb[i] + 128) >> 8);
      }
    }
    std::copy_n(&background.depth[first], width, &image.depth[first]);
  }
}

void Rasteriser::draw(const Scene& scene, const IdealImage& background, IdealImage& image) {
  shadow_tiles_ = scene.shadows.arm_tiles();
  shadow_tiles_.mark(scene.shadows.disc_tiles());
  all_tiles_ = scene.mesh_tiles;
  all_tiles_.mark(shadow_tiles_);
  if (all_tiles_.empty()) return;
  draw_shadows(scene.shadows);

  scene.mesh_tiles.for_each_run([&](const PixelRect& run) {
    for (int row = run.y; row < run.y + run.height; ++row) {
      const auto first = static_cast<std::size_t>(row * width_ + run.x);
      std::fill_n(&sum_rgba_[4 * first], 4 * static_cast<std::size_t>(run.width), std::uint16_t{0});
      std::fill_n(&sum_depth_[first], static_cast<std::size_t>(run.width), 0U);
    }
  });
  fill_quads(scene.mesh_tiles);
  clear_.stream.upload(quads_);
  table_.stream.upload(scene.table.vertices(), scene.table.indices());
  arm_.stream.upload(scene.arm.vertices(), scene.arm.indices());
  discs_.stream.upload(scene.discs.vertices());
  layer_target_.bind();
  glEnable(GL_DEPTH_TEST);
  for (std::size_t layer = 0; layer < kLayers; ++layer) {
    draw_layer(scene, layer);
    add_layer(scene.mesh_tiles);
  }
  glDisable(GL_DEPTH_TEST);
  check_gl("rendering a frame");

  scene.mesh_tiles.for_each_run([&](const PixelRect& run) { compose_mesh(run, background, image); });
  shadow_tiles_.for_each_run([&](const PixelRect& run) { compose_shadow(run, background, image); }, &scene.mesh_tiles);
}

}  // namespace breakshot::sim_bridge
