// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/colour_calibration.h"

#include <gmock/gmock.h>

#include "recon/preprocess/colour_readings.h"
#include "recon/preprocess/samples.h"
#include "tests/support/colour_rig.h"
#include "tests/support/pictures.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

TEST(CalibrateColourSlow, ElevenUnlikeCamerasShowNewPatchesAlikeToOnePercent) {
  const auto rig = test::colour_rig(11, 1);
  const auto calibration = value_of(calibrate_colour(test::film_target(rig, 1)));
  EXPECT_TRUE(calibration.warnings.empty()) << calibration.warnings.front();
  const test::PatchSpread before = test::held_out_spread({rig.front(), rig.back()}, nullptr, 2);
  const test::PatchSpread after = test::held_out_spread(rig, &calibration, 2);
  EXPECT_GT(before.worst_pair, 0.3) << "the cameras are unlike";
  EXPECT_GT(after.compared, 60);
  EXPECT_LE(after.worst, 0.01);
  EXPECT_LE(after.rms, 0.003);
  EXPECT_LE(after.worst_dim, 0.03);
  EXPECT_GT(after.saturated, 10);
  EXPECT_LE(after.unmarked, 1) << "one saturated pixel by itself is a hot one";
}

TEST(CalibrateColourSlow, AFlatPictureTakesDustOut) {
  auto rig = test::colour_rig(2, 2);
  test::put_dust(rig[0], 2);
  ColourReadings readings = test::film_target(rig, 2);
  const auto without = value_of(calibrate_colour(readings));
  EXPECT_TRUE(without.cameras[0].colour.flat.light.empty());
  EXPECT_GT(test::held_out_spread(rig, &without, 3).worst, 0.01);
  test::add_flats(rig, readings);
  const auto calibration = value_of(calibrate_colour(readings));
  EXPECT_LE(test::held_out_spread(rig, &calibration, 3).worst, 0.01);
  EXPECT_GT(calibration.cameras[0].flat_worst, 0.06);
  EXPECT_TRUE(calibration.cameras[1].colour.flat.light.empty()) << "there is nothing on its sensor";
}

/// Thousands of a flat picture's cells must not talk the response into one that is blind to their dust.
TEST(CalibrateColourSlow, ATargetInOnePlaceAndDustyFlatPicturesAreEnough) {
  auto rig = test::colour_rig(2, 2);
  for (std::size_t i = 0; i < rig.size(); ++i) test::put_dust(rig[i], 2 + i);
  ColourReadings readings =
      test::film_target(rig, 2, {.exposures = {0.25, 0.5, 1}, .patches = 8, .dark = true, .places = 1});
  test::add_flats(rig, readings);
  const auto calibration = value_of(calibrate_colour(readings));
  EXPECT_LE(test::held_out_spread(rig, &calibration, 9).worst, 0.015);
  for (const CalibratedColour& camera : calibration.cameras) EXPECT_TRUE(camera.vignetting_known);
}

TEST(CalibrateColourSlow, AResponseThatMostReadingsContradictIsNoResult) {
  const auto rig = test::colour_rig(2, 8);
  ColourReadings readings = test::film_target(rig, 8);
  RandomStream random(1, 2);
  for (PatchReading& p : readings.patches)
    if (p.camera == 1)
      for (double& m : p.mean) m = std::clamp(m * random.uniform(0.99, 1.01), 0.0, 0.98);
  EXPECT_TRUE(calibrate_colour(readings).ok()) << "noise";
  for (PatchReading& p : readings.patches)
    if (p.camera == 1) p.exposure = std::sqrt(p.exposure) * random.uniform(0.8, 1.25);
  EXPECT_THAT(calibrate_colour(readings), FailsWith("camera cam1"));
}

TEST(CalibrateColourSlow, CamerasOfDifferentResolutionsAreMatched) {
  auto rig = test::colour_rig(3, 7);
  rig[1].size = {320, 240};
  rig[2].size = {800, 450};
  const auto calibration = value_of(calibrate_colour(test::film_target(rig, 7)));
  EXPECT_LE(test::held_out_spread(rig, &calibration, 8).worst, 0.01);
}

