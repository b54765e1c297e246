// SPDX-License-Identifier: Apache-2.0
// What the detector promises over many frames: errors near the Cramer-Rao bound, no dot where there is none.
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "smear_sync/detect/detect.h"
#include "tests/support/smear_frames.h"
#include "tests/support/smear_statistics.h"

namespace emberlock::smear {
namespace {

using test::SmearRange;
using test::SmearScene;
using test::SmearTally;

// bench_detect_statistics states the figures over more frames, of seeds that nothing was tuned on.

void expect_at_the_bound(const SmearRange& range, std::uint64_t seed) {
  const SmearTally t = test::read_dots(range, {}, 400, seed);
  std::printf("%d of %d found, bias %.4f, RMS %.4f of %.4f rows, %.3f of the bound, %.1f %% within 2 sigma\n",
              t.found, t.frames, t.mean_error(), t.rms(), t.bound(), t.over_bound(),
              100 * t.within_two_sigma());
  EXPECT_EQ(t.dots, t.found) << "dots where there are none";
  EXPECT_GE(t.found, 0.99 * t.frames);
  EXPECT_LE(t.rms(), 0.2);
  EXPECT_LE(t.over_bound(), 1.15);
  EXPECT_GE(t.within_two_sigma(), 0.9);
  EXPECT_LE(t.within_two_sigma(), 0.995);
  EXPECT_LE(std::abs(t.mean_error()), 3 * t.rms() / std::sqrt(t.found) + 0.005);
}

TEST(DetectProperty, FaintDotsOfSmallLampsAreReadAtTheCramerRaoBound) {
  expect_at_the_bound({.max_radius = 5, .max_amplitude = 5}, 11);
}
TEST(DetectProperty, FaintDotsOfLargeLampsAreReadAtTheCramerRaoBound) {
  expect_at_the_bound({.min_radius = 5, .max_amplitude = 5}, 12);
}
TEST(DetectProperty, BrightDotsAreReadAtTheCramerRaoBound) { expect_at_the_bound({.min_amplitude = 5}, 13); }

TEST(DetectProperty, FramesWithoutADotShowNone) {
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::bayer_rggb8, PixelFormat::rgb8}) {
    const SmearTally t = test::read_dotless(format, 400, 14);
    EXPECT_EQ(t.dots, 0) << name(format);
    EXPECT_LE(t.abstained, 0.02 * t.frames) << name(format);
  }
}

TEST(DetectPropertySlow, ReflectionsWiderThanTheLampShowNoDot) {
  // One in a few thousand does: faint, hardly wider than a small lamp that is clipped, in its glare.
  for (const test::Lookalike kind : test::kReflections)
    EXPECT_LE(test::read_lookalikes(kind, 1000, 18).dots, 1) << "kind " << static_cast<int>(kind);
}

TEST(DetectProperty, BrightLinesShowNoDot) {
  EXPECT_EQ(test::read_lookalikes(test::Lookalike::line, 1000, 19).dots, 0);
}

/// A clipped lamp's width is known by its flanks alone, and these by the lens, which nobody told.
TEST(DetectProperty, DotsOfClippedLampsAreReadWhateverTheLensAndTheMosaic) {
  constexpr int kFrames = 200;
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::bayer_rggb8, PixelFormat::rgb8}) {
    for (const double sharpest : {0.3, 0.6, 1.0}) {
      int found = 0;
      for (int i = 0; i < kFrames; ++i) {
        RandomStream random(77, static_cast<std::uint64_t>(i));
        test::SmearTruth t =
            test::draw_truth({.min_radius = 2.5, .min_amplitude = 6}, 31, static_cast<std::uint64_t>(i));
        t.blur = random.uniform(sharpest, 1.5 * sharpest);
        t.bright = 255 * std::pow(10, random.uniform(0.3, 2));
        SmearScene scene = t.scene();
        if (i % 3 == 0) scene.halo(t.x, t.lamp_y, random.uniform(10, 60), random.uniform(4, 12));
        const Image image = scene.image({.noise = t.noise,
                                         .shot = t.shot,
                                         .seed = 1000 + static_cast<std::uint64_t>(i),
                                         .format = format});
        const SmearReading reading = detect(image.view());
        if (reading.dots.size() == 1 && std::abs(reading.dots[0].y.value() - t.dot_y) < 3) ++found;
      }
      EXPECT_GE(found, 0.98 * kFrames) << name(format) << ", blur from " << sharpest;
    }
  }
}

TEST(DetectProperty, CompressedFramesWithoutADotShowNone) {
  const auto jpeg = [](const std::vector<Image>& film) { return test::jpeg_film(film, 75); };
  EXPECT_EQ(test::read_compressed(jpeg, test::Dots::none, {}, 480, 15).dots, 0);
  for (const int crf : {18, 23, 28}) {
    const auto h264 = [crf](const std::vector<Image>& film) { return test::through_h264(film, crf); };
    EXPECT_EQ(test::read_compressed(h264, test::Dots::none, {}, 144, 16).dots, 0) << "CRF " << crf;
  }
}

TEST(DetectProperty, CompressedDotsErrAsMuchAsTheyState) {
  for (const int crf : {18, 23, 28}) {
    const auto h264 = [crf](const std::vector<Image>& film) { return test::through_h264(film, crf); };
    const SmearTally t = test::read_compressed(h264, test::Dots::one, {}, 192, 17);
    std::printf("CRF %d: %d of %d found, %d abstained, RMS %.3f rows, %.1f %% within 2 sigma\n", crf, t.found,
                t.frames, t.abstained, t.rms(), 100 * t.within_two_sigma());
    EXPECT_EQ(t.dots, t.found) << "dots where there are none";
    EXPECT_GE(t.found, 0.75 * t.frames);
    EXPECT_GE(t.within_two_sigma(), 0.9);
  }
}

TEST(DetectProperty, AMirroredFrameGivesTheMirroredReading) {
  for (std::uint64_t i = 0; i < 40; ++i) {
    RandomStream random(14, i);
    const double lamp = random.uniform(100, 300);
    SmearScene scene(128, 360);
    scene.disk(63.4, lamp, 4, 3000).disk(63.4, lamp < 200 ? lamp + 40 : lamp - 40, 4, random.uniform(5, 30));
    const Image image = scene.image({.seed = i});
    Image mirrored(image.layout());
    for (int y = 0; y < 360; ++y) std::copy_n(image.view().row(359 - y), 128, mirrored.row_as<std::byte>(y));
    const SmearReading a = detect(image.view());
    const SmearReading b = detect(mirrored.view());
    ASSERT_EQ(a.state, b.state) << a.reason << " / " << b.reason;
    ASSERT_EQ(a.dots.size(), b.dots.size());
    for (std::size_t d = 0; d < a.dots.size(); ++d) {
      EXPECT_NEAR(a.dots[d].y.value() + b.dots[d].y.value(), 359, 0.02);
      EXPECT_NE(a.dots[d].side, b.dots[d].side);
    }
  }
}

}  // namespace
}  // namespace emberlock::smear
