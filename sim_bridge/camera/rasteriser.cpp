#include "sim_bridge/camera/rasteriser.hpp"

#include "sim_bridge/camera/light_program.hpp"
#include "sim_bridge/camera/shaders.hpp"

#include <algorithm>

namespace breakshot::sim_bridge {
namespace {

using shaders::kLight, shaders::kOutputs, shaders::kShading;

constexpr std::size_t kLayers = 4;
/// Where the layers sample a pixel, px from its centre: the rotated grid that GL's standard 4x pattern has.
constexpr std::array<std::array<double, 2>, kLayers> kSamples{{{-0.125, -0.375}, {0.375, -0.125}, {-0.375, 0.125}, {0.125, 0.375}}};

/// Depths in clip space: what lies there hides nothing, or everything.
constexpr float kFar = 1.0F, kNearest = -1.0F;

/// One array plus another; the compiler does many at a time.
template <typename Sum, typename Value>
void add(const Value* values, std::size_t count, Sum* sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] = static_cast<Sum>(sums[i] + values[i]);
}

/// A factor of 0 to 255 as one of 0 to 256, so that the full one is exact.
constexpr std::uint32_t widened(std::uint8_t factor) { return factor + (std::uint32_t{factor} >> 7); }

/// Calls visit(index of the first pixel, count) for each row of a rectangle.
template <typename Visit>
void for_each_row(const PixelRect& rect, int image_width, Visit&& visit) {
  for (int row = rect.y; row < rect.y + rect.height; ++row) {
    visit(pixel_index(rect.x, row, image_width), static_cast<std::size_t>(rect.width));
  }
}

}  // namespace

Rasteriser::Rasteriser(const Projector& projector, const Light& light, const ShineSettings& shine, const TableSettings& table)
    : Rasteriser{projector, light, shine, table, light_definitions(light, shine)} {}

Rasteriser::Rasteriser(const Projector& projector, const Light& light, const ShineSettings& shine, const TableSettings& table,
                       const std::string& definitions)
    : width_{projector.model().width},
      height_{projector.model().height},
      table_{{"table", {shaders::kTableVertex}, {definitions.c_str(), kLight, kShading, kOutputs, shaders::kTableFragment}},
             VertexStream{4, 3, 3, 3},
             -1},
      arm_{{"arm", {definitions.c_str(), kLight, kShading, shaders::kArmVertex}, {kOutputs, shaders::kArmFragment}},
           VertexStream{4, 3, 3, 3},
           -1},
      discs_{
          {"discs", {definitions.c_str(), kLight, shaders::kDiscVertex}, {definitions.c_str(), kLight, kOutputs, shaders::kDiscFragment}},
          VertexStream{4, 2, 4, 3, 4},
          -1},
      clear_{{"clear", {shaders::kClearVertex}, {kOutputs, shaders::kClearFragment}}, VertexStream{3}, -1},
      shadow_layer_{projector, light, table},
      target_{width_, height_, {GL_RGBA8, GL_R16UI}, true},
      mesh_tiles_{width_, height_},
      shadow_tiles_{mesh_tiles_},
      all_tiles_{mesh_tiles_},
      filled_{mesh_tiles_},
      outlined_{mesh_tiles_},
      run_rgba_(4 * area(width_, TileGrid::kTile)),
      run_depth_(area(width_, TileGrid::kTile)),
      sum_rgba_(4 * area(width_, height_)),
      sum_depth_(area(width_, height_)) {
  for (Pass* pass : {&table_, &arm_, &discs_}) {
    pass->jitter = pass->program.uniform("jitter");
    set_light(pass->program, light, shine);
    pass->program.set("p_WC", Vector3{projector.model().X_WC.translation()});
    pass->program.set("texture_strength", table.texture);
    pass->program.set("near_plane", Projector::kNear);
  }
  glDisable(GL_DITHER);
  glFrontFace(GL_CW);  // image row 0 is GL's row 0, which mirrors what GL sees
  glClearColor(1.0F, 1.0F, 1.0F, 1.0F);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  check_gl("setting up the renderer");
}

