// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/response_fit.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "base/random.h"
#include "recon/kernels/planck.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
using testing::HasSubstr;

/// Three lobes, 380 to 780 nm, relative.
CameraResponse fit_camera(double scale = 1, std::array<double, 3> shift = {},
                          std::array<double, 3> width = {1, 1, 1}) {
  constexpr std::array kMiddle = {600.0, 540.0, 460.0};
  constexpr std::array kWidth = {30.0, 32.0, 25.0};
  CameraResponse response;
  for (double nm = 330; nm <= 830; nm += 2) {
    response.wavelength_nm.push_back(nm);
    for (std::size_t c = 0; c < 3; ++c)
      response.level[c].push_back(
          scale / width[c] *
          std::exp(-0.5 * std::pow((nm - kMiddle[c] - shift[c]) / (kWidth[c] * width[c]), 2)));
  }
  return response;
}

GlowReading glow_seen(const CameraResponse& camera, double kelvin, double error = 0.002,
                      const KnownEmitter& emitter = {}) {
  GlowReading reading;
  reading.temperature = Kelvin(kelvin);
  for (std::size_t c = 0; c < 3; ++c) {
    reading.level[c] = integral(camera, c, [&](double nm) {
      return emittance(emitter, nm, Kelvin(kelvin)) * std::exp(log_planck(nm, kelvin));
    });
    reading.sigma[c] = error * std::max(1e-3, reading.level[c]);
  }
  return reading;
}

ResponseFitOptions exact_levels() {
  ResponseFitOptions options;
  options.floor = 1e-9;
  return options;
}

TEST(TungstenEmissivity, MeetsAtItsSeamsAndIsNearDeVos) {
  for (const double t : {1600.0, 2000.0, 2400.0})
    for (const double nm : {450.0, 680.0})
      EXPECT_NEAR(tungsten_emissivity(nm - 1e-9, Kelvin(t)), tungsten_emissivity(nm, Kelvin(t)), 3e-4);
  struct Row {
    double nm, kelvin, value;
  };
  // De Vos 1954; Larrabee discusses why his own are up to 2.5 % lower.
  for (const Row& row :
       {Row{500, 1600, 0.469}, Row{600, 2000, 0.448}, Row{700, 2000, 0.436}, Row{400, 2400, 0.468}})
    EXPECT_NEAR(tungsten_emissivity(row.nm, Kelvin(row.kelvin)) / row.value, 0.985, 0.02) << row.nm;
  EXPECT_EQ(tungsten_emissivity(900, Kelvin(3000)), tungsten_emissivity(800, Kelvin(2400)));
}

TEST(ResponseFit, EmittersAreReadByName) {
  EXPECT_EQ(parse_known_emitter("furnace")->emissivity, 1);
  EXPECT_EQ(parse_known_emitter("tungsten")->kind, KnownEmitter::Kind::tungsten);
  EXPECT_EQ(parse_known_emitter("0.4")->emissivity, 0.4);
  for (const char* word : {"", "0", "1.1", "nan", "-1", "0.4x", "soot"})
    EXPECT_THAT(parse_known_emitter(word), FailsWith("tungsten")) << word;
}

TEST(ResponseFit, FourTemperaturesTellShiftWidthAndScale) {
  const CameraResponse camera = fit_camera(3e-3, {8, -6, 5}, {1.1, 0.9, 1.05});
  std::vector<GlowReading> readings;
  for (const double t : {1400.0, 1800.0, 2400.0, 3200.0}) readings.push_back(glow_seen(camera, t, 1e-5));
  const auto fit = value_of(fit_response(readings, fit_camera(), exact_levels()));
  EXPECT_TRUE(fit.response.absolute);
  EXPECT_LT(fit.chi_square, 10);
  const std::array shift = {8.0, -6.0, 5.0};
  const std::array width = {1.1, 0.9, 1.05};
  for (std::size_t c = 0; c < 3; ++c) {
    const FittedChannel& channel = fit.channels[c];
    EXPECT_NEAR(channel.shift.value, shift[c], 2 * channel.shift.sigma + 0.05);
    EXPECT_NEAR(channel.width.value, width[c], 2 * channel.width.sigma + 0.01);
    EXPECT_NEAR(channel.scale.value / 3e-3, 1, 2 * channel.scale.sigma + 0.005);
    EXPECT_GT(channel.shift.by_data, 0.9);
    // What it says of a flame's temperature is what the camera shows.
    const GlowReading flame = glow_seen(camera, 2000);
    const double told = integral(fit.response, c, [](double nm) { return std::exp(log_planck(nm, 2000)); });
    EXPECT_NEAR(told / flame.level[c], 1, 3e-4);
  }
}

TEST(ResponseFit, TheResponseIsTheOnePredictedFrom) {
  const auto fit = value_of(fit_response(
      {glow_seen(fit_camera(1e-3, {5, 5, 5}), 1700), glow_seen(fit_camera(1e-3, {5, 5, 5}), 2300)},
      fit_camera()));
  for (std::size_t c = 0; c < 3; ++c) {
    const double own = integral(fit.response, c, [](double nm) { return std::exp(log_planck(nm, 1700)); });
    EXPECT_NEAR(own / fit.predicted[0][c], 1, 1e-4);
  }
  EXPECT_EQ(*parse_camera_response(to_json(fit.response), "x"), fit.response);
}