TEST(FlatField, IsLinearBetweenItsCellsAndSurvivesItsMessage) {
  Colour colour;
  colour.flat = {2, 1, {1, 1, 1, 0.8F, 0.9F, 1.1F}};
  const auto read = value_of(read_colour(to_message(colour), {4, 2}, "camera a"));
  EXPECT_NEAR(light_at(read.flat, 0.1, 0.5)[0], 1, 1e-6) << "outside the cells' middles as at them";
  EXPECT_NEAR(light_at(read.flat, 0.5, 0.9)[0], 0.9, 1e-6);
  EXPECT_NEAR(light_at(read.flat, 0.75, 0)[2], 1.1, 1e-6);
  RadianceImage image({4, 2});
  for (float& v : image.rgb) v = 90;
  equalise(image, read);
  EXPECT_NEAR(image.rgb[1], 90, 1e-4);
  EXPECT_NEAR(image.rgb[9], 90 / 0.8, 1e-4);

  v1::Colour message = to_message(colour);
  message.mutable_flat()->set_rows(2);
  EXPECT_THAT(read_colour(message, {4, 2}, "camera a"), FailsWith("camera a.colour.flat"));
  message = to_message(colour);
  message.mutable_flat()->set_light(4, 0);
  EXPECT_THAT(read_colour(message, {4, 2}, "camera a"), FailsWith("without light"));
}

TEST(CalibrateColourSlow, GainsLieWithinTheirStatedUncertaintyAndHaveTheMeanOne) {
  const auto rig = test::colour_rig(4, 3);
  const auto calibration = value_of(calibrate_colour(test::film_target(rig, 3)));
  for (std::size_t c = 0; c < 3; ++c) {
    double mean = 0;
    double product = 1;
    for (std::size_t i = 0; i < rig.size(); ++i) {
      mean += std::log(rig[i].gain[c]) / 4;
      product *= calibration.cameras[i].colour.gain[c];
    }
    EXPECT_NEAR(product, 1, 1e-9);
    for (std::size_t i = 0; i < rig.size(); ++i) {
      const CalibratedColour& camera = calibration.cameras[i];
      EXPECT_NEAR(std::log(camera.colour.gain[c]), std::log(rig[i].gain[c]) - mean, 4 * camera.gain_sigma[c]);
      EXPECT_LT(camera.gain_sigma[c], 0.01);
    }
  }
  for (std::size_t i = 0; i < rig.size(); ++i) {
    EXPECT_NEAR(calibration.cameras[i].corner, falloff(rig[i].vignetting, 1),
                4 * calibration.cameras[i].corner_sigma);
  }
}

TEST(CalibrateColourSlow, AResponseThatIsNoPowerLawIsFound) {
  auto rig = test::colour_rig(2, 4);
  for (test::ColourTruth& camera : rig) camera.toe = 0.5;
  const auto calibration = value_of(calibrate_colour(test::film_target(rig, 4)));
  EXPECT_LE(test::held_out_spread(rig, &calibration, 5).worst, 0.015);
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (const double v : {0.2, 0.5, 0.8}) {
      const double truth = std::pow(v, rig[i].gamma + 0.5 * (1 - v));
      EXPECT_NEAR(exposure_of(calibration.cameras[i].colour, v) / truth, 1, 0.03) << v;
    }
  }
}

TEST(CalibrateColourSlow, WrongPatchesAreLeftOut) {
  const auto rig = test::colour_rig(2, 6);
  ColourReadings readings = test::film_target(rig, 6);
  for (std::size_t i = 0; i < readings.patches.size(); i += 20)
    for (double& m : readings.patches[i].mean) m *= 0.8;  // a hand's shadow
  const auto calibration = value_of(calibrate_colour(readings));
  EXPECT_LE(test::held_out_spread(rig, &calibration, 7).worst, 0.01);
  EXPECT_GT(calibration.cameras[0].uses[static_cast<std::size_t>(ReadingUse::outlier)], 5);
}

TEST(CalibrateColourSlow, KnownRadiancesTellTheResponseWithoutAnExposureSeries) {
  const auto rig = test::colour_rig(2, 8);
  ColourReadings readings =
      test::film_target(rig, 8, {.exposures = {1}, .patches = 8, .dark = true, .places = 5});
  EXPECT_THAT(calibrate_colour(readings), FailsWith("nothing tells the cameras' response"));
  const auto chart = test::colour_chart(8, 8);
  for (std::size_t p = 0; p < chart.size(); ++p) readings.radiance["p" + std::to_string(p)] = chart[p];
  const auto calibration = value_of(calibrate_colour(readings));
  EXPECT_LE(test::held_out_spread(rig, &calibration, 9).worst, 0.01);
}

