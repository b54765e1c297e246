// SPDX-License-Identifier: Apache-2.0
#include "rig/simulate/simulate_flame.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "recon/adjust/choose_effects.h"
#include "recon/calibrate/rig.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/scene.h"
#include "recon/render/render.h"
#include "recon/temperature/emitter.h"
#include "recon/temperature/self_absorption.h"
#include "session/reader.h"
#include "tests/support/temp_folder.h"

namespace emberlock::rig {
namespace {

class SimulateFlameTest : public testing::Test {
 protected:
  static SimulateOptions small() {
    SimulateOptions o;
    o.frames = 2;
    o.cameras = 3;
    o.image = {64, 64};
    o.cells = 16;
    o.compute = {recon::Device::cpu, 1};
    return o;
  }
  /// A camera of an even response from 450 to 650 nm, as a real one's channels lie; absolute.
  static recon::CameraResponse response(double levels) {
    return {.wavelength_nm = {440, 460, 520, 550, 600, 650},
            .level = {{{0, 0, 0, 0.2 * levels, levels, 0},
                       {0, 0.1 * levels, levels, levels, 0.1 * levels, 0},
                       {0, levels, 0.2 * levels, 0, 0, 0}}},
            .absolute = true};
  }
  [[nodiscard]] recon::Volume truth(int frame) const {
    const auto volume =
        recon::read_volume(folder_ / "truth" / ("frame-000" + std::to_string(frame) + ".vdb"));
    EXPECT_TRUE(volume.ok()) << volume.error().message();
    return volume.ok() ? *volume : recon::Volume{};
  }
  [[nodiscard]] recon::Scene filmed(std::size_t frame) const {
    recon::SceneOptions options;
    options.frame = frame;
    auto scene = recon::load_scene(folder_ / "session", options);
    EXPECT_TRUE(scene.ok()) << scene.error().message();
    return scene.ok() ? *scene : recon::Scene{};
  }
  /// The greatest difference between a view's picture and the truth as its camera sees it.
  [[nodiscard]] static double off(const recon::View& view, const recon::Volume& volume,
                                  const std::array<double, 3>& absorbed) {
    recon::Effects effects;
    effects.extinction.model = recon::Extinction::Model::field;
    double most = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      recon::Volume own = volume;
      for (float& e : own.extinction) e *= static_cast<float>(absorbed[c]);
      const recon::RadianceImage seen =
          recon::render_view(own, recon::whole_grid(own.grid), effects, view.camera);
      for (std::size_t i = c; i < seen.rgb.size(); i += 3)
        most = std::max(most, static_cast<double>(std::abs(seen.rgb[i] - view.image->rgb[i])));
    }
    return most;
  }
  [[nodiscard]] static double off(const recon::View& view, const recon::Volume& volume) {
    return off(view, volume,
               recon::channel_absorption(recon::standard_response(), recon::Emitter::soot, Kelvin(1800)));
  }
  static float brightest(const recon::Scene& scene) {
    float most = 0;
    for (const recon::View& view : scene.views)
      most = std::max(most, *std::max_element(view.image->rgb.begin(), view.image->rgb.end()));
    return most;
  }
  const test::TempFolder temp_{test::TempFolder::On::disk};
  const std::filesystem::path folder_ = temp_ / "simulate-flame";
};

TEST_F(SimulateFlameTest, LeavesASessionAndItsTruth) {
  const auto film = simulate_flame(small(), folder_);
  ASSERT_TRUE(film.ok()) << film.error().message();
  EXPECT_GT(film->hottest.value(), 1500);
  EXPECT_LE(film->relative_divergence, 1e-5);
  EXPECT_GT(film->cell, film->pixel) << "a small truth";
  const double finer = small().cells * (film->cell / film->pixel);
  EXPECT_NEAR(cells_for_pictures(small().cells, *film).value_or(0), finer + 16, 16)
      << "the next multiple of 32";
  const auto scene = recon::load_scene(folder_ / "session");
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_EQ(scene->views.size(), 3U);
  const std::filesystem::path truth = folder_ / "truth" / "frame-0001.vdb";
  const auto volume = recon::read_volume(truth);
  ASSERT_TRUE(volume.ok()) << volume.error().message();
  EXPECT_GT(*std::max_element(volume->emission.begin(), volume->emission.end()), 0);
  const auto temperature = recon::read_grid(truth, "temperature");
  ASSERT_TRUE(temperature.ok());
  EXPECT_GT(*std::max_element(temperature->begin(), temperature->end()), 1500);
  const auto velocity = recon::read_grid(truth, "velocity");
  ASSERT_TRUE(velocity.ok());
  EXPECT_EQ(velocity->size(), 3 * temperature->size());
}

using SimulateFlameSlow = SimulateFlameTest;
TEST_F(SimulateFlameSlow, PicturesShowTheTruth) {
  SimulateOptions o = small();
  o.preset = recon::FlamePreset::torch;
  o.read_noise = 0;
  ASSERT_TRUE(simulate_flame(o, folder_).ok());
  const recon::Scene scene = filmed(1);
  for (const recon::View& view : scene.views) EXPECT_LT(off(view, truth(1)), 0.51);
  EXPECT_GT(off(scene.views[0], truth(0)), 1) << "another frame";
  EXPECT_NEAR(brightest(filmed(0)), 230, 0.5);
}

TEST_F(SimulateFlameTest, SmokeIsLitByTheSun) {
  SimulateOptions o = small();
  o.preset = recon::FlamePreset::smoke;
  o.read_noise = 0;
  o.sun = recon::Sun{{0, 0, 1}, 0.5};
  ASSERT_TRUE(simulate_flame(o, folder_).ok());
  for (const recon::View& view : filmed(1).views) EXPECT_LT(off(view, truth(1), {1, 1, 1}), 0.51);
  // What the topmost points scatter, of the sun that stands above: half a cell's way takes next to nothing.
  const recon::Volume volume = truth(1);
  const recon::EmitterLevels sun =
      recon::levels_of(recon::standard_response(), recon::Emitter::grey, Kelvin(5772));
  const double colour = sun.value[0] / sun.value[2];
  double most = 0;
  for (std::size_t p = 0; p < volume.extinction.size(); ++p) {
    const float* rgb = &volume.emission[3 * p];
    if (rgb[1] > 1) {
      EXPECT_NEAR(rgb[0] / rgb[2], colour, 1e-4 * colour);
    }
    most = std::max(most, static_cast<double>(rgb[1]));
  }
  EXPECT_GT(most, 100);
}

TEST_F(SimulateFlameSlow, AnAbsoluteResponseTellsTheLevels) {
  SimulateOptions o = small();
  o.read_noise = 0;
  o.response = response(500);
  const auto found = simulate_flame(o, folder_);
  ASSERT_TRUE(found.ok()) << found.error().message();
  EXPECT_NEAR(found->gain, found->exposure / SimulateOptions::kUsualExposure, 1e-12);
  EXPECT_NEAR(brightest(filmed(0)), 230, 0.5);
  const recon::Scene scene = filmed(1);
  ASSERT_TRUE(scene.response);
  EXPECT_TRUE(scene.response->absolute);
  EXPECT_NEAR(scene.response->level[1][2], 500 * found->gain, 1e-9 * found->gain);
  const auto reader = session::SessionReader::open(folder_ / "session");
  ASSERT_TRUE(reader.ok());
  EXPECT_NEAR(reader->manifest().cameras(0).colour().exposure_s(), found->exposure.value(), 1e-12);
  // Planck's law tells the brightest cell's levels.
  const recon::Volume volume = truth(1);
  const auto kelvin = recon::read_grid(folder_ / "truth" / "frame-0001.vdb", "temperature");
  ASSERT_TRUE(kelvin.ok());
  const auto& light = volume.emission;
  const std::size_t p =
      static_cast<std::size_t>(std::max_element(light.begin(), light.end()) - light.begin()) / 3;
  const recon::EmitterLevels levels =
      recon::levels_of(*scene.response, recon::Emitter::soot, Kelvin((*kelvin)[p]));
  const double expected =
      static_cast<double>(volume.extinction[p]) * levels.value[1] * std::exp(levels.log_scale);
  EXPECT_NEAR(volume.emission[3 * p + 1], expected, 1e-3 * expected);
}

TEST_F(SimulateFlameSlow, TwiceTheExposureIsTwiceTheLight) {
  SimulateOptions o = small();
  o.frames = 1;
  o.response = response(1e-6);
  std::vector<float> most;
  for (const double ms : {0.5, 1.0}) {
    o.exposure = milliseconds(ms);
    std::filesystem::remove_all(folder_);
    ASSERT_TRUE(simulate_flame(o, folder_).ok());
    const recon::Volume volume = truth(0);
    most.push_back(*std::max_element(volume.emission.begin(), volume.emission.end()));
  }
  EXPECT_NEAR(most[1] / most[0], 2, 1e-4);
}

TEST_F(SimulateFlameSlow, LateCamerasFilmLaterAndSaySo) {
  SimulateOptions o = small();
  o.preset = recon::FlamePreset::torch;
  o.read_noise = 0;
  o.offsets = milliseconds(20);
  ASSERT_TRUE(simulate_flame(o, folder_).ok());
  const recon::Scene scene = filmed(1);
  EXPECT_EQ(scene.views[0].lateness.value(), 0);
  EXPECT_LT(off(scene.views[0], truth(1)), 0.51);
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_GT(scene.views[i].lateness.value(), 0);
    EXPECT_LE(scene.views[i].lateness.value(), 0.02);
    EXPECT_GT(off(scene.views[i], truth(1)), 1);
  }
}

