// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>

#include "recon/adjust/picture_error.h"
#include "recon/preprocess/develop.h"
#include "session/media/frame_file.h"
#include "tests/support/flame_frames.h"
#include "tests/support/pictures.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

const RadianceImage& small_flame_picture() {
  static const RadianceImage picture = test::flame_picture(11, {320, 240});
  return picture;
}

TEST(Samples, FollowTheResponseAndTheDarkLevel) {
  Image image(ImageLayout{{3, 1}, PixelFormat::gray8, 8});
  image.row_as<std::uint8_t>(0)[0] = 51;
  image.row_as<std::uint8_t>(0)[2] = 255;
  Colour colour;
  colour.response = {0, 0.04, 0.16, 0.36, 0.64, 1};  // of 0, 0.2 .. 1
  colour.dark = {0.5, 0.01, 0.5};
  const Samples samples = samples_of(image.view(), &colour);
  EXPECT_FLOAT_EQ(samples.value[0], 255 * 0.03F);
  EXPECT_FLOAT_EQ(samples.value[1], 255 * -0.01F) << "noise stays on both sides of 0";
  EXPECT_EQ(samples.saturated, (std::vector<std::uint8_t>{0, 0, 1}));
}

TEST(Samples, SaturatedOnesBecomeBoundsThroughTheMosaic) {
  Image image(ImageLayout{{8, 8}, PixelFormat::bayer_rggb8, 8});
  image.row_as<std::uint8_t>(4)[4] = 255;  // a red one
  std::vector<std::uint8_t> bounds;
  for (const Demosaicing how : {Demosaicing::bilinear, Demosaicing::gradient}) {
    (void)to_picture(samples_of(image.view()), &bounds, how);
    ASSERT_EQ(bounds.size(), 64U);
    EXPECT_EQ(bounds[4 * 8 + 4], 1);
    EXPECT_EQ(bounds[4 * 8 + 5], 1) << "red interpolated from it";
    EXPECT_EQ(bounds[5 * 8 + 5], 1);
    EXPECT_EQ(bounds[4 * 8 + 6], 0) << "a red one of its own";
  }
  image.row_as<std::uint8_t>(4)[4] = 254;
  (void)to_picture(samples_of(image.view()), &bounds);
  EXPECT_TRUE(bounds.empty()) << "nothing is kept where nothing is saturated";
}

TEST(Colour, EqualisingTakesGainAndVignettingOut) {
  Colour colour;
  colour.gain = {1, 0.8, 1.25};
  colour.vignetting = {-0.3, 0, 0};
  RadianceImage image({5, 5});
  std::fill(image.rgb.begin(), image.rgb.end(), 70.F);
  equalise(image, colour);
  EXPECT_FLOAT_EQ(image.rgb[3 * 12], 70);
  EXPECT_FLOAT_EQ(image.rgb[3 * 12 + 1], 56);
  const double corner = 1 - 0.3 * 0.64;  // the corner pixel's centre lies 0.8 half diagonals out
  EXPECT_NEAR(image.rgb[0], 70 / corner, 1e-4);
}

TEST(Colour, GoesThroughTheManifestAndIsCheckedThere) {
  Colour colour;
  colour.response = {0, 0.3, 1};
  colour.gain = {0.9, 1, 1.1};
  colour.dark = {0.01, 0.02, 0.03};
  colour.vignetting = {-0.2, -0.1, 0};
  colour.hot_pixels = {3, 7};
  const auto back = value_of(read_colour(to_message(colour), {10, 10}, "camera a"));
  EXPECT_EQ(back.response, colour.response);
  EXPECT_EQ(back.vignetting, colour.vignetting);
  EXPECT_EQ(back.hot_pixels, colour.hot_pixels);
  const auto message_where = [&](auto&& change) {
    v1::Colour message = to_message(colour);
    change(message);
    const auto read = read_colour(message, {10, 10}, "camera a");
    return read.ok() ? std::string() : read.error().message();
  };
  EXPECT_THAT(message_where([](v1::Colour& m) { m.set_response(1, 1.5); }),
              HasSubstr("camera a.colour.response"));
  EXPECT_THAT(message_where([](v1::Colour& m) { m.set_response(2, 0.9); }), HasSubstr("from 0 to 1"));
  EXPECT_THAT(message_where([](v1::Colour& m) { m.set_gain(0, 0); }), HasSubstr("colour.gain"));
  EXPECT_THAT(message_where([](v1::Colour& m) { m.add_gain(1); }), HasSubstr("three finite"));
  EXPECT_THAT(message_where([](v1::Colour& m) { m.set_dark(0, NAN); }), HasSubstr("colour.dark"));
  EXPECT_THAT(message_where([](v1::Colour& m) { m.set_vignetting(0, -1.5); }), HasSubstr("without light"));
  EXPECT_THAT(message_where([](v1::Colour& m) { m.add_hot(100); }), HasSubstr("colour.hot"));
}