void Rasteriser::draw_quads(const TileGrid& tiles, float depth) {
  const auto to_clip = [](int pixel, int size) { return 2.0F * static_cast<float>(pixel) / static_cast<float>(size) - 1.0F; };
  quads_.clear();
  tiles.for_each_run([&](const PixelRect& run) {
    const float left = to_clip(run.x, width_), right = to_clip(run.x + run.width, width_);
    const float low = to_clip(run.y, height_), high = to_clip(run.y + run.height, height_);
    for (const auto& corner : {std::array{left, low}, std::array{left, high}, std::array{right, high},  //
                               std::array{left, low}, std::array{right, high}, std::array{right, low}}) {
      quads_.push_back({corner[0], corner[1], depth});
    }
  });
  clear_.stream.upload(quads_);
  clear_.program.use();
  clear_.stream.draw(quads_.size());
}

void Rasteriser::draw_layer(const Scene& scene, std::size_t layer) {
  glDepthFunc(GL_ALWAYS);
  draw_quads(outlined_, kFar);
  if (layer == 1 && !filled_.empty()) draw_quads(filled_, kNearest);  // and stays so: nothing is nearer
  glDepthFunc(GL_LESS);

  const auto use = [&](const Pass& pass) {
    pass.program.use();
    glUniform2f(pass.jitter, static_cast<float>(-2.0 * kSamples[layer][0] / width_),
                static_cast<float>(-2.0 * kSamples[layer][1] / height_));
  };
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
  tiles.for_each_run([&](const PixelRect& run) {
    glReadBuffer(GL_COLOR_ATTACHMENT0);
    glReadPixels(run.x, run.y, run.width, run.height, GL_RGBA, GL_UNSIGNED_BYTE, run_rgba_.data());
    glReadBuffer(GL_COLOR_ATTACHMENT1);
    glReadPixels(run.x, run.y, run.width, run.height, GL_RED_INTEGER, GL_UNSIGNED_SHORT, run_depth_.data());
    std::size_t read = 0;
    for_each_row(run, width_, [&](std::size_t first, std::size_t count) {
      add(&run_rgba_[4 * read], 4 * count, &sum_rgba_[4 * first]);
      add(&run_depth_[read], count, &sum_depth_[first]);
      read += count;
    });
  });
}

void Rasteriser::let_one_layer_stand_for_all(const PixelRect& rect) {
  for_each_row(rect, width_, [&](std::size_t first, std::size_t count) {
    for (std::size_t i = 4 * first; i < 4 * (first + count); ++i) sum_rgba_[i] = static_cast<std::uint16_t>(kLayers * sum_rgba_[i]);
    for (std::size_t i = first; i < first + count; ++i) sum_depth_[i] *= kLayers;
  });
}

void Rasteriser::find_filled(const Scene& scene) {
  // The first layer stands for all of them where the arm alone fills a tile. The table fills tiles too, but has texture.
  if (!scene.table.indices().empty()) return;
  TileGrid& arm_alone = outlined_;
  arm_alone = scene.solid_tiles;
  arm_alone.unmark(scene.disc_tiles);
  arm_alone.for_each_tile([&](const PixelRect& tile) {
    std::uint32_t background = 0;
    for_each_row(tile, width_, [&](std::size_t first, std::size_t count) {
      for (std::size_t pixel = first; pixel < first + count; ++pixel) background |= sum_rgba_[4 * pixel + 3];
    });
    if (background != 0) return;
    filled_.mark_tile(tile);
    let_one_layer_stand_for_all(tile);
  });
  outlined_ = mesh_tiles_;
  outlined_.unmark(filled_);
}