TEST_F(SimulateFlameSlow, StaggeredCamerasFilmAtInstantsSpreadOverThePeriod) {
  SimulateOptions o = small();
  o.frames = 4;
  o.stagger = true;
  ASSERT_TRUE(simulate_flame(o, folder_).ok());
  const double period = 1 / o.rate.value();
  for (const double part : {0.0, 0.25, 0.5}) {
    const auto scene = recon::load_scene(folder_ / "session", {.box = {}, .frame = 1, .part = part});
    ASSERT_TRUE(scene.ok()) << scene.error().message();
    EXPECT_NEAR(scene->time->value(), (1 + part) * period, 1e-6);
    std::vector<double> places;
    for (const recon::View& view : scene->views) {
      EXPECT_LE(std::abs(view.lateness.value()), period / 2 + 1e-6);
      const double turns = view.lateness.value() / period + part + 1;
      places.push_back(3 * (turns - std::floor(turns + 1e-6)));
    }
    std::sort(places.begin(), places.end());
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(places[static_cast<std::size_t>(i)], i, 1e-4);
  }
}

TEST_F(SimulateFlameTest, TheDriversSensorMakesThePictures) {
  SimulateOptions o = small();
  o.frames = 1;
  o.format = PixelFormat::bayer_rggb16;
  o.read_noise = 3;
  ASSERT_TRUE(simulate_flame(o, folder_).ok());
  auto reader = session::SessionReader::open(folder_ / "session");
  ASSERT_TRUE(reader.ok());
  const auto frame = reader->read(0, 0);
  ASSERT_TRUE(frame.ok()) << frame.error().message();
  EXPECT_EQ(frame->image->layout().format, PixelFormat::bayer_rggb16);
  // The corner is dark: half of the normal numbers are above 0, of RMS 3 levels of 257.
  double square = 0;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) square += std::pow(frame->image->view().sample(x, y, 0) / 257.0, 2) / 256;
  EXPECT_NEAR(square, 4.5, 1.5);
}