TEST(Demosaicing, BilinearIsTheBetterOneOnFlamesAndGradientOnPicturesWithEdges) {
  for (const double noise : {0.0, 1.0, 3.0}) {
    const auto [bilinear, gradient] = test::demosaicing_errors(small_flame_picture(), noise);
    EXPECT_LT(bilinear, 1.02 * gradient) << noise;
  }
  const auto picture = value_of(session::read_image("/usr/share/doc/opencv-doc/examples/data/fruits.jpg"));
  test::FilmOptions film;
  film.format = PixelFormat::bayer_rggb8;
  film.level = 0;
  film.noise = 0;
  const RadianceImage truth = to_radiance(picture.view());
  const Samples mosaic = samples_of(test::film(truth, film, 1).view());
  const double bilinear = all_channels(rmse(to_picture(mosaic), truth, {}));
  const double gradient = all_channels(rmse(to_picture(mosaic, nullptr, Demosaicing::gradient), truth, {}));
  EXPECT_LT(gradient, 0.8 * bilinear) << bilinear;
}

/// (1 2 1) x (1 2 1) over the samples of a channel; the sample itself where it was measured.
double convolved(const ImageView& mosaic, int x, int y, int channel) {
  if (mosaic_channel(x, y) == channel) return mosaic.sample(x, y);
  double sum = 0;
  double weights = 0;
  for (int v = std::max(0, y - 1); v <= std::min(mosaic.layout.size.height - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(mosaic.layout.size.width - 1, x + 1); ++u) {
      if (mosaic_channel(u, v) != channel) continue;
      const double weight = (2 - std::abs(u - x)) * (2 - std::abs(v - y));
      sum += weight * mosaic.sample(u, v);
      weights += weight;
    }
  }
  return weights > 0 ? sum / weights : 0;
}

TEST(Demosaicing, BilinearIsTheNormalisedConvolutionWithSaturatedSamplesAndWithout) {
  for (const ImageSize size : {ImageSize{1, 1}, ImageSize{2, 5}, ImageSize{3, 3}, ImageSize{16, 10}}) {
    for (const double most : {254.0, 270.0}) {
      RandomStream random(static_cast<std::uint64_t>(size.width), static_cast<std::uint64_t>(most));
      const Image image = image_of({size, PixelFormat::bayer_rggb8, 8},
                                   [&](int, int, int) { return std::min(255.0, random.uniform(0, most)); });
      const RadianceImage picture = to_picture(samples_of(image.view()));
      for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
          for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(picture.rgb[3 * (y * size.width + x) + c], convolved(image.view(), x, y, c), 1e-4)
                << size.width << " x " << size.height << ", most " << most << ": " << x << ' ' << y << ' '
                << c;
    }
  }
}

TEST(Demosaicing, GradientKeepsSamplesAndRestoresLinearRamps) {
  const auto ramp = [](int x, int y, int c) { return 10 + (c + 1) * 3 * x + (3 - c) * 2 * y; };
  const Image image = image_of({{12, 12}, PixelFormat::bayer_rggb8, 8},
                               [&](int x, int y, int) { return ramp(x, y, mosaic_channel(x, y)); });
  const RadianceImage picture = to_picture(samples_of(image.view()), nullptr, Demosaicing::gradient);
  for (int y = 2; y < 10; ++y)
    for (int x = 2; x < 10; ++x)
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(picture.rgb[3 * (y * 12 + x) + c], ramp(x, y, c), 1e-3) << x << ' ' << y;
}

TEST(Smear, IsFoundAndTakenOutOfEveryLayout) {
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::bayer_rggb8, PixelFormat::rgb8}) {
    const test::SmearedFlame flame = test::smeared_flame(small_flame_picture(), format, 1e-3, 200, 1);
    std::string why;
    const auto smear = find_smear(flame.seen, &why);
    ASSERT_TRUE(smear.has_value()) << why;
    EXPECT_NEAR(smear->fraction[0], 1e-3, 5 * smear->sigma + 1e-5);
    Samples cleaned = flame.seen;
    remove_smear(cleaned, *smear);
    const double before = test::rms_of(flame.seen, flame.clean);
    EXPECT_GT(before, 1);
    EXPECT_LT(test::rms_of(cleaned, flame.clean), 0.03 * before) << name(format);
  }
}

TEST(Smear, WhereAFlameHasNoneNoneIsFound) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::string why;
    EXPECT_FALSE(
        find_smear(test::smeared_flame(small_flame_picture(), PixelFormat::gray8, 0, 200, seed).clean, &why));
    EXPECT_THAT(why, HasSubstr("show none"));
  }
}

TEST(Smear, SaturatedColumnsAreTakenFromWhatTheirDarkRowsShow) {
  const test::SmearedFlame flame =
      test::smeared_flame(small_flame_picture(), PixelFormat::gray8, 1e-3, 420, 1);
  const auto smear = find_smear(flame.seen);
  ASSERT_TRUE(smear.has_value());
  Samples cleaned = flame.seen;
  remove_smear(cleaned, *smear);
  EXPECT_LT(test::rms_of(cleaned, flame.clean), 0.05 * test::rms_of(flame.seen, flame.clean));
}

