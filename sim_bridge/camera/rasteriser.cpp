#include "sim_bridge/camera/rasteriser.hpp"

#include "sim_bridge/camera/shaders.hpp"

#include <algorithm>

namespace breakshot::sim_bridge {
namespace {

/// Where the layers sample a pixel, px from its centre: the rotated grid that GL's standard 4x pattern has.
constexpr std::array<std::array<double, 2>, Rasteriser::kLayers> kSamples{
    {{-0.125, -0.375}, {0.375, -0.125}, {-0.375, 0.125}, {0.125, 0.375}}};

using shaders::kLight, shaders::kOutputs, shaders::kShading;

void set_light(const Program& program, const Light& light, const Vector3& p_WC) {
  program.use();
  program.set("light_W", light.direction_W);
  program.set("light_axes", light.axes_W);
  program.set("tan_softness", light.tan_softness);
  program.set("ambient", light.ambient);
  program.set("p_WC", p_WC);
}

void set_capsules(const Program& program, const ShadowMesh& shadows) {
  program.use();
  const auto count = static_cast<GLsizei>(shadows.capsule_starts().size());
  program.set("capsule_count", static_cast<int>(count));
  if (count == 0) return;
  glUniform4fv(program.uniform("capsule_start"), count, shadows.capsule_starts().front().data());
  glUniform4fv(program.uniform("capsule_along"), count, shadows.capsule_alongs().front().data());
}

constexpr std::size_t index_of(Surface surface) { return static_cast<std::size_t>(surface); }

}  // namespace

Rasteriser::Rasteriser(const Projector& projector, const Light& light, const TableSettings& table)
    : width_{projector.model().width},
      height_{projector.model().height},
      surface_programs_{Program{"arm", {kLight, kShading, shaders::kArmVertex}, {kOutputs, shaders::kArmFragment}},
                        Program{"discs", {shaders::kSurfaceVertex}, {kLight, kShading, kOutputs, shaders::kDiscFragment}},
                        Program{"table", {shaders::kSurfaceVertex}, {kLight, kShading, kOutputs, shaders::kTableFragment}}},
      jitter_locations_{surface_programs_[0].uniform("jitter"), surface_programs_[1].uniform("jitter"),
                        surface_programs_[2].uniform("jitter")},
      surface_streams_{VertexStream{4, 3, 3, 3, 2}, VertexStream{4, 3, 3, 3, 2}, VertexStream{4, 3, 3, 3, 2}},
      clear_program_{"clear", {shaders::kClearVertex}, {kOutputs, shaders::kClearFragment}},
      disc_shadow_program_{"disc shadows", {shaders::kShadowVertex}, {kLight, shaders::kShadowFactor, shaders::kDiscShadowFragment}},
      arm_shadow_program_{"arm shadow", {shaders::kShadowVertex}, {kLight, shaders::kShadowFactor, shaders::kArmShadowFragment}},
      clear_stream_{2},
      disc_shadow_stream_{4, 2, 4},
      arm_shadow_stream_{4, 2, 4},
      layers_target_{width_, height_ * kLayers, {GL_RGBA8, GL_R16UI}, true},
      shadow_target_{width_, height_, {GL_R8}, false},
      layer_rgba_(4 * static_cast<std::size_t>(width_ * height_) * kLayers),
      layer_depth_(static_cast<std::size_t>(width_ * height_) * kLayers),
      shadow_factor_(static_cast<std::size_t>(width_ * height_)),
      all_tiles_{width_, height_} {
  const Vector3 p_WC = projector.model().X_WC.translation();
  for (const Program& program : surface_programs_) set_light(program, light, p_WC);
  surface_programs_[index_of(Surface::kTable)].use();
  surface_programs_[index_of(Surface::kTable)].set("texture_strength", table.texture);
  for (const Program* program : {&disc_shadow_program_, &arm_shadow_program_}) {
    set_light(*program, light, p_WC);
    program->set("table_half", Vector2{0.5 * table.size});
  }

  glDisable(GL_DITHER);
  glFrontFace(GL_CW);  // image row 0 is GL's row 0, which mirrors what GL sees
  glClearColor(1.0F, 1.0F, 1.0F, 1.0F);
  glBlendFunc(GL_DST_COLOR, GL_ZERO);  // shadows multiply
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glPixelStorei(GL_PACK_ROW_LENGTH, width_);
  check_gl("setting up the renderer");
}

void Rasteriser::draw_layers(std::span<const SceneMesh> meshes, const TileGrid& tiles) {
  clear_quads_.clear();
  const auto to_clip = [](int pixel, int size) { return 2.0F * static_cast<float>(pixel) / static_cast<float>(size) - 1.0F; };
  tiles.for_each_run([&](const PixelRect& run) {
    const float left = to_clip(run.x, width_), right = to_clip(run.x + run.width, width_);
    const float low = to_clip(run.y, height_), high = to_clip(run.y + run.height, height_);
    clear_quads_.insert(clear_quads_.end(), {left, low, left, high, right, high, left, low, right, high, right, low});
  });
  clear_stream_.upload(clear_quads_.data(), clear_quads_.size() * sizeof(float));
  for (const SceneMesh& mesh : meshes) {
    const VertexStream& stream = surface_streams_[index_of(mesh.surface())];
    stream.upload(mesh.vertices().data(), mesh.vertices().size() * sizeof(SceneVertex));
    stream.upload_indices(mesh.indices().data(), mesh.indices().size() * sizeof(std::uint32_t));
  }

  layers_target_.bind();
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_SCISSOR_TEST);
  glEnable(GL_CULL_FACE);
  for (int layer = 0; layer < kLayers; ++layer) {
    glViewport(0, layer * height_, width_, height_);
    glScissor(0, layer * height_, width_, height_);
    clear_program_.use();
    clear_stream_.bind();
    glDepthFunc(GL_ALWAYS);
    glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(clear_quads_.size() / 2));