TEST(CalibrateColourSlow, AToldGammaIsTaken) {
  auto rig = test::colour_rig(2, 8);
  for (test::ColourTruth& camera : rig) camera.gamma = 2.2;
  const auto calibration = value_of(
      calibrate_colour(test::film_target(rig, 8, {.exposures = {1}, .patches = 8, .dark = true, .places = 5}),
                       {.gamma = 2.2}));
  EXPECT_EQ(calibration.cameras[0].gamma, 2.2);
  EXPECT_LE(test::held_out_spread(rig, &calibration, 9).worst, 0.01);
  EXPECT_THAT(calibrate_colour({}, {.gamma = 9.0}), FailsWith("--gamma"));
}

TEST(CalibrateColourSlow, EveryPatchSaturatedIsSaidSo) {
  const auto rig = test::colour_rig(2, 8);
  ColourReadings readings = test::film_target(rig, 8);
  for (PatchReading& p : readings.patches) p.saturated = {1, 1, 1};
  const auto calibration = calibrate_colour(readings);
  ASSERT_THAT(calibration, FailsWith("are saturated"));
  EXPECT_EQ(calibration.error().kind, ErrorKind::bad_input);
}

TEST(CalibrateColourSlow, ACameraThatSharesNoPatchIsNamedAndTheOthersAreCalibrated) {
  const auto rig = test::colour_rig(3, 8);
  ColourReadings readings = test::film_target(rig, 8);
  for (PatchReading& p : readings.patches)
    if (p.camera == 1) p.patch = "own " + p.patch;
  const auto calibration = value_of(calibrate_colour(readings));
  EXPECT_FALSE(calibration.cameras[1].shares_patches);
  EXPECT_EQ(calibration.cameras[1].colour.gain[0], 1);
  ASSERT_FALSE(calibration.warnings.empty());
  EXPECT_THAT(calibration.warnings.front(), HasSubstr("camera cam1 shares no usable patch"));
  EXPECT_THAT(calibration.advice.front(), HasSubstr("camera cam1"));
  ColourCalibration others;
  others.cameras = {calibration.cameras[0], calibration.cameras[2]};
  EXPECT_LE(test::held_out_spread({rig[0], rig[2]}, &others, 9).worst, 0.01);
}

TEST(CalibrateColourSlow, SamplesThatFallWithLightAreRefused) {
  const auto rig = test::colour_rig(2, 8);
  ColourReadings readings = test::film_target(rig, 8);
  for (PatchReading& p : readings.patches)
    if (p.camera == 1) p.exposure = 1 / p.exposure;
  EXPECT_THAT(calibrate_colour(readings), FailsWith("camera cam1", "more exposure makes it darker"));
}

TEST(CalibrateColourSlow, DarkPicturesBrighterThanTheTargetAreRefused) {
  const auto rig = test::colour_rig(2, 8);
  ColourReadings readings = test::film_target(rig, 8);
  for (auto& histogram : readings.cameras[1].dark.histogram) {
    histogram.assign(256, 0);
    histogram[254] = 1;
  }
  EXPECT_THAT(calibrate_colour(readings), FailsWith("camera cam1: its dark pictures are brighter"));
}

TEST(CalibrateColourSlow, OnePlaceAloneTellsNoVignetting) {
  const auto rig = test::colour_rig(2, 8);
  ColourReadings readings = test::film_target(rig, 8);
  std::erase_if(readings.patches,
                [](const PatchReading& p) { return std::abs(p.x - 320) > 100 || std::abs(p.y - 240) > 60; });
  const auto calibration = value_of(calibrate_colour(readings));
  EXPECT_FALSE(calibration.cameras[0].vignetting_known);
  EXPECT_EQ(calibration.cameras[0].corner, 1);
  EXPECT_THAT(calibration.warnings, testing::Contains(HasSubstr("too few places tell its vignetting")));
}

TEST(ReadPatch, LeavesDirtOutAndCountsWhatIsSaturated) {
  const Image image = image_of({{20, 10}, PixelFormat::rgb8, 8}, [](int x, int y, int c) {
    return std::array{100 + (x & 1), x < 5 ? 255 : 250,
                      x == 7 && y == 3 ? 200 : 51}[static_cast<std::size_t>(c)];
  });
  const PatchReading reading = read_patch(image.view(), {0, 0, 20, 10});
  EXPECT_NEAR(reading.mean[0], 100.5 / 255, 1e-12);
  EXPECT_NEAR(reading.variance[0], 0.25 / (255 * 255), 1e-12);
  EXPECT_EQ(reading.saturated[1], 0.25);
  EXPECT_NEAR(reading.mean[2], 0.2, 1e-12);
  EXPECT_EQ(reading.count[2], 199);
  EXPECT_EQ(reading.x, 10);
}

