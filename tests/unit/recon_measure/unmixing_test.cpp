// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/unmixing.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/random.h"
#include "tests/support/glowing_flame.h"

namespace emberlock::recon {
namespace {

using Kind = Unmixed::Kind;

std::array<double, 3> levels(const CameraResponse& response, std::string_view line) {
  return levels_of(response, *parse_lines(line)->named.front());
}

/// Soot of a temperature and a line that makes a share of the light, by the exact integrals; levels a metre.
Eigen::Vector3d mixture(const CameraResponse& response, double kelvin, std::string_view line, double share,
                        double absorption = 20) {
  const EmitterLevels soot = levels_of(response, Emitter::soot, Kelvin(kelvin));
  const Eigen::Vector3d own = absorption * std::exp(soot.log_scale) * Eigen::Vector3d::Map(soot.value.data());
  const std::array<double, 3> shown = levels(response, line);
  const Eigen::Vector3d other = Eigen::Vector3d::Map(shown.data());
  return own + own.sum() * share / (1 - share) / other.sum() * other;
}
Eigen::Vector3d alone(const CameraResponse& response, std::string_view line, double level) {
  const std::array<double, 3> shown = levels(response, line);
  return level * Eigen::Vector3d::Map(shown.data()).normalized();
}
Eigen::Vector3d even(const Eigen::Vector3d& level, double share) {
  return Eigen::Vector3d::Constant(share * level.maxCoeff());
}

class UnmixingTest : public testing::Test {
 protected:
  CameraResponse response_ = test::lobes(1e3);
  Thermometer meter_{EmitterTable(response_, Emitter::soot)};
  Unmixer of(std::string_view lines) const {
    std::vector<std::array<double, 3>> shown;
    const LineRequest request = *parse_lines(lines);
    for (const LineEmitter* e : request.named) shown.push_back(levels_of(response_, *e));
    return {meter_, shown};
  }
};
using UnmixingTestSlow = UnmixingTest;

TEST_F(UnmixingTest, AMixtureComesApartIntoWhatItIsMadeOf) {
  for (const char* line : {"sodium", "c2", "cuoh", "bo2", "ch", "cucl", "lithium"})
    for (const double kelvin : {1450.0, 1800.0, 2100.0})
      for (const double share : {0.2, 0.5, 0.8}) {
        const Eigen::Vector3d level = mixture(response_, kelvin, line, share);
        Glow glow = glow_of(level, even(level, 1e-5));
        glow.absorption = 20;  // which of two mixtures it is; too rough to tell a temperature
        glow.absorption_sigma = 10;
        const Unmixed out = of(line).read(glow);
        SCOPED_TRACE(std::string(line) + " " + std::to_string(kelvin) + " " + std::to_string(share));
        ASSERT_EQ(out.kind, Kind::mixed);
        EXPECT_NEAR(out.reading.kelvin, kelvin, 1e-3 * kelvin);
        EXPECT_NEAR(out.share[0], share, 1e-3);
        EXPECT_NEAR(out.reading.absorption, 20, 0.2);
      }
}

TEST_F(UnmixingTest, MixturesThatLookAlikeAreNoTemperature) {
  const Eigen::Vector3d level = mixture(response_, 1450, "c2", 0.8);
  const Reading channels = of("c2").read(glow_of(level, even(level, 2e-3))).reading;
  EXPECT_GT(channels.sigma, 200) << "also C2 beside soot of 2730 K";
  Glow glow = glow_of(level, even(level, 2e-3));
  glow.absorption = 20;
  glow.absorption_sigma = 5;
  const Reading told = of("c2").read(glow).reading;
  EXPECT_NEAR(told.kelvin, 1450, 2 * told.sigma);
  EXPECT_LT(told.sigma, 100);
}

TEST_F(UnmixingTestSlow, ErrorsHoldHoweverMuchOfTheLightIsTheLines) {
  for (const char* line : {"sodium", "c2"})
    for (const double share : {0.0, 0.02, 0.05, 0.1, 0.3, 0.7}) {
      const Eigen::Vector3d level = mixture(response_, 1800, line, share);
      const Eigen::Vector3d sigma = even(level, 0.005);
      const Unmixer unmixer = of(line);
      RandomStream random(11, static_cast<std::uint64_t>(1000 * share));
      int told = 0;
      int within = 0;
      constexpr int kRepeats = 400;
      for (int i = 0; i < kRepeats; ++i) {
        Eigen::Vector3d noisy = level;
        for (int c = 0; c < 3; ++c) noisy[c] += sigma[c] * random.normal();
        const Unmixed out = unmixer.read(glow_of(noisy, sigma));
        if (out.reading.told != Reading::Told::yes || !std::isfinite(out.reading.sigma)) continue;
        if (out.kind != Kind::soot && out.kind != Kind::mixed) continue;
        ++told;
        within += std::abs(out.reading.kelvin - 1800) < 2 * out.reading.sigma ? 1 : 0;
      }
      EXPECT_GT(told, 0.85 * kRepeats) << line << share;
      EXPECT_GT(within, 0.9 * told) << line << share;
    }
}

TEST_F(UnmixingTest, ALineAloneHasNoTemperature) {
  for (const char* line : {"sodium", "c2", "cuoh", "bo2", "ch"}) {
    const Eigen::Vector3d level = alone(response_, line, 100);
    const Unmixed out = of(line).read(glow_of(level, even(level, 0.005)));
    EXPECT_EQ(out.kind, Kind::lines) << line;
    EXPECT_EQ(out.share[0], 1) << line;
  }
}

TEST_F(UnmixingTest, SootAloneHasNoLines) {
  const Eigen::Vector3d level = mixture(response_, 1700, "sodium", 0);
  const Unmixed out = of("sodium,c2").read(glow_of(level, even(level, 0.002)));
  EXPECT_EQ(out.kind, Kind::soot);
  EXPECT_NEAR(out.reading.kelvin, 1700, 2 * out.reading.sigma);
  EXPECT_EQ(out.share[0], 0);
}

TEST_F(UnmixingTest, WhatCantBeToldIsSaid) {
  // Lithium's red is also that of cold soot.
  const Eigen::Vector3d red = alone(response_, "lithium", 100);
  EXPECT_EQ(of("lithium").read(glow_of(red, even(red, 0.005))).kind, Kind::alike);
  // Another line than the one that is looked for.
  const Eigen::Vector3d green = alone(response_, "cuoh", 100);
  EXPECT_EQ(of("lithium").read(glow_of(green, even(green, 0.005))).kind, Kind::neither);
  // Two channels, and what isn't finite or doesn't glow.
  Eigen::Vector3d sigma = even(green, 0.005);
  sigma[2] = INFINITY;
  EXPECT_EQ(of("cuoh").read(glow_of(green, sigma)).kind, Kind::unknown);
  const Eigen::Vector3d one = Eigen::Vector3d::Ones();
  EXPECT_EQ(of("cuoh").read(glow_of(Eigen::Vector3d::Zero(), one)).kind, Kind::unknown);
  EXPECT_EQ(of("cuoh").read(glow_of(Eigen::Vector3d::Constant(NAN), one)).kind, Kind::unknown);
  // Noise as large as the light: nothing stands out.
  const Unmixed lost = of("cuoh").read(glow_of(green, even(green, 1)));
  EXPECT_TRUE(lost.kind != Kind::mixed && (lost.kind != Kind::soot || lost.reading.sigma > 300));
  // Nor do two lines whose mixture may be either.
  const Eigen::Vector3d level = mixture(response_, 1700, "c2", 0.3);
  const Unmixed both = of("sodium,c2").read(glow_of(level, even(level, 0.3)));
  EXPECT_TRUE(both.kind != Kind::mixed && (both.kind != Kind::soot || both.reading.sigma > 300));
}

TEST_F(UnmixingTest, TwoLinesAndSootNeedTheExtinctionToo) {
  const Eigen::Vector3d level = mixture(response_, 1700, "sodium", 0.3) +
                                alone(response_, "c2", mixture(response_, 1700, "c2", 0).norm());
  Glow glow = glow_of(level, even(level, 1e-4));
  EXPECT_NE(of("sodium,c2").read(glow).kind, Kind::mixed);
  glow.absorption = 20;
  glow.absorption_sigma = 0.2;
  const Unmixed out = of("sodium,c2").read(glow);
  EXPECT_EQ(out.kind, Kind::mixed);
  EXPECT_TRUE(out.seen[0] && out.seen[1]);
  EXPECT_NEAR(out.reading.kelvin, 1700, 2 * out.reading.sigma);
  EXPECT_LT(out.reading.sigma, 30);
}

TEST_F(UnmixingTest, TheLineIsChosenThatExplainsWhatNoSootDoes) {
  const auto glows = [&](std::string_view line, double least, double noise) {
    std::vector<Glow> out;
    for (int i = 0; i < 20; ++i) {
      const double share = least + (1 - least) * i / 20;
      const Eigen::Vector3d level = mixture(response_, 1600 + 20 * i, line, share);
      out.push_back(glow_of(level, even(level, noise)));
      out.back().absorption = 20;
      out.back().absorption_sigma = 10;
    }
    return out;
  };
  for (const char* line : {"sodium", "cuoh"}) {
    const LineChoice choice = choose_line(meter_, response_, glows(line, 0.5, 0.003));
    ASSERT_NE(choice.chosen, nullptr) << line << " " << choice.rivals.size();
    EXPECT_EQ(choice.chosen->name, line);
  }
  EXPECT_EQ(choose_line(meter_, response_, {}).chosen, nullptr);
  // CH and CuCl are both blue.
  const LineChoice blue = choose_line(meter_, response_, glows("ch", 0.3, 0.03));
  EXPECT_EQ(blue.chosen, nullptr);
  EXPECT_GE(blue.rivals.size(), 2U);
  // Channels that no line has.
  std::vector<Glow> purple;
  purple.push_back(glow_of({100, 0, 100}, {0.1, 0.1, 0.1}));
  const LineChoice none = choose_line(meter_, response_, purple);
  EXPECT_EQ(none.chosen, nullptr);
  EXPECT_TRUE(none.rivals.empty());
}

TEST_F(UnmixingTest, ALineOutsideOfTheGamutTakesFromTheSootBesideIt) {
  // Of linear sRGB: sodium has less than no blue, copper's green less than no red.
  const CameraResponse srgb = standard_response();
  const Thermometer meter(EmitterTable(srgb, Emitter::soot));
  for (const char* line : {"sodium", "cuoh"}) {
    const LineEmitter& emitter = *parse_lines(line)->named.front();
    const std::array<double, 3> shown = levels_of(srgb, emitter);
    EXPECT_LT(*std::min_element(shown.begin(), shown.end()), 0) << line;
    for (const double share : {0.1, 0.3}) {
      const EmitterLevels soot = levels_of(srgb, Emitter::soot, Kelvin(1700));
      const std::array<double, 3> whole = shown_alone(shown);
      Eigen::Vector3d level;
      for (int c = 0; c < 3; ++c) {
        const auto i = static_cast<std::size_t>(c);
        level[c] = 100 * ((1 - share) * soot.value[i] + share * shown[i] / (whole[0] + whole[1] + whole[2]));
      }
      const Unmixer unmixer(meter, {shown});
      const Unmixed out = unmixer.read(glow_of(level, even(level.cwiseMax(0.01), 1e-3)));
      ASSERT_EQ(out.kind, Kind::mixed) << line << share;
      EXPECT_NEAR(out.reading.kelvin, 1700, 10) << line << share;
    }
  }
}

}  // namespace
}  // namespace emberlock::recon