    glDepthFunc(GL_LESS);
    const auto& sample = kSamples[static_cast<std::size_t>(layer)];
    for (const SceneMesh& mesh : meshes) {
      if (mesh.indices().empty()) continue;
      const std::size_t surface = index_of(mesh.surface());
      surface_programs_[surface].use();
      glUniform2f(jitter_locations_[surface], static_cast<float>(-2.0 * sample[0] / width_),
                  static_cast<float>(-2.0 * sample[1] / height_));
      surface_streams_[surface].bind();
      glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(mesh.indices().size()), GL_UNSIGNED_INT, nullptr);
    }
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_DEPTH_TEST);

  for (int layer = 0; layer < kLayers; ++layer) {
    const std::size_t first = static_cast<std::size_t>(layer) * static_cast<std::size_t>(width_ * height_);
    tiles.for_each_run([&](const PixelRect& run) {
      const std::size_t pixel = first + static_cast<std::size_t>(run.y * width_ + run.x);
      glReadBuffer(GL_COLOR_ATTACHMENT0);
      glReadPixels(run.x, layer * height_ + run.y, run.width, run.height, GL_RGBA, GL_UNSIGNED_BYTE, &layer_rgba_[4 * pixel]);
      glReadBuffer(GL_COLOR_ATTACHMENT1);
      glReadPixels(run.x, layer * height_ + run.y, run.width, run.height, GL_RED_INTEGER, GL_UNSIGNED_SHORT, &layer_depth_[pixel]);
    });
  }
}

void Rasteriser::draw_shadows(const ShadowMesh& shadows, const TileGrid& tiles) {
  shadow_target_.bind();
  glViewport(0, 0, width_, height_);
  glEnable(GL_SCISSOR_TEST);
  tiles.for_each_run([&](const PixelRect& run) {
    glScissor(run.x, run.y, run.width, run.height);
    glClear(GL_COLOR_BUFFER_BIT);
  });
  glDisable(GL_SCISSOR_TEST);
  glEnable(GL_BLEND);
  const auto draw_with = [](const Program& program, const VertexStream& stream, const std::vector<ShadowVertex>& vertices) {
    if (vertices.empty()) return;
    program.use();
    stream.upload(vertices.data(), vertices.size() * sizeof(ShadowVertex));
    glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices.size()));
  };
  draw_with(disc_shadow_program_, disc_shadow_stream_, shadows.disc_vertices());
  draw_with(arm_shadow_program_, arm_shadow_stream_, shadows.arm_vertices());
  glDisable(GL_BLEND);
  tiles.for_each_run([&](const PixelRect& run) {
    glReadPixels(run.x, run.y, run.width, run.height, GL_RED, GL_UNSIGNED_BYTE,
                 &shadow_factor_[static_cast<std::size_t>(run.y * width_ + run.x)]);
  });
}

