#include "sim_bridge/camera/shadow_layer.hpp"

#include "sim_bridge/camera/shaders.hpp"

#include <algorithm>
#include <array>

namespace breakshot::sim_bridge {
namespace {

/// Pixels per side of one coarse pixel.
constexpr int kCoarse = 4;
/// Weight, in eighths, of the neighbour on the nearer side for each of the four pixels in a coarse one: their centres are 3/8 and 1/8 from its centre.
constexpr std::array<std::uint32_t, kCoarse> kNeighbour{3, 1, 1, 3};

/// The coarse pixel around a pixel and its neighbour on the nearer side, which may be one outside the image.
constexpr int neighbour_of(int pixel) { return pixel / kCoarse + (pixel % kCoarse < kCoarse / 2 ? -1 : 1); }

}  // namespace

ShadowLayer::ShadowLayer(const Projector& projector, const Light& light, const TableSettings& table)
    : width_{projector.model().width},
      height_{projector.model().height},
      coarse_width_{(width_ + kCoarse - 1) / kCoarse},
      coarse_height_{(height_ + kCoarse - 1) / kCoarse},
      arm_program_{"arm shadow",
                   {shaders::kLight, shaders::kShadowCommon, shaders::kArmShadowVertex},
                   {shaders::kLight, shaders::kArmShadowFragment}},
      disc_program_{"disc shadows",
                    {shaders::kLight, shaders::kShadowCommon, shaders::kDiscShadowVertex},
                    {shaders::kLight, shaders::kDiscShadowFragment}},
      arm_stream_{4, 2, 3, 4, 4},
      disc_stream_{4, 2, 4},
      coarse_target_{coarse_width_, coarse_height_, {GL_R8}, false},
      target_{width_, height_, {GL_R8}, false},
      coarse_(static_cast<std::size_t>(coarse_width_ * coarse_height_)),
      coarse_row_(static_cast<std::size_t>(coarse_width_)),
      run_factors_(static_cast<std::size_t>(width_ * TileGrid::kTile)),
      factors_(static_cast<std::size_t>(width_ * height_)) {
  for (const Program* program : {&arm_program_, &disc_program_}) {
    program->use();
    program->set("light_W", light.direction_W);
    program->set("tan_softness", light.tan_softness);
    program->set("ambient", light.ambient);
    program->set("table_half", Vector2{0.5 * table.size});
  }
  // The coarse image reaches beyond the fine one where its size is no multiple of kCoarse.
  arm_program_.use();
  arm_program_.set(
      "fit", Vector2{static_cast<double>(width_) / (kCoarse * coarse_width_), static_cast<double>(height_) / (kCoarse * coarse_height_)});
}

void ShadowLayer::draw_arm(const ShadowMesh& shadows) {
  coarse_target_.bind();
  glClear(GL_COLOR_BUFFER_BIT);
  glEnable(GL_BLEND);
  glBlendEquation(GL_MIN);  // a point in the shadow of two links is in the shadow of one arm
  arm_program_.use();
  arm_stream_.upload(shadows.arm_vertices());
  arm_stream_.draw(shadows.arm_vertices().size());
  glDisable(GL_BLEND);
  glReadPixels(0, 0, coarse_width_, coarse_height_, GL_RED, GL_UNSIGNED_BYTE, coarse_.data());
  shadows.arm_tiles().for_each_run([&](const PixelRect& run) { enlarge(run); });
}

void ShadowLayer::enlarge(const PixelRect& run) {
  const int first = std::max(run.x / kCoarse - 1, 0), last = std::min((run.x + run.width) / kCoarse + 1, coarse_width_ - 1);
  for (int y = run.y; y < run.y + run.height; ++y) {
    const std::uint32_t weight = kNeighbour[static_cast<std::size_t>(y % kCoarse)];
    const std::uint8_t* row = &coarse_[static_cast<std::size_t>(y / kCoarse * coarse_width_)];
    const std::uint8_t* other = &coarse_[static_cast<std::size_t>(std::clamp(neighbour_of(y), 0, coarse_height_ - 1) * coarse_width_)];
    for (int i = first; i <= last; ++i)
      coarse_row_[static_cast<std::size_t>(i)] = static_cast<std::uint16_t>((8 - weight) * row[i] + weight * other[i]);

    std::uint8_t* out = &factors_[static_cast<std::size_t>(y * width_)];
    for (int x = run.x; x < run.x + run.width; ++x) {
      const std::uint32_t across = kNeighbour[static_cast<std::size_t>(x % kCoarse)];
      const std::uint32_t here = coarse_row_[static_cast<std::size_t>(x / kCoarse)];
      const std::uint32_t beside = coarse_row_[static_cast<std::size_t>(std::clamp(neighbour_of(x), first, last))];
      out[x] = static_cast<std::uint8_t>(((8 - across) * here + across * beside + 32) / 64);
    }
  }
}

void ShadowLayer::draw_discs(const ShadowMesh& shadows) {
  target_.bind();
  glEnable(GL_SCISSOR_TEST);
  shadows.disc_tiles().for_each_run([&](const PixelRect& run) {
    glScissor(run.x, run.y, run.width, run.height);
    glClear(GL_COLOR_BUFFER_BIT);
  });
  glDisable(GL_SCISSOR_TEST);
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_DST_COLOR, GL_ZERO);  // the shadows of two discs multiply
  disc_program_.use();
  disc_stream_.upload(shadows.disc_vertices());
  disc_stream_.draw(shadows.disc_vertices().size());
  glDisable(GL_BLEND);

  shadows.disc_tiles().for_each_run([&](const PixelRect& run) {
    glReadPixels(run.x, run.y, run.width, run.height, GL_RED, GL_UNSIGNED_BYTE, run_factors_.data());
    for (int row = 0; row < run.height; ++row) {
      std::uint8_t* factor = &factors_[static_cast<std::size_t>((run.y + row) * width_ + run.x)];
      const std::uint8_t* disc = &run_factors_[static_cast<std::size_t>(row * run.width)];
      for (int i = 0; i < run.width; ++i) {
        // Multiplies two shares of 255, exact at both ends.
        const int product = factor[i] * disc[i] + 128;
        factor[i] = static_cast<std::uint8_t>((product + (product >> 8)) >> 8);
      }
    }
  });
}

void ShadowLayer::draw(const ShadowMesh& shadows, const TileGrid& tiles) {
  tiles.for_each_run([&](const PixelRect& run) {
    for (int row = run.y; row < run.y + run.height; ++row) {
      std::fill_n(&factors_[static_cast<std::size_t>(row * width_ + run.x)], run.width, std::uint8_t{255});
    }
  });
  if (!shadows.arm_vertices().empty()) draw_arm(shadows);
  if (!shadows.disc_vertices().empty()) draw_discs(shadows);
}

}  // namespace breakshot::sim_bridge