/// Cameras drawn from the priors: their true numbers lie within two stated errors as often as they should.
TEST(ResponseFitSlow, StatedErrorsHoldForOneTwoAndFourTemperatures) {
  constexpr int kRepeats = 200;
  const std::vector<std::vector<double>> sets = {{1900}, {1500, 2600}, {1300, 1800, 2400, 3100}};
  for (const std::vector<double>& temperatures : sets) {
    int within = 0;
    int all = 0;
    double prior = 0;
    for (int repeat = 0; repeat < kRepeats; ++repeat) {
      const auto seed = static_cast<std::uint64_t>(repeat);
      std::array<double, 3> shift{};
      std::array<double, 3> width{};
      for (std::size_t c = 0; c < 3; ++c) {
        shift[c] = 10 * random_normal(11, seed, c);
        width[c] = std::exp(0.15 * random_normal(12, seed, c));
      }
      const CameraResponse camera = fit_camera(2e-3, shift, width);
      std::vector<GlowReading> readings;
      for (std::size_t t = 0; t < temperatures.size(); ++t) {
        readings.push_back(glow_seen(camera, temperatures[t], 0.01));
        for (std::size_t c = 0; c < 3; ++c)
          readings.back().level[c] += readings.back().sigma[c] * random_normal(13, seed, 3 * t + c);
      }
      const auto fit = value_of(fit_response(readings, fit_camera(), exact_levels()));
      for (std::size_t c = 0; c < 3; ++c) {
        const FittedChannel& channel = fit.channels[c];
        within += std::abs(channel.shift.value - shift[c]) < 2 * channel.shift.sigma;
        within += std::abs(std::log(channel.width.value / width[c])) < 2 * channel.width.sigma;
        within += std::abs(std::log(channel.scale.value / 2e-3)) < 2 * channel.scale.sigma;
        all += 3;
        prior += 1 - channel.shift.by_data;
      }
    }
    const double share = static_cast<double>(within) / all;
    EXPECT_GT(share, 0.88) << temperatures.size() << " temperatures";
    EXPECT_LT(share, 0.995) << temperatures.size() << " temperatures";
    if (temperatures.size() == 1) {
      EXPECT_GT(prior / (3 * kRepeats), 0.9) << "one level can't tell a shift";
    }
  }
}

TEST(ResponseFit, OneTemperatureIsKnownThereAlone) {
  const CameraResponse camera = fit_camera(1e-3);
  const auto fit = value_of(fit_response({glow_seen(camera, 1800)}, fit_camera()));
  EXPECT_LT(level_errors(fit, fit_camera(), Kelvin(1800))[1], 0.02);
  EXPECT_GT(level_errors(fit, fit_camera(), Kelvin(1200))[1], 0.05);
  EXPECT_GT(fit.channels[1].scale.sigma, 0.1) << "the scale depends on where the channel lies";
  EXPECT_THAT(fit.warnings, testing::Contains(HasSubstr("further temperatures")));
}

TEST(ResponseFit, EqualTemperaturesTellNoMoreOfTheShape) {
  const GlowReading reading = glow_seen(fit_camera(1e-3), 1800);
  const auto one = fit_response({reading}, fit_camera());
  const auto two = value_of(fit_response({reading, reading}, fit_camera()));
  EXPECT_NEAR(two.channels[0].shift.sigma, one->channels[0].shift.sigma, 0.1);
  EXPECT_NEAR(two.channels[0].scale.value, one->channels[0].scale.value, 1e-6);
}

TEST(ResponseFit, ADeadChannelIsToldAndTheOthersAreFitted) {
  CameraResponse camera = fit_camera(1e-3);
  std::fill(camera.level[2].begin(), camera.level[2].end(), 0.0);
  const auto fit = value_of(fit_response({glow_seen(camera, 1600), glow_seen(camera, 2400)}, fit_camera()));
  EXPECT_TRUE(fit.channels[2].dead);
  EXPECT_TRUE(is_dead(fit.response, 2));
  EXPECT_NEAR(fit.channels[0].scale.value, 1e-3, 1e-4);
  EXPECT_THAT(fit.warnings, testing::Contains(HasSubstr("blue channel")));
  EXPECT_EQ(level_errors(fit, fit_camera(), Kelvin(2000))[2], 0);
}

TEST(ResponseFit, ASaturatedLevelIsABound) {
  const CameraResponse camera = fit_camera(1e-3);
  std::vector<GlowReading> readings = {glow_seen(camera, 1600), glow_seen(camera, 2000),
                                       glow_seen(camera, 2800)};
  readings[2].level[0] *= 0.3;
  readings[2].saturated[0] = true;
  const auto fit = value_of(fit_response(readings, fit_camera(), exact_levels()));
  EXPECT_NEAR(fit.channels[0].scale.value, 1e-3, 3e-5);
  EXPECT_LT(fit.chi_square, 1);
  EXPECT_EQ(fit.freedom, 8 - 3);
  for (GlowReading& r : readings) r.saturated[1] = true;
  EXPECT_THAT(fit_response(readings, fit_camera()), FailsWith("green: is at white"));
}