void Rasteriser::compose_mesh(const PixelRect& run, const IdealImage& background, IdealImage& image) const {
  const auto layer_size = static_cast<std::size_t>(width_ * height_);
  for (int row = run.y; row < run.y + run.height; ++row) {
    const auto first = static_cast<std::size_t>(row * width_ + run.x);
    for (std::size_t pixel = first; pixel < first + static_cast<std::size_t>(run.width); ++pixel) {
      std::array<std::uint32_t, 4> sum{};  // of the layers; alpha is 255 where a layer shows the background
      std::uint32_t depth = 0;
      for (std::size_t layer = 0; layer < kLayers; ++layer) {
        const std::uint8_t* rgba = &layer_rgba_[4 * (layer * layer_size + pixel)];
        for (std::size_t channel = 0; channel < 4; ++channel) sum[channel] += rgba[channel];
        depth += layer_depth_[layer * layer_size + pixel];
      }
      const std::uint32_t uncovered = sum[3] / 255;
      const std::uint32_t factor = uncovered * shadow_factor_[pixel];  // at most 4 * 255
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::uint32_t scaled = 255 * sum[channel] + factor * background.rgb[3 * pixel + channel];
        image.rgb[3 * pixel + channel] = static_cast<std::uint8_t>((scaled + 510) / 1020);
      }
      // Layers without a measurement in front of a background without one do not count.
      const std::uint32_t behind = background.depth[pixel];
      const std::uint32_t counted = behind == 0 ? kLayers - uncovered : kLayers;
      image.depth[pixel] =
          counted == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>((depth + uncovered * behind + counted / 2) / counted);
    }
  }
}

void Rasteriser::compose_shadow(const PixelRect& run, const IdealImage& background, IdealImage& image) const {
  for (int row = run.y; row < run.y + run.height; ++row) {
    const auto first = static_cast<std::size_t>(row * width_ + run.x);
    for (std::size_t pixel = first; pixel < first + static_cast<std::size_t>(run.width); ++pixel) {
      for (std::size_t channel = 3 * pixel; channel < 3 * pixel + 3; ++channel) {
        const std::uint32_t scaled = static_cast<std::uint32_t>(background.rgb[channel]) * shadow_factor_[pixel];
        image.rgb[channel] = static_cast<std::uint8_t>((scaled + 127) / 255);
      }
      image.depth[pixel] = background.depth[pixel];
    }
  }
}

void Rasteriser::draw(std::span<const SceneMesh> meshes, const TileGrid& mesh_tiles, const ShadowMesh& shadows,
                      const TileGrid& shadow_tiles, const IdealImage& background, IdealImage& image) {
  all_tiles_.clear();
  all_tiles_.mark(mesh_tiles);
  all_tiles_.mark(shadow_tiles);
  if (all_tiles_.empty()) return;
  set_capsules(arm_shadow_program_, shadows);
  set_capsules(surface_programs_[index_of(Surface::kDisc)], shadows);
  draw_shadows(shadows, all_tiles_);
  if (!mesh_tiles.empty()) draw_layers(meshes, mesh_tiles);
  check_gl("rendering a frame");
  mesh_tiles.for_each_run([&](const PixelRect& run) { compose_mesh(run, background, image); });
  shadow_tiles.for_each_run([&](const PixelRect& run) { compose_shadow(run, background, image); }, &mesh_tiles);
}

}  // namespace breakshot::sim_bridge
