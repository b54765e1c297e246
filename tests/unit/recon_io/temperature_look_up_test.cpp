// SPDX-License-Identifier: Apache-2.0
#include "recon/export/temperature_look_up.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "recon/effects/effects.h"

namespace emberlock::recon {
namespace {

constexpr Meters kLookUpEdge{0.002};

/// Of an emitter of this temperature and absorption, integrated anew.
std::vector<float> light_of(const CameraResponse& response, Emitter emitter, double kelvin,
                            double absorption) {
  const EmitterLevels levels = levels_of(response, emitter, Kelvin(kelvin));
  std::vector<float> rgb;
  for (const double value : levels.value)
    rgb.push_back(static_cast<float>(absorption * std::exp(levels.log_scale) * value));
  return rgb;
}

CameraResponse absolute_response() {
  CameraResponse response = standard_response();
  response.absolute = true;
  return response;
}

TEST(TemperatureLookUp, TellsWhatAnEmitterOfThatTemperatureShowsHoweverMuchOfItThereIs) {
  for (const Emitter emitter : {Emitter::grey, Emitter::soot}) {
    const TemperatureLookUp look_up(standard_response(), emitter);
    for (double kelvin = 1200; kelvin <= 3500; kelvin += 57)
      for (const double absorption : {0.1, 30.0}) {
        std::vector<float> light = light_of(standard_response(), emitter, kelvin, absorption);
        const float most = *std::max_element(light.begin(), light.end());
        for (float& v : light) v *= 100 / most;  // levels a metre, as a camera's exposure makes them
        EXPECT_NEAR(look_up.read(light, kLookUpEdge)[0], kelvin, 1e-3 * kelvin) << name(emitter);
      }
  }
}

TEST(TemperatureLookUp, IsMonotone) {
  const TemperatureLookUp look_up(standard_response(), Emitter::grey);
  std::vector<float> light;
  for (int i = 0; i < 900; ++i) light.insert(light.end(), {100, 5 + 0.1F * static_cast<float>(i), 0});
  const std::vector<float> kelvin = look_up.read(light, kLookUpEdge);
  EXPECT_GT(kelvin.front(), 0);
  EXPECT_TRUE(std::is_sorted(kelvin.begin(), kelvin.end())) << "the greener, the hotter";
  EXPECT_LT(kelvin.front() + 500, kelvin.back());
}

TEST(TemperatureLookUp, WhatIsDarkOrNoBodysColourIsNotTold) {
  const TemperatureLookUp look_up(standard_response(), Emitter::grey);
  std::vector<float> light = {1000, 400, 50,    // a flame
                              40,   16,  2,     // the same, at 4 % of the brightest
                              1000, 0,   0,     // as red as what is colder than the table
                              0,    0,   1000,  // bluer than any body
                              -5,   -5,  -5};
  const std::vector<float> kelvin = look_up.read(light, kLookUpEdge);
  EXPECT_GT(kelvin[0], 1500);
  for (std::size_t i = 1; i < kelvin.size(); ++i) EXPECT_EQ(kelvin[i], 0) << i;
  light.assign(light.size(), 0);
  for (const float k : look_up.read(light, kLookUpEdge)) EXPECT_EQ(k, 0);
}

TEST(TemperatureLookUp, DeadChannelsAreDoneWithoutAndAGreyCameraTellsNothing) {
  CameraResponse no_red = standard_response();
  std::fill(no_red.level[0].begin(), no_red.level[0].end(), 0.0);
  EXPECT_NEAR(TemperatureLookUp(no_red, Emitter::grey)
                  .read(light_of(no_red, Emitter::grey, 2600, 1e-9), kLookUpEdge)[0],
              2600, 3);
  CameraResponse grey = standard_response();
  grey.level = {grey.level[1], grey.level[1], grey.level[1]};
  EXPECT_EQ(TemperatureLookUp(grey, Emitter::grey).read({100, 100, 100}, kLookUpEdge)[0], 0);
}

TEST(TemperatureLookUp, ThePapersGoesByGreenAndItsOpacity) {
  const double opacity = extinction_of_opacity(kPaperOpacityOfAStep, kLookUpEdge).value();
  const CameraResponse absolute = absolute_response();
  const TemperatureLookUp look_up(absolute, Emitter::paper);
  for (const double kelvin : {1100.0, 1500.0, 2200.0}) {
    std::vector<float> light = light_of(absolute, Emitter::paper, kelvin, opacity);
    light[0] = light[1];
    light[2] = 0;  // neither is asked
    EXPECT_NEAR(look_up.read(light, kLookUpEdge)[0], kelvin, 1);
  }
  EXPECT_EQ(look_up.read(light_of(absolute, Emitter::paper, 2400, opacity), kLookUpEdge)[0], 0);
  // Without a scale the brightest green is its hottest.
  const TemperatureLookUp relative(standard_response(), Emitter::paper);
  std::vector<float> both = light_of(absolute, Emitter::paper, kPaperHottest, 7);
  const std::vector<float> colder = light_of(absolute, Emitter::paper, 1900, 7);
  both.insert(both.end(), colder.begin(), colder.end());
  EXPECT_NEAR(relative.read(both, kLookUpEdge)[0], kPaperHottest, 1);
  EXPECT_NEAR(relative.read(both, kLookUpEdge)[1], 1900, 1);
}

}  // namespace
}  // namespace emberlock::recon
