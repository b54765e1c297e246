// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "cli/commands.h"
#include "recon/export/volume_file.h"
#include "tests/support/temp_folder.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

/// A ball of 5 cm and 1500 K, of optical radius 0.5, as `reconstruct` would write it.
class MeasureCommandTest : public testing::Test {
 protected:
  void write(const std::string& name, bool with_temperature, bool with_extinction = true) const {
    constexpr int kPoints = 33;
    recon::Volume volume;
    volume.grid = {{-0.06F, -0.06F, -0.06F}, 0.12F / (kPoints - 1), kPoints, kPoints, kPoints};
    volume.emission.assign(3 * volume.grid.size(), 0);
    volume.extinction.assign(volume.grid.size(), 0);
    std::vector<float> kelvin(volume.grid.size());
    std::vector<float> sigma(volume.grid.size());
    for (int k = 0; k < kPoints; ++k)
      for (int j = 0; j < kPoints; ++j)
        for (int i = 0; i < kPoints; ++i) {
          const double edge = 0.12 / (kPoints - 1);
          const double r = edge * std::sqrt(std::pow(i - 16, 2) + std::pow(j - 16, 2) + std::pow(k - 16, 2));
          const double inside = std::clamp((0.05 - r) / edge + 0.5, 0.0, 1.0);
          const std::size_t p = volume.grid.index(i, j, k);
          volume.extinction[p] = static_cast<float>(10 * inside);
          kelvin[p] = inside > 0 ? 1500 : 0;
          sigma[p] = inside > 0 ? 15 : 0;
        }
    if (!with_extinction) volume.extinction.clear();
    std::vector<recon::NamedGrid> further;
    if (with_temperature) {
      further.push_back({"temperature", "K", kelvin});
      further.push_back({"temperature_sigma", "K", sigma});
    }
    ASSERT_TRUE(recon::write_volume(volume, root_ / name, further).ok());
  }
  [[nodiscard]] test::VerbRun run(std::vector<std::string> words) const {
    words.insert(words.begin(), "measure");
    return test::run_verb(add_measure, std::move(words));
  }
  const test::TempFolder root_;
};

