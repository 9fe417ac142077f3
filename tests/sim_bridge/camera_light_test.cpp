// Lamps, their colours, highlights, and what changes with time.

#include "common/config/config_node.hpp"
#include "sim_bridge/camera/changing_light.hpp"
#include "sim_bridge/camera/light.hpp"
#include "sim_bridge/camera/lighting.hpp"
#include "tests/sim_bridge/camera_picture.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace breakshot::sim_bridge {
namespace {

using support::disc_at;
using support::rack_of_six;
using support::SceneRenderer;
using testing::HasSubstr;

const std::filesystem::path kPresets = BREAKSHOT_SOURCE_DIR "/config/lighting";

Time at_seconds(double seconds) { return Time{from_seconds(seconds)}; }

/// A picture of a camera at a time of the world.
std::vector<std::uint8_t> picture(const CameraSettings& settings, Time stamp, const std::vector<DiscState>& discs) {
  Camera camera{support::cell_camera(), settings, {}, Pose::Identity()};
  std::vector<std::uint8_t> rgb(3 * 1280 * 720);
  std::vector<std::uint16_t> depth(1280 * 720);
  WorldSnapshot snapshot;
  snapshot.stamp = stamp;
  snapshot.discs = discs;
  camera.render(snapshot, 1, rgb, depth);
  return rgb;
}

TEST(CameraLight, ALampsTemperatureShiftsTheChannelsAsPlanckSays) {
  // Wien's approximation of Planck's law is within a percent here: ln(R/B) falls with 1/T at a slope that only the wavelengths set.
  const auto red_over_blue = [](double kelvin) {
    const Vector3 colour = black_body(kelvin, 6500.0);
    return std::log(colour.x() / colour.z());
  };
  const double slope = 1.438776877e-2 * (1.0 / 460e-9 - 1.0 / 600e-9);
  for (const double kelvin : {2700.0, 3200.0, 4600.0, 5600.0}) {
    EXPECT_NEAR(red_over_blue(kelvin), slope * (1.0 / kelvin - 1.0 / 6500.0), 0.03) << kelvin;
    EXPECT_GT(red_over_blue(kelvin), 0.0);
  }
  EXPECT_LT(red_over_blue(9000.0), 0.0);
  EXPECT_EQ(black_body(4600.0, 4600.0), Vector3::Ones().eval());
}

TEST(CameraLight, ThePictureOfAGreyTableHasThoseChannels) {
  CameraSettings settings = plain_settings();
  settings.table.rgb = {0.5F, 0.5F, 0.5F};
  settings.light.balanced_kelvin = 4600.0;
  settings.light.ambient = 0.0;
  for (const double kelvin : {3600.0, 4600.0, 6500.0}) {
    settings.light.lamps[0].kelvin = kelvin;
    SceneRenderer renderer{settings};
    const auto grey = colour_at(renderer.take({}).color, {640, 360});
    const Vector3 expected = black_body(kelvin, 4600.0);
    // Values are encoded by a square root.
    EXPECT_NEAR(std::pow(1.0 * grey[0] / grey[1], 2), expected.x(), 0.03) << kelvin;
    EXPECT_NEAR(std::pow(1.0 * grey[2] / grey[1], 2), expected.z(), 0.03) << kelvin;
  }
}

TEST(CameraLight, TwoLampsThrowTwoShadowsEachOfItsShareAndColour) {
  CameraSettings settings = plain_settings();
  settings.table.rgb = {0.6F, 0.6F, 0.6F};
  settings.light.shadows = true;
  settings.light.ambient = 0.3;
  settings.light.balanced_kelvin = 4600.0;
  settings.light.ambient_kelvin = 4600.0;
  settings.light.lamps = {{{1.0, 0.0, 1.0}, 0.03, 2.0, 3200.0}, {{-1.0, 0.0, 1.0}, 0.03, 1.0, 6000.0}};
  SceneRenderer renderer{settings};
  const auto disc = disc_at(0.0, 0.0, 2);
  const auto scene = renderer.take({&disc, 1}), bare = renderer.take({});
  const auto light_at = [&](const ColorFrame& frame, double x) {
    const auto colour = colour_at(frame, *scene.camera.project({x, 0.0, 0.0}));
    return Vector3{std::pow(colour[0] / 255.0, 2), std::pow(colour[1] / 255.0, 2), std::pow(colour[2] / 255.0, 2)};
  };
  const Light light{settings.light};
  for (const auto& [x, lamp] : {std::pair{-0.043, 0}, std::pair{0.043, 1}}) {
    const Vector3 left = light_at(scene.color, x).cwiseQuotient(light_at(bare.color, x));
    const Vector3 all = light.ambient + light.lamps[0].level + light.lamps[1].level;
    const Vector3 expected = Vector3::Ones() - light.lamps[static_cast<std::size_t>(lamp)].level.cwiseQuotient(all);
    EXPECT_LT((left - expected).cwiseAbs().maxCoeff(), 0.06) << "at " << x << ": " << left.transpose() << " for " << expected.transpose();
  }
}

TEST(CameraLight, OneLampGivenAsTwoHalvesIsOneLamp) {
  CameraSettings one = plain_settings(), two = plain_settings();
  one.light.shadows = two.light.shadows = true;
  two.light.lamps.push_back(two.light.lamps.front());
  SceneRenderer a{one}, b{two};
  const auto first = a.take(rack_of_six({0.0, 0.0})), second = b.take(rack_of_six({0.0, 0.0}));
  int largest = 0;
  for (std::size_t i = 0; i < first.color.rgb.size(); ++i) largest = std::max(largest, std::abs(first.color.rgb[i] - second.color.rgb[i]));
  EXPECT_LE(largest, 1);
  EXPECT_EQ(first.depth.depth, second.depth.depth);
}

TEST(CameraLight, AHighlightLiesWhereTheTopMirrorsTheLamp) {
  CameraSettings settings = plain_settings();
  settings.light.lamps[0].towards_W = {0.12, 0.08, 1.0};
  settings.shine = {2.0, 400.0};
  SceneRenderer shiny{settings};
  settings.shine.strength = 0.0;
  SceneRenderer matt{settings};
  // The camera is 0.78 m over the tops, straight above W's origin.
  const Vector2 mirror{0.12 * 0.78, 0.08 * 0.78};
  const auto disc = disc_at(mirror.x(), mirror.y(), 0);
  const auto with = shiny.take({&disc, 1}), without = matt.take({&disc, 1});
  const auto gain = [&](double x, double y) {
    const Vector2 pixel = *with.camera.project({x, y, 0.02});
    return colour_at(with.color, pixel)[1] - colour_at(without.color, pixel)[1];
  };
  EXPECT_GT(gain(mirror.x(), mirror.y()), 80);
  EXPECT_GT(gain(mirror.x(), mirror.y()), gain(mirror.x() + 0.02, mirror.y()));
  EXPECT_GT(gain(mirror.x(), mirror.y()), gain(mirror.x(), mirror.y() - 0.02));
  const auto far = disc_at(-0.2, -0.2, 0);
  EXPECT_NEAR(colour_at(shiny.take({&far, 1}).color, *with.camera.project({-0.2, -0.2, 0.02}))[1],
              colour_at(matt.take({&far, 1}).color, *with.camera.project({-0.2, -0.2, 0.02}))[1], 1);
}

TEST(CameraLight, BrightnessRampsToItsFactorAndBack) {
  const Drift drift{{.brightness_ramp = 4.0, .brightness_ramp_time = 10.0}, 1};
  const Exposure exposure{0.5, {1.0, 1.0, 1.0}};
  EXPECT_NEAR(drift.at(exposure, at_seconds(0.0)).brightness, 0.5, 1e-9);
  EXPECT_NEAR(drift.at(exposure, at_seconds(5.0)).brightness, 1.25, 1e-6);
  EXPECT_NEAR(drift.at(exposure, at_seconds(10.0)).brightness, 2.0, 1e-6);
  EXPECT_NEAR(drift.at(exposure, at_seconds(15.0)).brightness, 1.25, 1e-6);
  EXPECT_EQ(drift.at({4.0, {1.0, 1.0, 1.0}}, at_seconds(10.0)).brightness, kMaxBrightness);
}

TEST(CameraLight, WhiteBalanceSwingsWithinItsShareBySeed) {
  const DriftSettings settings{.white_balance = 0.08, .white_balance_period = 20.0};
  const Drift drift{settings, 3}, same{settings, 3}, other{settings, 4};
  double low = 1.0, high = 1.0;
  for (double t = 0.0; t < 20.0; t += 0.1) {
    const Exposure exposure = drift.at({}, at_seconds(t));
    EXPECT_EQ(exposure.white_balance, same.at({}, at_seconds(t)).white_balance);
    EXPECT_EQ(exposure.white_balance[1], 1.0);
    low = std::min(low, exposure.white_balance[0]);
    high = std::max(high, exposure.white_balance[0]);
  }
  EXPECT_NEAR(low, 0.92, 1e-3);
  EXPECT_NEAR(high, 1.08, 1e-3);
  EXPECT_NE(drift.at({}, at_seconds(1.0)).white_balance, other.at({}, at_seconds(1.0)).white_balance);
}

TEST(CameraLight, TheMovingShadowTakesItsShareWhereItIsAndMovesAtItsSpeed) {
  CameraSettings settings = plain_settings();
  const auto lit = picture(settings, at_seconds(0.0), {});
  settings.moving_shadow = {.depth = 0.8, .width = 0.2, .edge = 0.1, .speed = 0.2, .direction = 0.0};
  const CameraModel model = support::cell_camera();
  const MovingShadow band{settings.moving_shadow, Light{settings.light}, Projector{model}, settings.seed};
  // A time at which it is over the middle.
  double t = 0.0;
  while (std::abs(band.place(at_seconds(t))) > 0.002) t += 0.01;
  EXPECT_NEAR(std::abs(band.place(at_seconds(t + 0.5)) - band.place(at_seconds(t))), 0.1, 1e-6);
  const auto shaded = picture(settings, at_seconds(t), {});
  const auto ratio = [&](double x) {
    const Vector2 pixel = *model.project({x, 0.0, 0.0});
    const auto i = 3 * static_cast<std::size_t>(std::lround(pixel.y()) * model.width + std::lround(pixel.x()));
    return std::pow(1.0 * shaded[i] / lit[i], 2);
  };
  EXPECT_NEAR(ratio(0.0), 1.0 - 0.8 * 0.55, 0.02) << "0.55 of the light is the lamp's";
  EXPECT_NEAR(ratio(0.08), ratio(0.0), 0.01) << "its darkest part is 0.2 m wide";
  EXPECT_NEAR(ratio(0.15), 0.5 * (1.0 + ratio(0.0)), 0.04) << "the middle of the edge";
  EXPECT_EQ(ratio(0.25), 1.0);
  EXPECT_EQ(ratio(-0.25), 1.0);
}

TEST(CameraLight, EachEffectThatIsOffLeavesEveryBitAlone) {
  const auto discs = rack_of_six({0.0, 0.0});
  const auto reference = picture({}, at_seconds(3.0), discs);
  CameraSettings off;
  off.drift.brightness_ramp_time = 3.0;
  off.drift.white_balance_period = 3.0;
  off.moving_shadow.speed = 2.0;
  off.moving_shadow.width = 1.0;
  off.shine.gloss = 5.0;
  EXPECT_EQ(picture(off, at_seconds(3.0), discs), reference);
  EXPECT_EQ(picture({}, at_seconds(77.0), discs), reference) << "without what changes, time does not matter";
  CameraSettings shifted;  // white is what the camera is balanced for
  shifted.light.balanced_kelvin = shifted.light.ambient_kelvin = shifted.light.lamps[0].kelvin = 3000.0;
  EXPECT_EQ(picture(shifted, at_seconds(3.0), discs), reference);
}

TEST(CameraLight, EveryPresetReadsAndGivesTheSamePictureTwice) {
  const auto names = lighting_names(kPresets);
  for (const char* wanted : {"reference", "dim", "bright", "warm", "cold", "two_lamps", "side_lamp", "moving_shadow", "glare", "drift"}) {
    EXPECT_TRUE(std::find(names.begin(), names.end(), wanted) != names.end()) << wanted;
  }
  for (const std::string& name : names) {
    CameraSettings settings;
    apply_lighting(kPresets, name, settings);
    const auto discs = rack_of_six({0.0, 0.0});
    EXPECT_EQ(picture(settings, at_seconds(5.0), discs), picture(settings, at_seconds(5.0), discs)) << name;
  }
}

TEST(CameraLight, APresetThatIsNotThereOrNotRightIsRefusedAndChangesNothing) {
  CameraSettings settings;
  settings.light.ambient = 0.123;
  const auto error_of = [&](const std::filesystem::path& folder, const char* name) -> std::string {
    try {
      apply_lighting(folder, name, settings);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(error_of(kPresets, "disco"), testing::AllOf(HasSubstr("lighting \"disco\""), HasSubstr("two_lamps")));
  EXPECT_THAT(error_of("/nonexistent", "dim"), HasSubstr("cannot be read"));
  EXPECT_THAT(error_of(kPresets, "../cell"), HasSubstr("no such file"));
  EXPECT_EQ(settings.light.ambient, 0.123);
}

TEST(CameraLight, RefusesSettingsOutOfRange) {
  const auto refuses = [](auto change) {
    LightSettings settings;
    change(settings);
    EXPECT_THROW(Light{settings}, CameraError);
  };
  refuses([](LightSettings& s) { s.lamps.clear(); });
  refuses([](LightSettings& s) { s.lamps.resize(kMaxLamps + 1); });
  refuses([](LightSettings& s) { s.lamps[0].kelvin = 10.0; });
  refuses([](LightSettings& s) { s.lamps[0].share = 0.0; });
  refuses([](LightSettings& s) { s.ambient = 1.5; });
  EXPECT_THROW(Drift({.brightness_ramp = 0.0}, 1), CameraError);
  EXPECT_THROW(Drift({.white_balance = std::nan("")}, 1), CameraError);
  EXPECT_THROW(MovingShadow({.depth = 1.1}, Light{{}}, Projector{support::cell_camera()}, 1), CameraError);
}

}  // namespace
}  // namespace breakshot::sim_bridge
