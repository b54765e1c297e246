// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/emitter.h"

#include <cmath>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>

#include "recon/kernels/planck.h"
#include "tests/support/glowing_flame.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

/// In long double and straight from the formula, W / (sr m^2 nm).
long double planck_by_the_book(long double nm, long double kelvin) {
  const long double h = 6.62607015e-34L;
  const long double c = 299792458;
  const long double k = 1.380649e-23L;
  const long double m = nm * 1e-9L;
  return 2 * h * c * c / powl(m, 5) / (expm1l(h * c / (m * k * kelvin))) * 1e-9L;
}

TEST(Planck, IsTheFormula) {
  for (const double kelvin : {300.0, 1000.0, 1800.0, 2856.0, 6500.0, 1e5})
    for (const double nm : {380.0, 550.0, 780.0, 2000.0, 20000.0})
      EXPECT_NEAR(log_planck(nm, kelvin), static_cast<double>(logl(planck_by_the_book(nm, kelvin))), 1e-8)
          << kelvin << " K, " << nm << " nm";
}

TEST(Planck, IsFiniteFromOneKelvinToAHundredThousand) {
  for (double kelvin = 1; kelvin <= 1e5; kelvin *= 1.5)
    for (const double nm : {100.0, 550.0, 20000.0}) {
      EXPECT_TRUE(std::isfinite(log_planck(nm, kelvin))) << kelvin;
      const double step = 1e-4 * kelvin;
      const double slope = (log_planck(nm, kelvin + step) - log_planck(nm, kelvin - step)) / (2 * step);
      EXPECT_NEAR(log_planck_slope(nm, kelvin), slope, 1e-6 * slope) << kelvin;
    }
}

TEST(Planck, AddsUpToStefanAndBoltzmann) {
  for (const double kelvin : {500.0, 1800.0, 6000.0}) {
    double sum = 0;
    constexpr double kStep = 1e-3;  // of the logarithm
    for (double l = std::log(10); l < std::log(1e8); l += kStep)
      sum += kStep * std::exp(l + log_planck(std::exp(l), kelvin));
    EXPECT_NEAR(sum, 5.670374419e-8 * std::pow(kelvin, 4) / 3.14159265358979, 1e-5 * sum) << kelvin;
  }
}

/// Debian's colord-data: X, Y, Z, 360 to 830 nm in steps of 5.
std::vector<std::vector<double>> colord_observer() {
  std::ifstream file("/usr/share/colord/cmf/CIE1931-2deg-XYZ.cmf");
  std::vector<std::vector<double>> rows;
  bool data = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("END_DATA", 0) == 0 && line.size() < 10) data = false;
    if (data) {
      std::istringstream in(line);
      rows.emplace_back();
      for (double v = 0; in >> v;) rows.back().push_back(v);
    }
    if (line.rfind("BEGIN_DATA", 0) == 0 && line.size() < 12) data = true;
  }
  return rows;
}

TEST(Chromaticity, LiesOnThePlanckianLocus) {
  const auto observer = colord_observer();
  ASSERT_EQ(observer.size(), 3U) << "scripts/setup installs colord-data";
  for (const double kelvin : {1000.0, 1500.0, 2000.0, 2300.0, 2856.0}) {
    std::array<double, 3> xyz = {};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < observer[c].size(); ++i)
        xyz[c] += observer[c][i] *
                  static_cast<double>(planck_by_the_book(360 + 5.0L * static_cast<long double>(i), kelvin));
    const double sum = xyz[0] + xyz[1] + xyz[2];
    const auto [x, y] = chromaticity(Kelvin(kelvin));
    EXPECT_NEAR(x, xyz[0] / sum, 0.001) << kelvin;
    EXPECT_NEAR(y, xyz[1] / sum, 0.001) << kelvin;
  }
  // CIE standard illuminant A.
  EXPECT_NEAR(chromaticity(Kelvin(2856))[0], 0.44757, 0.001);
  EXPECT_NEAR(chromaticity(Kelvin(2856))[1], 0.40745, 0.001);
}

