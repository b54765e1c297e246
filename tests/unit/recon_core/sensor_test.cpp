// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/sensor.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "recon/kernels/residual.h"

namespace emberlock::recon {
namespace {

Sensor gamma_sensor(double gamma, double white, bool clips) {
  Sensor sensor;
  sensor.response = Sensor::Response::gamma;
  sensor.gamma = gamma;
  sensor.white = white;
  if (clips) sensor.clipping = Sensor::Clipping::at_white;
  return sensor;
}

RadianceImage ramp() {
  RadianceImage image({101, 1});
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<float>(i) - 20;
  return image;  // -20 .. 282
}

TEST(Sensor, AnswersByItsPowerLawAndClipsAtWhite) {
  for (const double gamma : {0.5, 1.8, 2.2, 5.0}) {
    RadianceImage image = ramp();
    respond(image, gamma_sensor(gamma, 200, true));
    for (std::size_t i = 0; i < image.rgb.size(); ++i) {
      const double radiance = static_cast<double>(i) - 20;
      const double bent = 200 * std::pow(std::abs(radiance) / 200, 1 / gamma);
      const double expected = radiance < 0 ? -bent : std::min(bent, 200.0);
      EXPECT_NEAR(static_cast<double>(image.rgb[i]), expected, 2e-5 * std::abs(expected)) << gamma;
    }
  }
}

TEST(Sensor, LinearisingUndoesTheResponseBelowWhiteAndKeepsClippedPixelsAtWhite) {
  for (const double gamma : {0.5, 1.0, 2.2, 5.0}) {
    const Sensor sensor = gamma_sensor(gamma, 200, true);
    const RadianceImage truth = ramp();
    RadianceImage image = truth;
    respond(image, sensor);
    linearise(image, sensor);
    for (std::size_t i = 0; i < image.rgb.size(); ++i) {
      const float expected = std::min(truth.rgb[i], 200.F);
      EXPECT_NEAR(image.rgb[i], expected, 3e-6F * static_cast<float>(gamma) * std::abs(expected)) << gamma;
      if (truth.rgb[i] >= 200) {
        EXPECT_EQ(image.rgb[i], 200.F);
      }
    }
  }
}

TEST(Sensor, WithoutClippingNothingIsLostAboveWhite) {
  RadianceImage image = ramp();
  const Sensor sensor = gamma_sensor(2.2, 100, false);
  respond(image, sensor);
  linearise(image, sensor);
  EXPECT_NEAR(image.rgb.back(), 282, 2e-3);
}

TEST(Sensor, LinearOneChangesNothing) {
  RadianceImage image = ramp();
  respond(image, {});
  linearise(image, {});
  EXPECT_EQ(image.rgb, ramp().rgb);
}

TEST(Sensor, ImpossibleOnesAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  Effects effects;
  EXPECT_TRUE(check(effects).ok());
  for (const double gamma : {0.0, -2.2, nan, infinity}) {
    effects.sensor = gamma_sensor(gamma, 255, true);
    ASSERT_FALSE(check(effects).ok()) << gamma;
    EXPECT_NE(check(effects).error().what.find("gamma"), std::string::npos);
  }
  for (const double white : {0.0, -1.0, nan, infinity}) {
    effects.sensor = gamma_sensor(2.2, white, true);
    ASSERT_FALSE(check(effects).ok()) << white;
    EXPECT_NE(check(effects).error().what.find("saturation"), std::string::npos);
  }
}

TEST(Sensor, SaturatedPixelIsABoundAndTheOthersAreValues) {
  const Rgba seen{{200, 200, 199, 0}};
  const Rgba rendered{{150, 250, 250, 0.4F}};
  PixelResidual<float> residual_of;
  residual_of.seen = &seen;
  EXPECT_EQ(residual_of(0, rendered).c[1], 50.F);
  residual_of.white = 200;
  const Rgba r = residual_of(0, rendered);
  EXPECT_EQ(r.c[0], -50.F);  // saturated, and rendered darker
  EXPECT_EQ(r.c[1], 0.F);    // saturated, and rendered brighter
  EXPECT_EQ(r.c[2], 51.F);   // a value
  EXPECT_EQ(r.c[3], 0.F);
}

TEST(Sensor, AViewsOwnMarksMakeItsValuesBounds) {
  const Rgba seen{{90, 200, 199, 5}};  // red and blue are marked, whatever their value
  const Rgba rendered{{150, 250, 150, 0.4F}};
  PixelResidual<float> residual_of;
  residual_of.seen = &seen;
  EXPECT_EQ(residual_of(0, rendered).c[0], 60.F) << "nobody looks at the marks where nothing is bounded";
  residual_of.white = std::numeric_limits<float>::infinity();
  const Rgba r = residual_of(0, rendered);
  EXPECT_EQ(r.c[0], 0.F);    // a bound, and rendered brighter
  EXPECT_EQ(r.c[1], 50.F);   // a value
  EXPECT_EQ(r.c[2], -49.F);  // a bound, and rendered darker
}

// x * 1 seen as min(x, white) for three pixels of one unknown: least squares would settle between the values,
// the bound lets the unsaturated pixel decide.
TEST(Sensor, DescentOnTheBoundFindsWhatTheClippedPixelsHide) {
  const float gain[3] = {0.5F, 1, 2};
  const float truth = 300;
  float x = 0;
  for (int i = 0; i < 200; ++i) {
    float slope = 0;
    for (const float g : gain) {
      const float seen = std::min(g * truth, 200.F);
      const Rgba pixel{{seen, 0, 0, 0}};
      PixelResidual<float> residual_of;
      residual_of.seen = &pixel;
      residual_of.white = 200;
      slope += g * residual_of(0, Rgba{{g * x, 0, 0, 0}}).c[0];
    }
    x -= slope / 5.25F;
  }
  EXPECT_NEAR(x, truth, 0.01);
}

}  // namespace
}  // namespace emberlock::recon