TEST(ResponseFit, WhatTellsNothingIsRefused) {
  const CameraResponse camera = fit_camera(1e-3);
  EXPECT_THAT(fit_response({}, fit_camera()), FailsWith("1 to 64"));
  for (const double kelvin : {1.0, 499.0, 6001.0, 1e5, -3.0, std::numeric_limits<double>::quiet_NaN()}) {
    GlowReading reading = glow_seen(camera, 1800);
    reading.temperature = Kelvin(kelvin);
    EXPECT_THAT(fit_response({reading}, fit_camera()), FailsWith("500 to 6000 K")) << kelvin;
  }
  GlowReading black = glow_seen(camera, 1800);
  black.level = {0.01, -0.02, 0};
  black.sigma = {0.05, 0.05, 0.05};
  EXPECT_THAT(fit_response({glow_seen(camera, 1800), black}, fit_camera()),
              FailsWith("shows nothing above its noise"));
  GlowReading broken = glow_seen(camera, 1800);
  broken.level[1] = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(fit_response({broken}, fit_camera()).ok());
  broken = glow_seen(camera, 1800);
  broken.sigma[0] = 0;
  EXPECT_FALSE(fit_response({broken}, fit_camera()).ok());
  CameraResponse point = fit_camera();
  point.wavelength_nm.resize(1);
  for (auto& level : point.level) level.resize(1);
  EXPECT_THAT(fit_response({glow_seen(camera, 1800)}, point), FailsWith("zero width"));
}

TEST(ResponseFit, TheWholeRangeOfTemperaturesIsFitted) {
  for (const double kelvin : {500.0, 800.0, 6000.0}) {
    const CameraResponse camera = fit_camera(5 / glow_seen(fit_camera(), kelvin).level[1]);
    GlowReading reading = glow_seen(camera, kelvin);
    reading.sigma = {0.01, 0.01, 0.01};
    const auto fit = value_of(fit_response({reading}, fit_camera()));
    EXPECT_NEAR(fit.predicted[0][1], 5, 0.05) << kelvin;
  }
}

TEST(ResponseFit, NegativeLobesNeedAnotherBaseWhereTheyShowNoLight) {
  const CameraResponse camera = sensor_response();
  const GlowReading reading = glow_seen(camera, 1300);
  EXPECT_THAT(fit_response({reading}, standard_response()), FailsWith("--base sensor"));
  const auto fit = value_of(fit_response({reading}, sensor_response()));
  EXPECT_NEAR(fit.channels[2].scale.value, 1, 1e-3);
  // A camera that shows sRGB shows black there: that is what the base says.
  GlowReading srgb = glow_seen(standard_response(), 1300);
  srgb.level[2] = 0;
  const auto hot = value_of(fit_response({srgb, glow_seen(standard_response(), 2800)}, standard_response()));
  EXPECT_NEAR(hot.channels[2].scale.value, 1, 0.02);
}

TEST(ResponseFit, TheWrongEmitterOrOrderIsNoticed) {
  const CameraResponse camera = fit_camera(1e-3);
  std::vector<GlowReading> readings = {glow_seen(camera, 1500), glow_seen(camera, 2500)};
  std::swap(readings[0].temperature, readings[1].temperature);
  const auto fit = value_of(fit_response(readings, fit_camera()));
  EXPECT_THAT(fit.warnings, testing::Contains(HasSubstr("order of the temperatures")));
  KnownEmitter lamp;
  lamp.kind = KnownEmitter::Kind::tungsten;
  lamp.window = 0.92;
  ResponseFitOptions options = exact_levels();
  options.emitter = lamp;
  const auto ribbon = value_of(fit_response(
      {glow_seen(camera, 1700, 1e-4, lamp), glow_seen(camera, 2700, 1e-4, lamp)}, fit_camera(), options));
  EXPECT_NEAR(ribbon.channels[0].scale.value, 1e-3, 1e-5);
}

TEST(ResponseFit, UncertainTemperaturesWidenTheErrors) {
  const CameraResponse camera = fit_camera(1e-3);
  const std::vector<GlowReading> readings = {glow_seen(camera, 1500), glow_seen(camera, 2500)};
  ResponseFitOptions options;
  const auto sure = fit_response(readings, fit_camera(), options);
  options.temperature_sigma = Kelvin(10);
  const auto unsure = value_of(fit_response(readings, fit_camera(), options));
  EXPECT_GT(unsure.channels[1].shift.sigma, 1.2 * sure->channels[1].shift.sigma);
  EXPECT_NEAR(unsure.channels[1].scale.value, 1e-3, 1e-5);
}

}  // namespace
}  // namespace emberlock::recon
