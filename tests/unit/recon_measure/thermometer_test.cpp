// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/thermometer.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/random.h"
#include "tests/support/glowing_flame.h"

namespace emberlock::recon {
namespace {

/// What `absorption` per metre of an emitter shows, in levels a metre.
Eigen::Vector3d shown(const CameraResponse& response, Emitter emitter, double kelvin, double absorption = 1) {
  const EmitterLevels levels = levels_of(response, emitter, Kelvin(kelvin));
  return absorption * std::exp(levels.log_scale) * Eigen::Vector3d::Map(levels.value.data());
}

Eigen::Vector3d share_of(const Eigen::Vector3d& level, double share) {
  return Eigen::Vector3d::Constant(share * level.maxCoeff());
}

TEST(Thermometer, ReadsWhatGlows) {
  for (const Emitter emitter : {Emitter::grey, Emitter::soot}) {
    CameraResponse response = test::lobes(1e3);
    for (const bool absolute : {true, false}) {
      response.absolute = absolute;
      const Thermometer meter(EmitterTable(response, emitter));
      for (const double kelvin : {800.0, 1000.0, 1450.0, 2030.0, 3000.0, 5000.0}) {
        const Eigen::Vector3d level = shown(response, emitter, kelvin, 20);
        const Reading reading = meter.read(glow_of(level, share_of(level, 1e-3)));
        EXPECT_EQ(reading.told, Reading::Told::yes) << kelvin;
        EXPECT_NEAR(reading.kelvin, kelvin, 2e-4 * kelvin);
        EXPECT_NEAR(reading.absorption, absolute ? 20 : reading.absorption, 0.2) << kelvin;
      }
    }
  }
}

TEST(Thermometer, OneChannelAndTheAbsorptionAreEnough) {
  const CameraResponse response = test::lobes(1e3);
  const Thermometer meter(EmitterTable(response, Emitter::grey));
  const Eigen::Vector3d level = shown(response, Emitter::grey, 1700, 30);
  Glow glow = glow_of(level, Eigen::Vector3d(INFINITY, 0.01 * level[1], INFINITY));
  EXPECT_EQ(meter.read(glow).told, Reading::Told::no) << "one datum, two unknowns";
  glow.absorption = 30;
  glow.absorption_sigma = 1.5;
  const Reading reading = meter.read(glow);
  EXPECT_EQ(reading.told, Reading::Told::yes);
  EXPECT_NEAR(reading.kelvin, 1700, 0.5);
  EXPECT_GT(reading.sigma, 2);
  EXPECT_LT(reading.sigma, 12);
}

TEST(Thermometer, ErrorsAreWhatRepeatsShowAndChiSquareIsOne) {
  const CameraResponse response = test::lobes(1e3);
  const Thermometer meter(EmitterTable(response, Emitter::grey));
  const Eigen::Vector3d level = shown(response, Emitter::grey, 1800, 20);
  const Eigen::Vector3d sigma = 0.01 * level;
  int within = 0;
  double chi = 0;
  constexpr int kRepeats = 2000;
  RandomStream random(7, 1);
  for (int i = 0; i < kRepeats; ++i) {
    Eigen::Vector3d noisy = level;
    for (int c = 0; c < 3; ++c) noisy[c] += sigma[c] * random.normal();
    const Reading reading = meter.read(glow_of(noisy, sigma));
    ASSERT_EQ(reading.told, Reading::Told::yes);
    EXPECT_EQ(reading.freedom, 1);
    chi += reading.chi_square / kRepeats;
    within += std::abs(reading.kelvin - 1800) < 2 * reading.sigma ? 1 : 0;
  }
  EXPECT_GT(within, 0.93 * kRepeats);
  EXPECT_LT(within, 0.995 * kRepeats);
  EXPECT_NEAR(chi, 1, 0.1);
}

TEST(Thermometer, CommonErrorsOfChannelsDontCount) {
  const CameraResponse response = test::lobes(1e3);
  const Thermometer meter(EmitterTable(response, Emitter::grey));
  Glow glow;
  glow.level = shown(response, Emitter::grey, 1800, 20);
  const Eigen::Matrix3d own = (1e-4 * glow.level.cwiseAbs2()).asDiagonal();
  glow.information = own.inverse();
  const double alone = meter.read(glow).sigma;
  glow.information = (own + 0.04 * glow.level * glow.level.transpose()).inverse();
  EXPECT_NEAR(meter.read(glow).sigma, alone, 0.01 * alone) << "20 % that all channels share";
}

TEST(Thermometer, TellsNothingRatherThanSomethingWrong) {
  const CameraResponse response = test::lobes(1e3);
  const Thermometer meter(EmitterTable(response, Emitter::grey, Kelvin(1000), Kelvin(2300)));
  const auto told = [&](const Eigen::Vector3d& level) {
    return meter.read(glow_of(level, share_of(level, 0.005))).told;
  };
  EXPECT_EQ(told(shown(response, Emitter::grey, 800)), Reading::Told::colder);
  EXPECT_EQ(told(shown(response, Emitter::grey, 4000)), Reading::Told::hotter);
  EXPECT_EQ(meter.read(glow_of(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones())).told, Reading::Told::no);
  EXPECT_EQ(meter.read(Glow{}).told, Reading::Told::no);
  const Reading nan = meter.read(glow_of(Eigen::Vector3d::Constant(NAN), Eigen::Vector3d::Ones()));
  EXPECT_EQ(nan.told, Reading::Told::no);
  // Sodium's yellow: red and green, no blue, in no temperature's proportion.
  const Eigen::Vector3d sodium(
      integral(response, 0, [](double nm) { return std::abs(nm - 589) < 2 ? 1 : 0; }),
      integral(response, 1, [](double nm) { return std::abs(nm - 589) < 2 ? 1 : 0; }), 0);
  const Thermometer wide(EmitterTable(response, Emitter::grey));
  const Reading yellow = wide.read(glow_of(sodium, share_of(sodium, 0.01)));
  EXPECT_TRUE(yellow.told != Reading::Told::yes || yellow.chi_square > 9) << yellow.kelvin;
}

TEST(Thermometer, ADeadChannelLeavesTheOthers) {
  CameraResponse response = test::lobes(1e3);
  for (double& v : response.level[2]) v = 0;
  const Thermometer meter(EmitterTable(response, Emitter::grey));
  const Eigen::Vector3d level = shown(response, Emitter::grey, 1600, 20);
  const Reading reading = meter.read(glow_of(level, Eigen::Vector3d(level[0], level[0], INFINITY) * 0.01));
  EXPECT_EQ(reading.told, Reading::Told::yes);
  EXPECT_NEAR(reading.kelvin, 1600, 1);
  for (double& v : response.level[1]) v = 0;
  const Thermometer blind(EmitterTable(response, Emitter::grey));
  EXPECT_EQ(blind.read(glow_of(level, Eigen::Vector3d(1, INFINITY, INFINITY))).told, Reading::Told::no);
}

}  // namespace
}  // namespace emberlock::recon