template <std::size_t kChannels>
void Rasteriser::compose_mesh(const PixelRect& run, const IdealImage& background, IdealImage& image) const {
  const std::uint8_t* const factors = shadow_layer_.factors().data();
  for (int row = run.y; row < run.y + run.height; ++row) {
    const std::size_t first = pixel_index(run.x, row, width_);
    for (std::size_t pixel = first; pixel < first + static_cast<std::size_t>(run.width); ++pixel) {
      const std::uint16_t* sum = &sum_rgba_[4 * pixel];
      const std::uint32_t uncovered = sum[3] / 255U;  // layers that show the background
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::uint32_t factor = uncovered * widened(factors[kChannels * pixel + (kChannels == 1 ? 0 : channel)]);  // per layer
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

template <std::size_t kChannels>
void Rasteriser::compose_shadow(const PixelRect& run, const IdealImage& background, IdealImage& image) const {
  const std::uint8_t* const factors = shadow_layer_.factors().data();
  for (int row = run.y; row < run.y + run.height; ++row) {
    const std::size_t first = pixel_index(run.x, row, width_);
    const auto width = static_cast<std::size_t>(run.width);
    for (std::size_t pixel = first; pixel < first + width; ++pixel) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::uint32_t factor = widened(factors[kChannels * pixel + (kChannels == 1 ? 0 : channel)]);
        image.rgb[3 * pixel + channel] = static_cast<std::uint8_t>((factor * background.rgb[3 * pixel + channel] + 128) >> 8);
      }
    }
    std::copy_n(&background.depth[first], width, &image.depth[first]);
  }
}

template <std::size_t kChannels>
void Rasteriser::compose(const IdealImage& background, IdealImage& image) const {
  mesh_tiles_.for_each_run([&](const PixelRect& run) { compose_mesh<kChannels>(run, background, image); });
  shadow_tiles_.for_each_run([&](const PixelRect& run) { compose_shadow<kChannels>(run, background, image); }, &mesh_tiles_);
}

void Rasteriser::begin(const Scene& scene, const TileGrid* mask) {
  mesh_tiles_ = scene.solid_tiles;
  mesh_tiles_.mark(scene.disc_tiles);
  shadow_tiles_ = scene.shadows.arm_tiles();
  shadow_tiles_.mark(scene.shadows.disc_tiles());
  all_tiles_ = mesh_tiles_;
  all_tiles_.mark(shadow_tiles_);
  if (all_tiles_.empty()) return;
  shadow_layer_.draw(scene.shadows, all_tiles_);
  if (mask != nullptr) {
    mesh_tiles_.keep(*mask);
    shadow_tiles_.keep(*mask);
  }

  mesh_tiles_.for_each_run([&](const PixelRect& run) {
    for_each_row(run, width_, [&](std::size_t first, std::size_t count) {
      std::fill_n(&sum_rgba_[4 * first], 4 * count, std::uint16_t{0});
      std::fill_n(&sum_depth_[first], count, 0U);
    });
  });
  table_.stream.upload(scene.table.vertices(), scene.table.indices());
  arm_.stream.upload(scene.arm.vertices(), scene.arm.indices());
  discs_.stream.upload(scene.discs.vertices());
  target_.bind();
  glEnable(GL_DEPTH_TEST);
  outlined_ = mesh_tiles_;
  filled_.clear();
}

void Rasteriser::finish(const IdealImage& background, IdealImage& image) {
  glDisable(GL_DEPTH_TEST);
  check_gl("rendering a frame");
  if (shadow_layer_.channels() == 1) {
    compose<1>(background, image);
  } else {
    compose<4>(background, image);
  }
}

void Rasteriser::draw(const Scene& scene, const IdealImage& background, IdealImage& image) {
  begin(scene, nullptr);
  if (all_tiles_.empty()) return;
  for (std::size_t layer = 0; layer < kLayers; ++layer) {
    draw_layer(scene, layer);
    add_layer(outlined_);
    if (layer == 0) find_filled(scene);
  }
  finish(background, image);
}

void Rasteriser::draw_sample(const Scene& scene, std::size_t sample, const TileGrid& mask, const IdealImage& background,
                             IdealImage& image) {
  begin(scene, &mask);
  if (all_tiles_.empty()) return;
  draw_layer(scene, sample % kLayers);
  add_layer(outlined_);
  outlined_.for_each_run([&](const PixelRect& run) { let_one_layer_stand_for_all(run); });
  finish(background, image);
}

}  // namespace breakshot::sim_bridge
