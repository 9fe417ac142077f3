#include "sim_bridge/camera/shadow_layer.hpp"

#include "sim_bridge/camera/light_program.hpp"
#include "sim_bridge/camera/shaders.hpp"

#include <algorithm>
#include <array>
#include <cmath>

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
    : channels_{light.coloured ? std::size_t{4} : std::size_t{1}},
      format_{light.coloured ? GLenum{GL_RGBA} : GLenum{GL_RED}},
      width_{projector.model().width},
      height_{projector.model().height},
      coarse_width_{(width_ + kCoarse - 1) / kCoarse},
      coarse_height_{(height_ + kCoarse - 1) / kCoarse},
      arm_program_{"arm shadow",
                   {light_definitions(light, {}).c_str(), shaders::kLight, shaders::kShadowCommon, shaders::kArmShadowVertex},
                   {light_definitions(light, {}).c_str(), shaders::kLight, shaders::kShadowOutput, shaders::kArmShadowFragment}},
      disc_program_{"disc shadows",
                    {light_definitions(light, {}).c_str(), shaders::kLight, shaders::kShadowCommon, shaders::kDiscShadowVertex},
                    {light_definitions(light, {}).c_str(), shaders::kLight, shaders::kShadowOutput, shaders::kDiscShadowFragment}},
      arm_stream_{4, 2, 3, 4, 4},
      disc_stream_{4, 2, 4},
      coarse_target_{coarse_width_, coarse_height_, {light.coloured ? GLenum{GL_RGBA8} : GLenum{GL_R8}}, false},
      target_{width_, height_, {light.coloured ? GLenum{GL_RGBA8} : GLenum{GL_R8}}, false},
      coarse_(channels_ * area(coarse_width_, coarse_height_)),
      coarse_lamp_(light.lamps.size() > 1 ? coarse_.size() : 0),
      coarse_loss_(coarse_lamp_.size()),
      coarse_row_(channels_ * static_cast<std::size_t>(coarse_width_)),
      run_factors_(channels_ * area(width_, TileGrid::kTile)),
      factors_(channels_ * area(width_, height_)) {
  for (const Program* program : {&arm_program_, &disc_program_}) {
    set_light(*program, light, {});
    program->set("table_half", Vector2{0.5 * table.size});
  }
  // The coarse image reaches beyond the fine one where its size is no multiple of kCoarse.
  arm_program_.use();
  arm_program_.set(
      "fit", Vector2{static_cast<double>(width_) / (kCoarse * coarse_width_), static_cast<double>(height_) / (kCoarse * coarse_height_)});
}

void ShadowLayer::draw_arm(const ShadowMesh& shadows, std::size_t lamp) {
  glClear(GL_COLOR_BUFFER_BIT);
  arm_program_.set("lamp", static_cast<int>(lamp));
  arm_stream_.upload(shadows.arm_vertices(lamp));
  arm_stream_.draw(shadows.arm_vertices(lamp).size());
}

void ShadowLayer::draw_arm(const ShadowMesh& shadows) {
  coarse_target_.bind();
  glEnable(GL_BLEND);
  glBlendEquation(GL_MIN);  // a point in the shadow of two links is in the shadow of one arm
  arm_program_.use();
  if (shadows.lamps() == 1) {
    draw_arm(shadows, 0);
    glReadPixels(0, 0, coarse_width_, coarse_height_, format_, GL_UNSIGNED_BYTE, coarse_.data());
  } else {
    // Each lamp's light is lost by itself.
    std::fill(coarse_loss_.begin(), coarse_loss_.end(), 0.0F);
    for (std::size_t lamp = 0; lamp < shadows.lamps(); ++lamp) {
      if (shadows.arm_vertices(lamp).empty()) continue;
      draw_arm(shadows, lamp);
      glReadPixels(0, 0, coarse_width_, coarse_height_, format_, GL_UNSIGNED_BYTE, coarse_lamp_.data());
      for (std::size_t i = 0; i < coarse_loss_.size(); ++i) {
        const auto encoded = static_cast<float>(coarse_lamp_[i]) / 255.0F;
        coarse_loss_[i] += 1.0F - encoded * encoded;
      }
    }
    std::transform(coarse_loss_.begin(), coarse_loss_.end(), coarse_.begin(),
                   [](float loss) { return static_cast<std::uint8_t>(std::lround(255.0F * std::sqrt(std::max(1.0F - loss, 0.0F)))); });
  }
  glDisable(GL_BLEND);
  shadows.arm_tiles().for_each_run([&](const PixelRect& run) { channels_ == 1 ? enlarge<1>(run) : enlarge<4>(run); });
}

template <std::size_t kChannels>
void ShadowLayer::enlarge(const PixelRect& run) {
  const int first = std::max(run.x / kCoarse - 1, 0), last = std::min((run.x + run.width) / kCoarse + 1, coarse_width_ - 1);
  const auto index = [&](int column) { return kChannels * static_cast<std::size_t>(column); };
  for (int y = run.y; y < run.y + run.height; ++y) {
    const std::uint32_t weight = kNeighbour[static_cast<std::size_t>(y % kCoarse)];
    const std::uint8_t* row = &coarse_[index(y / kCoarse * coarse_width_)];
    const std::uint8_t* other = &coarse_[index(std::clamp(neighbour_of(y), 0, coarse_height_ - 1) * coarse_width_)];
    for (std::size_t i = index(first); i < index(last + 1); ++i) {
      coarse_row_[i] = static_cast<std::uint16_t>((8 - weight) * row[i] + weight * other[i]);
    }

    std::uint8_t* out = &factors_[index(y * width_)];
    for (int x = run.x; x < run.x + run.width; ++x) {
      const std::uint32_t across = kNeighbour[static_cast<std::size_t>(x % kCoarse)];
      const std::uint16_t* here = &coarse_row_[index(x / kCoarse)];
      const std::uint16_t* beside = &coarse_row_[index(std::clamp(neighbour_of(x), first, last))];
      for (std::size_t c = 0; c < kChannels; ++c) {
        out[index(x) + c] = static_cast<std::uint8_t>(((8 - across) * here[c] + across * beside[c] + 32) / 64);
      }
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
    glReadPixels(run.x, run.y, run.width, run.height, format_, GL_UNSIGNED_BYTE, run_factors_.data());
    for (int row = 0; row < run.height; ++row) {
      std::uint8_t* factor = &factors_[channels_ * pixel_index(run.x, run.y + row, width_)];
      const std::uint8_t* disc = &run_factors_[channels_ * pixel_index(0, row, run.width)];
      for (std::size_t i = 0; i < channels_ * static_cast<std::size_t>(run.width); ++i) {
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
      std::fill_n(&factors_[channels_ * pixel_index(run.x, row, width_)], channels_ * static_cast<std::size_t>(run.width),
                  std::uint8_t{255});
    }
  });
  if (shadows.has_arm()) draw_arm(shadows);
  if (!shadows.disc_vertices().empty()) draw_discs(shadows);
}

}  // namespace breakshot::sim_bridge