TEST_F(SimulateFlameTest, AGreySensorShowsTheLuminanceOfItsResponse) {
  SimulateOptions o = small();
  o.frames = 1;
  o.read_noise = 0;
  o.format = PixelFormat::gray8;
  o.response = response(500);
  const recon::CameraResponse told = *o.response;
  const auto found = simulate_flame(o, folder_);
  ASSERT_TRUE(found.ok()) << found.error().message();
  EXPECT_NEAR(brightest(filmed(0)), 230, 1);
  const recon::Scene scene = filmed(0);
  ASSERT_TRUE(scene.response);
  for (std::size_t i = 0; i < told.wavelength_nm.size(); ++i) {
    const double grey =
        found->gain * (0.2126 * told.level[0][i] + 0.7152 * told.level[1][i] + 0.0722 * told.level[2][i]);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(scene.response->level[c][i], grey, 1e-9 * grey) << i;
  }
}

TEST_F(SimulateFlameTest, SaysHowManyCellsAreFinerThanThePictures) {
  SimulatedFilm film;
  film.cell = Meters(0.004);
  film.pixel = Meters(0.001);
  EXPECT_EQ(cells_for_pictures(64, film), 288) << "256 would be as coarse as a pixel";
  film.pixel = Meters(0.0004);
  EXPECT_FALSE(cells_for_pictures(64, film).has_value());
}

