// SPDX-License-Identifier: Apache-2.0
#include "cli/black_body.h"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "base/random.h"
#include "cli/commands.h"
#include "recon/calibrate/rig.h"
#include "recon/export/picture.h"
#include "recon/kernels/planck.h"
#include "recon/temperature/response_fit.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;
using Words = std::vector<std::string>;

/// A camera that is no sRGB: three lobes.
recon::CameraResponse furnace_camera(double scale) {
  recon::CameraResponse camera;
  camera.absolute = true;
  for (double nm = 380; nm <= 780; nm += 2) {
    camera.wavelength_nm.push_back(nm);
    const std::array middle = {603.0, 541.0, 455.0};
    const std::array width = {34.0, 38.0, 25.0};
    const std::array high = {1.0, 0.9, 1.6};
    for (std::size_t c = 0; c < 3; ++c)
      camera.level[c].push_back(scale * high[c] * std::exp(-0.5 * std::pow((nm - middle[c]) / width[c], 2)));
  }
  return camera;
}

std::array<double, 3> furnace_levels(const recon::CameraResponse& camera, double kelvin,
                                     const recon::KnownEmitter& emitter = {}) {
  std::array<double, 3> level{};
  for (std::size_t c = 0; c < 3; ++c)
    level[c] = recon::integral(camera, c, [&](double nm) {
      return recon::emittance(emitter, nm, Kelvin(kelvin)) * std::exp(recon::log_planck(nm, kelvin));
    });
  return level;
}

class BlackBody : public testing::Test {
 protected:
  /// A furnace's mouth of 80 x 60 pixels before a dim wall; noise 0.7, 8 bits, black at 3.
  std::string film(const std::string& name, const std::array<double, 3>& level, double black = 0) const {
    Image picture(ImageLayout{{192, 144}, PixelFormat::rgb8, 8});
    for (int y = 0; y < 144; ++y)
      for (int x = 0; x < 192; ++x)
        for (int c = 0; c < 3; ++c) {
          const bool mouth = x >= 50 && x < 130 && y >= 40 && y < 100;
          const auto i = static_cast<std::uint64_t>((y * 192 + x) * 3 + c);
          const double v = black + (mouth ? level[static_cast<std::size_t>(c)] : 0.01) +
                           0.7 * random_normal(std::hash<std::string>{}(name), 1, i);
          picture.row_as<std::uint8_t>(y)[3 * x + c] =
              static_cast<std::uint8_t>(std::clamp(std::round(v), 0.0, 255.0));
        }
    EXPECT_TRUE(recon::write_png(picture.view(), folder_.path() / name).ok());
    return (folder_.path() / name).string();
  }
  test::VerbRun calibrate(Words words) const {
    words.insert(words.begin(), {"calibrate", "colour"});
    words.insert(words.end(), {"--out", (folder_.path() / "out").string()});
    return test::run_verb(add_calibrate, words);
  }
  /// So that green is 120 at 1800 K.
  [[nodiscard]] static recon::CameraResponse camera() {
    return furnace_camera(120 / furnace_levels(furnace_camera(1), 1800)[1]);
  }
  test::TempFolder folder_;
};

TEST_F(BlackBody, AFurnaceOfThreeTemperaturesTellsTheResponse) {
  const recon::CameraResponse truth = camera();
  Words words{"--black-body", "1600,1700,1800", "--base", "sensor", "--dark", film("dark.png", {}, 3)};
  for (const int t : {1600, 1700, 1800}) {
    const auto level = furnace_levels(truth, t);
    words.push_back(film(fmt::format("{}.png", t), level, 3));
  }
  const auto run = calibrate(words);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* part :
       {"R            peak", "shift", "% by the pictures", "1600.png", "response.json", "2000 K"})
    EXPECT_THAT(run.out, HasSubstr(part));
  const auto found = recon::read_camera_response(folder_.path() / "out" / "response.json");
  ASSERT_TRUE(found.ok()) << found.error().message();
  EXPECT_TRUE(found->absolute);
  EXPECT_TRUE(fs::exists(folder_.path() / "out" / "response.html"));
  // A flame between those temperatures is read as bright as it is; in red, that isn't at white.
  const auto told = furnace_levels(*found, 1680);
  const auto own = furnace_levels(truth, 1680);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(told[c] / own[c], 1, 0.02) << c;
}