using MeasureCommandSlow = MeasureCommandTest;
TEST_F(MeasureCommandSlow, SaysWhatABallRadiates) {
  write("a.vdb", true);
  const auto result = run({(root_ / "a.vdb").string(), (root_ / "a.vdb").string(), "--target", "0,0,-1,0,0,1",
                           "--target-sphere", "0,0,0,0.5", "--out", (root_ / "out").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("1500 K +- 15 on average"));
  std::ifstream in(root_ / "out" / "measures.csv");
  std::string line;
  std::getline(in, line);
  EXPECT_THAT(line, HasSubstr("power_w"));
  std::getline(in, line, ',');
  std::string power;
  std::getline(in, power, ',');
  const double t = 0.5;
  const double expected = 4 * 3.14159265 * 0.05 * 0.05 * 5.670374419e-8 * std::pow(1500, 4) *
                          (1 - (1 - (1 + 2 * t) * std::exp(-2 * t)) / (2 * t * t));
  EXPECT_NEAR(std::stod(power), expected, 0.02 * expected);
  std::getline(in, power, ',');
  EXPECT_NEAR(std::stod(power), 4 * 15 / 1500.0 * expected, 0.005 * expected) << "T^4, all voxels off alike";
  std::getline(in, power, ',');
  EXPECT_NEAR(std::stod(power), expected / (4 * 3.14159265), 0.05 * expected / (4 * 3.14159265))
      << "a metre away";
  const double share = 4 * 15 / 1500.0;
  const double flux = std::stod(power);
  std::getline(in, power, ',');
  EXPECT_NEAR(std::stod(power), share * flux, 0.15 * share * flux) << "its error";
  double caught[3] = {};  // mean and highest flux, power
  for (double& number : caught) {
    std::getline(in, power, ',');
    number = std::stod(power);
    std::getline(in, power, ',');
    EXPECT_NEAR(std::stod(power), share * number, 0.15 * share * number) << "its error";
  }
  EXPECT_NEAR(caught[0], expected / 3.14159265, 0.02 * caught[0]) << "a sphere of half a metre";
  EXPECT_NEAR(caught[1], caught[0], 0.05 * caught[0]);
  EXPECT_NEAR(caught[2], expected, 0.02 * expected);
  EXPECT_THAT(result.out, HasSubstr("on its inner side"));
  std::ifstream page(root_ / "out" / "measures.html");
  const std::string html{std::istreambuf_iterator<char>(page), {}};
  EXPECT_THAT(html, HasSubstr("power that the sphere catches"));
}

/// A thin ball's emission and temperature show where it absorbs; an even extinction that was given doesn't.
TEST_F(MeasureCommandTest, AThinBallRadiatesByItsOwnAbsorption) {
  constexpr int kPoints = 13;
  for (const float absorption : {0.1F, 0.2F, 0.4F})
    for (const float given : {0.0F, 1.0F, 10.0F}) {
      recon::Volume volume;
      volume.grid = {{-0.06F, -0.06F, -0.06F}, 0.12F / (kPoints - 1), kPoints, kPoints, kPoints};
      volume.emission.assign(3 * volume.grid.size(), 1);
      if (given > 0) volume.extinction.assign(volume.grid.size(), given);
      std::vector<float> kelvin(volume.grid.size());
      std::vector<float> sigma(volume.grid.size());
      std::vector<float> absorbs(volume.grid.size());
      std::vector<float> falls(volume.grid.size());
      double filled = 0;  // voxels' worth of absorption
      for (int k = 0; k < kPoints; ++k)
        for (int j = 0; j < kPoints; ++j)
          for (int i = 0; i < kPoints; ++i) {
            if (std::hypot(i - 6, j - 6, k - 6) > 4) continue;
            const std::size_t p = volume.grid.index(i, j, k);
            kelvin[p] = 1500;
            sigma[p] = 15;
            absorbs[p] = absorption;
            falls[p] = 0.1F * absorption;
            ++filled;
          }
      ASSERT_TRUE(recon::write_volume(volume, root_ / "thin.vdb",
                                      {{"temperature", "K", kelvin},
                                       {"temperature_sigma", "K", sigma},
                                       {"absorption", "1/m", absorbs},
                                       {"absorption_sigma", "1/m", falls}})
                      .ok());
      const auto result = run({(root_ / "thin.vdb").string(), "--out", (root_ / "out").string()});
      ASSERT_EQ(result.exit_code, 0) << result.err;
      std::ifstream in(root_ / "out" / "measures.csv");
      std::string cell;
      std::getline(in, cell);
      std::getline(in, cell, ',');
      std::getline(in, cell, ',');
      const double expected = 4 * static_cast<double>(absorption) * filled * std::pow(0.01, 3) *
                              5.670374419e-8 * std::pow(1500, 4);
      EXPECT_NEAR(std::stod(cell), expected, 0.1 * expected);
      std::getline(in, cell, ',');
      EXPECT_NEAR(std::stod(cell), (1 - 0.9 * std::pow(1.01, 4)) * expected, 0.015 * expected)
          << "hotter, but less of it";
    }
}

TEST_F(MeasureCommandTest, SaysWhatIsMissing) {
  write("colour.vdb", false);
  write("thin.vdb", true, false);
  const auto expect_refused = [&](const std::vector<std::string>& words, const char* why) {
    const auto result = run(words);
    EXPECT_NE(result.exit_code, 0);
    EXPECT_THAT(result.err, HasSubstr(why));
  };
  expect_refused({(root_ / "colour.vdb").string()}, "--quantity temperature");
  expect_refused({(root_ / "thin.vdb").string()}, "no extinction");
  expect_refused({(root_ / "none.vdb").string()}, "none.vdb");
  expect_refused({(root_ / "thin.vdb").string(), "--target", "1,2,3"}, "is no target");
  expect_refused({(root_ / "thin.vdb").string(), "--target", "1,2,3,0,0,0"}, "is no target");
  expect_refused({(root_ / "thin.vdb").string(), "--target-sphere", "1,2,3"}, "is no sphere");
  expect_refused({(root_ / "thin.vdb").string(), "--target-sphere", "1,2,3,0"}, "is no sphere");
  expect_refused({(root_ / "thin.vdb").string(), "--target-sphere", "1,2,3,4,"}, "is no sphere");
  expect_refused({(root_ / "thin.vdb").string(), "--up", "w"}, "is no axis");
  write("a.vdb", true);
  expect_refused({(root_ / "a.vdb").string(), "--target-sphere", "0, 0, 0.05, 0.06"}, "cuts the flame");
}

TEST_F(MeasureCommandTest, ASequencesFolderStandsForItsFrames) {
  for (const char* frame : {"flames/frame-3", "flames/frame-12"}) {
    fs::create_directories(root_ / frame);
    write(std::string(frame) + "/volume.vdb", true);
  }
  const auto result = run({(root_ / "flames").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::size_t first = result.out.find("flames/frame-3\n");
  ASSERT_NE(first, std::string::npos) << result.out;
  EXPECT_NE(result.out.find("flames/frame-12\n", first), std::string::npos) << result.out;
}

}  // namespace
}  // namespace emberlock::cli
