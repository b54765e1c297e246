// What the detector promises over many frames: errors near the Cramer-Rao bound, no dot where there is none.
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "smear_sync/detect.h"
#include "tests/support/smear_frames.h"

namespace emberlock {
namespace {

using test::SmearScene;

struct Truth {
  double lamp_x, lamp_y, radius, dot_y, amplitude, noise;
};

/// The bound for the row of a disk of known shape: any other unknown of the model (level, amplitude, column,
/// radius) is even in y about the centre and shares no information with it.
double cramer_rao(const Truth& t, const SmearScene& without, double blur) {
  constexpr double kStep = 0.05;
  double information = 0;
  for (int y = 0; y < without.height(); ++y) {
    if (std::abs(y - t.dot_y) > t.radius + 6) continue;
    for (int x = 0; x < without.width(); ++x) {
      if (std::abs(x - t.lamp_x) > t.radius + 6) continue;
      const double dx = x - t.lamp_x;
      const double dy = y - t.dot_y;
      const double slope = t.amplitude *
                           (SmearScene::coverage(dx, dy + kStep, t.radius, blur) -
                            SmearScene::coverage(dx, dy - kStep, t.radius, blur)) /
                           (2 * kStep);
      information += slope * slope;
    }
  }
  // Rounding to integers adds 1/12 to the variance.
  return std::sqrt((t.noise * t.noise + 1.0 / 12) / information);
}

struct Statistics {
  double squares = 0, sum = 0, bounds = 0, reported = 0;
  int frames = 0, found = 0, wrong = 0;
};

Statistics run(double weakest, double strongest, int frames, std::uint64_t seed) {
  Statistics s;
  for (int i = 0; i < frames; ++i) {
    RandomStream random(seed, static_cast<std::uint64_t>(i));
    Truth t{};
    t.lamp_x = random.uniform(58, 70);
    t.lamp_y = random.uniform(60, 300);
    t.radius = random.uniform(3, 5);
    const double shift = std::floor(random.uniform(25, 150));
    t.dot_y = t.lamp_y > 180 ? t.lamp_y - shift : t.lamp_y + shift;
    t.amplitude = random.uniform(weakest, strongest);
    t.noise = random.uniform(1, 1.5);
    const double bright = random.uniform() < 0.5 ? 200 : 3000;
    SmearScene scene(128, 360);
    scene.disk(t.lamp_x, t.lamp_y, t.radius, bright);
    const double bound = cramer_rao(t, scene, 0.8);
    scene.disk(t.lamp_x, t.dot_y, t.radius, t.amplitude);
    const SmearReading r =
        detect(scene.image({.noise = t.noise, .seed = seed + static_cast<std::uint64_t>(i)}).view());
    ++s.frames;
    if (r.state != SmearState::dot) continue;
    const double error = r.dots[0].y.value() - t.dot_y;
    if (std::abs(error) > 3) {
      ++s.wrong;
      continue;
    }
    ++s.found;
    s.sum += error;
    s.squares += error * error;
    s.bounds += bound * bound;
    s.reported += r.dots[0].sigma.value() * r.dots[0].sigma.value();
  }
  std::printf(
      "dots of %.0f..%.0f levels: %d of %d found, RMS %.3f rows, bias %.4f, Cramer-Rao %.3f, reported %.3f\n",
      weakest, strongest, s.found, s.frames, std::sqrt(s.squares / s.found), s.sum / s.found,
      std::sqrt(s.bounds / s.found), std::sqrt(s.reported / s.found));
  return s;
}

void expect_good(const Statistics& s) {
  EXPECT_EQ(s.wrong, 0);
  EXPECT_GE(s.found, 0.98 * s.frames);
  const double rms = std::sqrt(s.squares / s.found);
  EXPECT_LE(rms, 0.2);
  EXPECT_LE(rms, 1.6 * std::sqrt(s.bounds / s.found));
  EXPECT_NEAR(std::sqrt(s.reported / s.found) / rms, 1, 0.3) << "the reported sigma is the error";
  EXPECT_LE(std::abs(s.sum / s.found), 3 * rms / std::sqrt(s.found) + 0.005) << "no bias";
}

TEST(DetectProperty, FaintDotsAreReadNearTheCramerRaoBound) { expect_good(run(4, 5, 1000, 11)); }
TEST(DetectProperty, DotsAreReadNearTheCramerRaoBound) { expect_good(run(5, 40, 300, 12)); }

TEST(DetectProperty, FramesWithoutADotShowNone) {
  int dots = 0;
  constexpr int kFrames = 400;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    RandomStream random(13, i);
    const double x = random.uniform(58, 70);
    const double y = random.uniform(60, 300);
    const double radius = random.uniform(2.2, 6);
    SmearScene scene(128, 360);
    scene.disk(x, y, radius, random.uniform() < 0.5 ? 200 : 3000);
    if (i % 2 == 0) scene.halo(x, y, random.uniform(10, 100), random.uniform(4, 12));
    if (i % 3 == 0) scene.bloom(x, y, radius / 2, random.uniform(5, 60), random.uniform(5, 60), 500);
    for (int hot = 0; hot < 60; ++hot) {
      const int hx = static_cast<int>(random.uniform(1, 126));
      const int hy = static_cast<int>(random.uniform(1, 358));
      const double value = random.uniform(5, 200);
      scene.at(hx, hy) += value;
      if (hot % 4 == 0) scene.at(hx + 1, hy) += value * random.uniform();
      if (hot % 8 == 0) scene.at(hx, hy + 1) += value * random.uniform();
    }
    const SmearReading r = detect(scene.image({.noise = random.uniform(0.3, 3), .seed = i}).view());
    if (r.dots.empty()) continue;
    ++dots;
    ADD_FAILURE() << "frame " << i << ": " << r.reason << " (row " << r.dots[0].y.value() << ", lamp " << x
                  << ", " << y << ", radius " << radius << ")";
  }
  std::printf("false dots: %d in %d frames\n", dots, kFrames);
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
}  // namespace emberlock