TEST_F(BlackBody, ALampsRibbonNeedsItsEmissivityAndWindow) {
  recon::KnownEmitter lamp = *recon::parse_known_emitter("tungsten");
  lamp.window = 0.92;
  const recon::CameraResponse truth = camera();
  const std::string a = film("a.png", furnace_levels(truth, 1700, lamp));
  const std::string b = film("b.png", furnace_levels(truth, 1900, lamp));
  const auto run = calibrate({"--black-body", "1700,1900", "--emitter", "tungsten", "--window", "0.92",
                              "--base", "sensor", "--region", "60,50,60,40", a, b});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto found = recon::read_camera_response(folder_.path() / "out" / "response.json");
  const auto told = furnace_levels(*found, 1800);
  EXPECT_NEAR(told[1] / furnace_levels(truth, 1800)[1], 1, 0.02);
}

TEST_F(BlackBody, HotterPicturesMayBeExposedShorter) {
  const recon::CameraResponse truth = camera();
  auto hot = furnace_levels(truth, 2600);
  for (double& level : hot) level *= 0.002 / 0.16;
  const std::string a = film("a.png", furnace_levels(truth, 1700));
  const std::string b = film("b.png", hot);
  const auto run =
      calibrate({"--black-body", "1700,2600", "--exposure", "0.16,0.002", "--base", "sensor", a, b});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto found = recon::read_camera_response(folder_.path() / "out" / "response.json");
  EXPECT_NEAR(furnace_levels(*found, 2000)[1] / furnace_levels(truth, 2000)[1], 1, 0.03);
  for (const char* bad : {"1,2,3", "0", "-1,1", "x"})
    EXPECT_THAT(calibrate({"--black-body", "1700,2600", "--exposure", bad, a, b}).err,
                HasSubstr("--exposure"));
}

TEST_F(BlackBody, TheRigsCameraGetsIt) {
  v1::Rig rig = recon::empty_rig();
  for (const char* id : {"left", "right"}) {
    v1::RigCamera& camera = *rig.add_cameras();
    camera.set_camera_id(id);
    camera.set_width(192);
    camera.set_height(144);
    for (const double gain : {2.0, 1.0, 1.0}) camera.mutable_colour()->add_gain(gain);
  }
  const fs::path file = folder_.path() / "rig.json";
  ASSERT_TRUE(session::write_rig(file, rig).ok());
  auto level = furnace_levels(camera(), 1700);
  level[0] /= 2;
  Words words{"--black-body", "1700", "--base", "sensor", "--rig", file.string(), film("a.png", level)};
  EXPECT_THAT(calibrate(words).err, HasSubstr("left, right"));
  words.insert(words.end(), {"--camera", "right", "--exposure", "0.004"});
  const auto run = calibrate(words);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto written = session::read_rig(folder_.path() / "out" / "rig.json");
  ASSERT_TRUE(written.ok());
  EXPECT_FALSE(written->cameras(0).colour().has_spectral());
  EXPECT_EQ(written->cameras(1).colour().exposure_s(), 0.004);
  EXPECT_EQ(written->cameras(1).colour().gain(0), 2);
  const auto common = recon::common_response(*written, "rig.json");
  ASSERT_TRUE(common.ok() && *common);
  EXPECT_NEAR(furnace_levels(**common, 1700)[0] / (2 * level[0]), 1, 0.02) << "of pictures with their gains";
}

TEST_F(BlackBody, WhatCantBeIsRefusedWithARemedy) {
  const std::string lit = film("lit.png", furnace_levels(camera(), 1700));
  const std::string black = film("black.png", {});
  struct Case {
    Words words;
    const char* part;
  };
  for (const Case& c :
       {Case{{"--black-body", "1700,1800", lit}, "one picture for each temperature"},
        Case{{"--black-body", "1", lit}, "500 to 6000 K"},
        Case{{"--black-body", "1e5", lit}, "500 to 6000 K"},
        Case{{"--black-body", "warm", lit}, "Give temperatures in kelvin"},
        Case{{"--black-body", "1700,", lit}, "Give temperatures in kelvin"},
        Case{{"--black-body", "1700", "--emitter", "coal", lit}, "tungsten"},
        Case{{"--black-body", "1700", "--region", "1,2,3", lit}, "--region"},
        Case{{"--black-body", "1700", "--region", "900,0,9,9", lit}, "192 x 144"},
        Case{{"--black-body", "1700", "--region", "60,50,60,40", black}, "nothing above its noise"},
        Case{{"--black-body", "1700", "--base", "none.json", lit}, "none.json"},
        Case{{"--black-body", "1700", "none.png"}, "none.png"}, Case{{lit, black}, "--black-body"}}) {
    const auto run = calibrate(c.words);
    EXPECT_EQ(run.exit_code, 2) << c.part;
    EXPECT_THAT(run.err, HasSubstr(c.part));
    EXPECT_FALSE(fs::exists(folder_.path() / "out"));
  }
  EXPECT_EQ(calibrate({"--emitter", "furnace", lit}).exit_code, 2) << "an option of --black-body alone";
}

}  // namespace
}  // namespace emberlock::cli