TEST(Emitter, TablesAreTheIntegralsAndMonotone) {
  for (const Emitter emitter : {Emitter::grey, Emitter::soot}) {
    const CameraResponse response = test::lobes();
    const EmitterTable table(response, emitter);
    double log_before = -1e300;
    double ratio_before = 1e300;
    for (double kelvin = EmitterTable::kColdest; kelvin < EmitterTable::kHottest; kelvin *= 1.007) {
      const EmitterLevels tabled = table.at(Kelvin(kelvin));
      const EmitterLevels exact = levels_of(response, emitter, Kelvin(kelvin));
      EXPECT_NEAR(tabled.log_scale, exact.log_scale, 1e-4) << kelvin;
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(tabled.value[c], exact.value[c], 1e-4) << kelvin;
      const double green = tabled.log_scale + std::log(tabled.value[1]);
      EXPECT_GT(green, log_before) << "more light at " << kelvin;
      EXPECT_LT(tabled.value[0] / tabled.value[1], ratio_before) << "less red at " << kelvin;
      log_before = green;
      ratio_before = tabled.value[0] / tabled.value[1];
    }
  }
}

TEST(Emitter, AnyTemperatureHasFiniteLevels) {
  for (const CameraResponse& response : {test::lobes(), standard_response()})
    for (double kelvin = 1; kelvin <= 1e5; kelvin *= 3) {
      const EmitterLevels levels = levels_of(response, Emitter::grey, Kelvin(kelvin));
      EXPECT_TRUE(std::isfinite(levels.log_scale)) << kelvin;
      for (const double v : levels.value) EXPECT_TRUE(v >= 0 && v <= 1) << kelvin << ": " << v;
    }
}

TEST(Emitter, SootIsBluerThanGrey) {
  EXPECT_DOUBLE_EQ(relative_absorption(Emitter::grey, 700), 1);
  EXPECT_DOUBLE_EQ(relative_absorption(Emitter::soot, 550), 1);
  const double exponent =
      std::log(relative_absorption(Emitter::soot, 450) / relative_absorption(Emitter::soot, 650)) /
      std::log(650.0 / 450);
  EXPECT_GT(exponent, 0.7) << "about 1 / wavelength";
  EXPECT_LT(exponent, 1.6);
}

TEST(CameraResponse, ComesBackBitByBit) {
  CameraResponse written = test::lobes(3.3);
  const auto read = value_of(parse_camera_response(to_json(written), "r.json"));
  EXPECT_EQ(read, written);
}

TEST(CameraResponse, SaysWhatIsWrong) {
  const auto message = [](const std::string& json) {
    const auto read = parse_camera_response(json, "r.json");
    return read.ok() ? std::string("none") : read.error().message();
  };
  const std::string good =
      R"({"unit": "relative", "wavelength_nm": [400, 700], "r": [1, 2], "g": [1, 1], "b": [0, 0]})";
  EXPECT_EQ(message(good), "none") << "a dead channel is allowed";
  const auto with = [&](const std::string& what, const std::string& by) {
    std::string json = good;
    return message(json.replace(json.find(what), what.size(), by));
  };
  EXPECT_THAT(message("{"), HasSubstr("malformed"));
  EXPECT_THAT(message("[]"), HasSubstr("no JSON object"));
  EXPECT_THAT(with("relative", "lux"), HasSubstr("unit"));
  EXPECT_THAT(with("[400, 700]", "[400]"), HasSubstr("zero width"));
  EXPECT_THAT(with("[400, 700]", "[400, 400]"), HasSubstr("rising"));
  EXPECT_THAT(with("[400, 700]", "[0.4, 0.7]"), HasSubstr("nanometres"));
  EXPECT_THAT(with("[1, 2]", "[1]"), HasSubstr("one for each wavelength"));
  EXPECT_THAT(with("[1, 2]", "[1, 1e40]"), HasSubstr("finite"));
  EXPECT_THAT(with("[1, 2]", "[1, \"2\"]"), HasSubstr("not only numbers"));
  EXPECT_THAT(with("\"b\"", "\"blue\""), HasSubstr("unknown key"));
  EXPECT_THAT(
      message(R"({"unit": "relative", "wavelength_nm": [400, 700], "r": [0, 0], "g": [0, 0], "b": [0, 0]})"),
      HasSubstr("no channel answers"));
}

}  // namespace
}  // namespace emberlock::recon