TEST(ColourPlan, SaysWhichFieldIsWrong) {
  const auto message = [](const char* json) {
    const auto plan = parse_colour_plan(json, "colour.json");
    return plan.ok() ? std::string() : plan.error().message();
  };
  EXPECT_EQ(
      message(R"({"patches": {"a": {"white": [1, 2, 3, 4]}}, "radiance": {"white": 0.9, "red": [1, 2, 3]}})"),
      "");
  EXPECT_THAT(message("[]"), HasSubstr("no JSON object"));
  EXPECT_THAT(message(R"({"patchs": {}})"), HasSubstr("patchs"));
  EXPECT_THAT(message(R"({"patches": {"a": {"white": [1, 2, 3]}}})"), HasSubstr("patches.a.white"));
  EXPECT_THAT(message(R"({"patches": {"a": {"white": [1, 2, 0, 4]}}})"), HasSubstr("patches.a.white"));
  EXPECT_THAT(message(R"({"patches": {"a": {"white": [1, -2, 3, 4]}}})"), HasSubstr("patches.a.white"));
  EXPECT_THAT(message(R"({"pictures": {"a/b.png": 3}})"), HasSubstr("pictures.a/b.png"));
  EXPECT_THAT(message(R"({"radiance": {"white": -1}})"), HasSubstr("radiance.white"));
}

TEST(ColourReadings, FramesOfASessionAreRead) {
  const test::TempFolder folder;
  const ImageLayout layout{{64, 48}, PixelFormat::gray8, 8};
  auto writer = value_of(session::SessionWriter::create(folder / "film", test::manifest_of({layout, layout}),
                                                        test::small_disk_options()));
  for (std::size_t c = 0; c < 2; ++c) {
    for (std::size_t i = 0; i < 3; ++i) {
      Frame frame = test::noise_frame(layout, i);
      frame.image =
          std::make_shared<const Image>(image_of(layout, [&](int, int, int) { return 51 * (i + c); }));
      ASSERT_TRUE(writer.write(c, frame).ok());
    }
  }
  ASSERT_TRUE(writer.finish().ok());
  const auto read = [&](const std::string& frames) {
    test::put_bytes(
        folder / "colour.json",
        R"({"patches": {"cam0": {"white": [8, 8, 16, 16]}, "cam1": {"white": [20, 8, 16, 16]}}, )" + frames +
            "}");
    return read_colour_folder(folder.path());
  };
  const auto readings = value_of(read(
      R"("session": "film", "frames": {"cam0": {"dark": 0, "target_A_0.5s": 2}, "cam1": {"target_A_1s": 1}})"));
  ASSERT_EQ(readings.cameras.size(), 2U);
  EXPECT_EQ(readings.cameras[1].id, "cam1");
  ASSERT_EQ(readings.patches.size(), 2U);
  EXPECT_NEAR(readings.patches[0].mean[0], 102 / 255.0, 1e-9);
  EXPECT_EQ(readings.patches[0].exposure, 0.5);
  EXPECT_EQ(readings.patches[0].light, "A");
  EXPECT_NEAR(readings.patches[1].mean[0], 102 / 255.0, 1e-9) << "frame 1 of the other camera";
  EXPECT_THAT(read(R"("frames": {"cam0": {"dark": 0}})"), FailsWith("session"));
  EXPECT_THAT(read(R"("session": "film", "frames": {"cam7": {"dark": 0}})"), FailsWith("cam7"));
  EXPECT_THAT(read(R"("session": "film", "frames": {"cam0": {"dark": 9}})"), FailsWith("there are 3 frames"));
  EXPECT_THAT(read(R"("session": "film", "frames": {"cam0": {"light": 0}})"),
              FailsWith("neither dark, flat nor target"));
  EXPECT_THAT(read(R"("session": "film", "frames": {"cam0": {"dark": -1}})"), FailsWith("frames.cam0.dark"));
}

}  // namespace
}  // namespace emberlock::recon