/// So that what is finer than a flame's slow settling costs no time in it.
TEST_F(SimulateFlameSlow, FineGridsBeginOnCoarseOnes) {
  SimulateOptions o = small();
  o.preset = recon::FlamePreset::two_plumes;
  o.frames = 1;
  o.cells = 32;
  double fraction = 0;
  const auto film = simulate_flame(o, folder_, [&](double now, std::string_view /*what*/) {
    EXPECT_GE(now, fraction);
    fraction = now;
    return true;
  });
  ASSERT_TRUE(film.ok()) << film.error().message();
  EXPECT_NEAR(film->cell.value(), 0.6 / 32, 1e-12);
  EXPECT_LE(film->relative_divergence, 1e-5);
  EXPECT_EQ(truth(0).grid.nx, 32);
}

/// A thin bright sheet, which coarse grids can't show, looks as if it took light. With 56 / m of extinction
/// instead of 1 its emission was off by 68 %.
TEST_F(SimulateFlameSlow, ACandleIsNotTakenForAThickMedium) {
  SimulateOptions o = small();
  o.frames = 1;
  o.cameras = 10;
  o.cells = 32;
  o.image = {320, 240};
  ASSERT_TRUE(simulate_flame(o, folder_).ok());
  auto scene = recon::load_scene(folder_ / "session");
  ASSERT_TRUE(scene.ok());
  scene->views.back().role = recon::ViewRole::held_out;
  const recon::Grid grid = recon::grid_over(scene->box, 64);
  const auto choice = recon::choose_effects(*scene, grid, {}, {});
  ASSERT_TRUE(choice.ok()) << choice.error().message();
  const std::string& reason = choice->reports[0].reason;
  EXPECT_EQ(choice->effects.extinction.model, recon::Extinction::Model::none) << reason;
  const auto done = recon::solve(*scene, grid, choice->effects, {});
  ASSERT_TRUE(done.ok()) << done.error().message();
  const recon::Volume whole = truth(0);
  const auto light = [](const recon::Volume& volume) {
    double sum = 0;
    for (const float e : volume.emission) sum += static_cast<double>(e);
    return sum * std::pow(static_cast<double>(volume.grid.edge), 3);
  };
  EXPECT_NEAR(light(done->volume), light(whole), 0.1 * light(whole));
}

TEST_F(SimulateFlameTest, RefusesWhatCannotBeFilmed) {
  SimulateOptions sunny = small();
  sunny.sun = recon::Sun{};
  EXPECT_EQ(simulate_flame(sunny, folder_).error().kind, ErrorKind::bad_input);
  SimulateOptions late = small();
  late.offsets = milliseconds(30);
  EXPECT_EQ(simulate_flame(late, folder_).error().kind, ErrorKind::bad_input);
  SimulateOptions slow = small();
  slow.exposure = milliseconds(1);
  EXPECT_THAT(simulate_flame(slow, folder_).error().message(), testing::HasSubstr("a scale"));
  slow.response = response(500);
  slow.exposure = Seconds(1);
  EXPECT_THAT(simulate_flame(slow, folder_).error().message(), testing::HasSubstr("frame period"));
  SimulateOptions odd = small();
  odd.image = {63, 64};
  EXPECT_EQ(simulate_flame(odd, folder_).error().kind, ErrorKind::bad_input);
  SimulateOptions none = small();
  none.frames = 0;
  EXPECT_EQ(simulate_flame(none, folder_).error().kind, ErrorKind::bad_input);
}

TEST_F(SimulateFlameTest, EndsEarlyAsAsked) {
  const auto film = simulate_flame(small(), folder_, [](double, std::string_view) { return false; });
  ASSERT_FALSE(film.ok());
  EXPECT_EQ(film.error().kind, ErrorKind::refused);
}

}  // namespace
}  // namespace emberlock::rig