TEST(Smear, AFlameCutByTheBorderIsNoSmear) {
  RadianceImage cut({320, 120});  // the lower half of the flame is out of the picture
  std::copy_n(small_flame_picture().rgb.begin(), cut.rgb.size(), cut.rgb.begin());
  const Samples samples = test::smeared_flame(cut, PixelFormat::gray8, 0, 200, 1).clean;
  EXPECT_FALSE(find_smear(samples).has_value());
}

TEST(Smear, AFrameWithoutFlameHasNoRowsToTellItFrom) {
  test::FilmOptions dark;
  std::string why;
  EXPECT_FALSE(find_smear(samples_of(test::film(RadianceImage({64, 48}), dark, 1).view()), &why));
  EXPECT_THAT(why, HasSubstr("no rows without flame"));
}

TEST(HotPixels, AreFoundInDarkFramesAndInTheFlameAndReplaced) {
  const test::HotPixelRates rates =
      test::hot_pixel_rates(small_flame_picture(), PixelFormat::bayer_rggb8, 40, 1);
  EXPECT_EQ(rates.dark_found, 100);
  EXPECT_EQ(rates.dark_false, 0);
  EXPECT_GE(rates.picture_found, 95);
  EXPECT_EQ(rates.picture_false, 0);

  test::FilmOptions film;
  film.noise = 0;
  film.format = PixelFormat::bayer_rggb8;
  film.hot = {10 * 320 + 7, 10 * 320 + 9, 120 * 320 + 160};
  film.hot_level = 200;
  Samples samples = samples_of(test::film(small_flame_picture(), film, 1).view());
  film.hot.clear();
  const Samples truth = samples_of(test::film(small_flame_picture(), film, 1).view());
  replace_hot_pixels(samples, {10 * 320 + 7, 10 * 320 + 9, 120 * 320 + 160});
  for (std::size_t i = 0; i < truth.value.size(); ++i) ASSERT_NEAR(samples.value[i], truth.value[i], 12) << i;
  EXPECT_EQ(samples.value[10 * 320 + 7], truth.value[10 * 320 + 7]);
  if (!samples.saturated.empty()) {
    EXPECT_EQ(samples.saturated[120 * 320 + 160], 0);
  }
}

TEST(DarkPart, AFlameThatGoesOutOnlyDims) {
  test::FilmOptions film;
  const Samples lit = samples_of(test::film(small_flame_picture(), film, 1).view());
  const Samples dark = samples_of(test::film(RadianceImage({320, 240}), film, 2).view());
  const Samples later = samples_of(test::film(RadianceImage({320, 240}), film, 3).view());
  const Samples other = samples_of(test::film(test::flame_picture(12, {320, 240}), film, 4).view());
  EXPECT_EQ(light_change(lit, dark), LightChange::gone_out);
  EXPECT_EQ(light_change(dark, later), LightChange::none);
  EXPECT_EQ(light_change(dark, lit), LightChange::other);
  EXPECT_EQ(light_change(lit, other), LightChange::other) << "flames flicker both ways";
}

TEST(DarkPart, TakesAWallsLightOutWhichALevelDoesNot) {
  const test::BackgroundResidual off = test::background_residual(small_flame_picture(), 1);
  EXPECT_GT(off.level, 3);
  EXPECT_LT(off.dark_part, 1.3) << "a frame's noise of 1, and the background's";
}

TEST(Develop, SaysWhatRanAndWhy) {
  test::FilmOptions film;
  film.gain = 2;
  CameraFrame camera;
  camera.frame = share(test::film(small_flame_picture(), film, 1));
  camera.sensor = SensorKind::rolling_shutter;
  const DevelopedPicture plain = develop(camera);
  std::vector<std::string> on;
  for (const PreprocessStep& step : plain.steps) {
    EXPECT_FALSE(step.reason.empty()) << step.name;
    if (step.on) on.push_back(step.name);
  }
  EXPECT_EQ(on, std::vector<std::string>{"saturated pixels"});
  EXPECT_EQ(plain.bounds.size(), std::size_t{320} * 240);

  const auto both = together({{"a", plain.steps}, {"b", plain.steps}});
  EXPECT_EQ(both[0].reason, plain.steps[0].reason);
  auto other = plain.steps;
  other[0] = {other[0].name, true, "by the calibrated response"};
  const auto mixed = together({{"a", plain.steps}, {"b", other}, {"c", plain.steps}});
  EXPECT_TRUE(mixed[0].on);
  EXPECT_THAT(mixed[0].reason,
              HasSubstr("1 of 3 cameras, b: by the calibrated response; 2 of 3 cameras, first a"));
}

}  // namespace
}  // namespace emberlock::recon
