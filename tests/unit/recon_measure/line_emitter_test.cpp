// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/line_emitter.h"

#include <cmath>

#include <gmock/gmock.h>

#include "tests/support/glowing_flame.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

const LineEmitter& emitter(std::string_view name) { return *parse_lines(name)->named.front(); }

/// The camera of lobes() behind a filter that ends at 700 nm.
CameraResponse with_ir_cut() {
  CameraResponse response = test::lobes();
  for (std::size_t i = 0; i < response.wavelength_nm.size(); ++i)
    if (response.wavelength_nm[i] > 700)
      for (std::vector<double>& channel : response.level) channel[i] = 0;
  return response;
}

TEST(LineEmitters, AreSeenAsTheIntegralOverTheirLightSays) {
  const CameraResponse response = test::lobes();
  for (const LineEmitter& e : line_emitters()) {
    std::array<double, 3> sum = {};
    double all = 0;
    for (const LineBand& band : e.bands) {
      all += band.strength;
      constexpr int kSteps = 2000;
      for (std::size_t c = 0; c < 3; ++c)
        for (int i = 0; i < kSteps; ++i) {
          const double nm = band.from_nm + (band.to_nm - band.from_nm) * (i + 0.5) / kSteps;
          const double place = (nm - 380) / 5;
          const auto k = static_cast<std::size_t>(place);
          const double f = place - std::floor(place);
          sum[c] +=
              band.strength / kSteps *
              ((1 - f) * response.level[c][k] + f * response.level[c][std::min<std::size_t>(k + 1, 80)]);
        }
    }
    const std::array<double, 3> shown = levels_of(response, e);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(shown[c], sum[c] / all, 1e-7) << e.name << c;
  }
}

TEST(LineEmitters, HaveTheColoursThatTheyAreKnownFor) {
  const auto xyz = [](std::string_view name) { return levels_of(cie_1931_observer(), emitter(name)); };
  const auto xy = [&](std::string_view name) {
    const auto v = xyz(name);
    return std::array<double, 2>{v[0] / (v[0] + v[1] + v[2]), v[1] / (v[0] + v[1] + v[2])};
  };
  EXPECT_NEAR(xy("sodium")[0], 0.569, 0.003) << "the spectral locus at 589 nm, CIE 15";
  EXPECT_NEAR(xy("sodium")[1], 0.430, 0.003);
  EXPECT_NEAR(xy("lithium")[0], 0.732, 0.003) << "at 671 nm";
  EXPECT_NEAR(xy("ch")[0], 0.169, 0.004) << "at 431 nm";
  const auto c2 = xyz("c2");
  EXPECT_GT(c2[1], c2[2]) << "green before blue";
  EXPECT_GT(xyz("cucl")[2], 5 * xyz("cucl")[1]) << "blue";
  EXPECT_GT(xyz("cuoh")[1], 1.5 * xyz("cuoh")[0]) << "green";
  EXPECT_GT(xyz("bo2")[1], xyz("bo2")[0]) << "green";
}

TEST(LineEmitters, C2LooksAsItsTransitionProbabilitiesSay) {
  // Power of each band by Franck-Condon factors of a Morse oscillator, the cube of the wave number and a
  // Boltzmann distribution at 4000 K, evenly over the 8 nm on the violet side, to which it fades.
  LineEmitter calculated{"c2", "calculated", {}};
  for (const auto& [head, power] : std::vector<std::array<double, 2>>{{473.7, 2.4},
                                                                      {471.5, 1.9},
                                                                      {469.8, 1.2},
                                                                      {516.5, 10},
                                                                      {512.9, 2.5},
                                                                      {563.6, 2.05},
                                                                      {558.6, 1.4},
                                                                      {554.1, 0.7},
                                                                      {619.1, 0.29},
                                                                      {612.2, 0.32}})
    calculated.bands.push_back({head - 8, head, power});
  for (const CameraResponse& response : {test::lobes(), standard_response(), cie_1931_observer()})
    EXPECT_LT(colour_distance(levels_of(response, calculated), levels_of(response, emitter("c2"))), 0.05);
}

TEST(LineEmitters, AreToldByName) {
  EXPECT_FALSE(parse_lines("")->any());
  EXPECT_TRUE(parse_lines("auto")->automatic);
  const auto two = value_of(parse_lines("sodium,c2"));
  EXPECT_EQ(two.named[1]->name, "c2");
  for (const char* bad : {"neon", "sodium,", ",", "sodium,auto", "sodium,sodium", "sodium,c2,ch"}) {
    EXPECT_THAT(parse_lines(bad), FailsWith("--lines")) << bad;
  }
  EXPECT_THAT(parse_lines("neon"), FailsWith("lithium"));
}

TEST(LineEmitters, ThatACameraCantTellAreRefused) {
  const auto refusal = [](const CameraResponse& response, std::string_view words,
                          Emitter soot = Emitter::soot) {
    const Status status = check_lines(response, soot, *parse_lines(words));
    return status.ok() ? std::string() : status.error().message();
  };
  EXPECT_EQ(refusal(test::lobes(), "sodium,c2"), "");
  EXPECT_EQ(refusal(standard_response(), "sodium"), "");
  EXPECT_EQ(refusal(standard_response(), ""), "");
  EXPECT_THAT(refusal(standard_response(), "potassium"), HasSubstr("doesn't see potassium"));
  EXPECT_THAT(refusal(with_ir_cut(), "potassium"), HasSubstr("infrared filter"));
  EXPECT_THAT(refusal(test::lobes(), "sodium", Emitter::paper), HasSubstr("green alone"));
  CameraResponse relative = test::lobes();
  relative.absolute = false;
  EXPECT_EQ(refusal(relative, "sodium"), "");
  EXPECT_THAT(refusal(relative, "sodium,c2"), HasSubstr("3 channels can't tell 4 unknowns"));
  // A camera that sees the infrared by its red channel alone.
  CameraResponse red = test::lobes();
  red.level[0].assign(red.level[0].size(), 1);
  EXPECT_EQ(refusal(red, "potassium"), "");
  EXPECT_THAT(refusal(red, "potassium,lithium"), HasSubstr("have one colour"));
  for (double& v : relative.level[2]) v = 0;
  EXPECT_THAT(refusal(relative, "sodium"), HasSubstr("2 channels can't tell 3 unknowns"));
  EXPECT_THAT(refusal(relative, "auto"), HasSubstr("2 channels"));
}

TEST(LineEmitters, SomeLookLikeSootOfOneTemperature) {
  const EmitterTable table(test::lobes(), Emitter::soot);
  const auto lithium = as_if_hot(table, levels_of(test::lobes(), emitter("lithium")));
  ASSERT_TRUE(lithium.has_value()) << "deep red, as cold soot";
  EXPECT_LT(lithium->value(), 1000);
  EXPECT_FALSE(as_if_hot(table, levels_of(test::lobes(), emitter("cuoh"))).has_value());
}

}  // namespace
}  // namespace emberlock::recon
