// SPDX-License-Identifier: Apache-2.0
// A dot is found by its signal, whatever the depth and the codec of the file that holds it.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/random.h"
#include "smear_sync/detect/detect.h"
#include "tests/support/compressed_frames.h"
#include "tests/support/smear_frames.h"

namespace emberlock::smear {
namespace {

constexpr int kFilms = 12;

/// Frames of a lamp whose dot stands anywhere below it, as a compact camera makes them.
std::vector<Image> deep_film(double dot, double noise) {
  std::vector<Image> frames;
  RandomStream random(11, static_cast<std::uint64_t>(dot));
  for (std::uint64_t i = 0; i < kFilms; ++i) {
    test::SmearScene scene(96, 320);
    scene.disk(44.3, 140.4, 4, 3000).disk(44.3, random.uniform(190, 290), 4, dot);
    frames.push_back(scene.image({.noise = noise, .seed = i + 1}));
  }
  return frames;
}

struct DeepFilm {
  const char* codec;
  double dot;    ///< grey levels of 8 bits
  double noise;  ///< of the sensor

  friend std::ostream& operator<<(std::ostream& out, const DeepFilm& f) {
    return out << f.codec << " dot " << f.dot << " noise " << f.noise;
  }
};

std::vector<Image> deep_coded(const DeepFilm& f) {
  std::vector<Image> frames = deep_film(f.dot, f.noise);
  const std::string codec = f.codec;
  if (codec.starts_with("h264")) return test::through_h264(frames, std::stoi(codec.substr(5)));
  for (Image& image : frames) {
    if (codec.starts_with("jpeg")) image = test::through_jpeg(image, std::stoi(codec.substr(5)));
  }
  return frames;
}

class DeepFilms : public testing::TestWithParam<DeepFilm> {};

TEST_P(DeepFilms, ShowTheDotsOfEightBits) {
  const std::vector<Image> frames = deep_coded(GetParam());
  std::vector<SmearReading> shallow;
  for (const Image& image : frames) shallow.push_back(detect(image.view()));
  for (const int depth : {10, 12, 14, 16}) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      SCOPED_TRACE("frame " + std::to_string(i) + " in " + std::to_string(depth) + " bits");
      const SmearReading deep = detect(test::deepened(frames[i], depth).view());
      ASSERT_EQ(deep.state, shallow[i].state) << shallow[i].reason << "; " << deep.reason;
      ASSERT_EQ(deep.dots.size(), shallow[i].dots.size());
      if (deep.dots.empty()) continue;
      EXPECT_NEAR(deep.dots[0].y.value(), shallow[i].dots[0].y.value(), 0.02);
      EXPECT_NEAR(deep.dots[0].sigma / shallow[i].dots[0].sigma, 1, 0.1);
    }
  }
}

TEST_P(DeepFilms, ShowAsManyDotsThroughTenBitsOfAnotherCodec) {
  int shallow = 0;
  int deep = 0;
  for (const Image& image : deep_coded(GetParam())) {
    shallow += detect(image.view()).state == SmearState::dot ? 1 : 0;
    deep += detect(test::through_prores(image).view()).state == SmearState::dot ? 1 : 0;
  }
  EXPECT_GE(deep, 0.9 * shallow) << shallow << " with 8 bits";
}

INSTANTIATE_TEST_SUITE_P(Of, DeepFilms,
                         testing::Values(DeepFilm{"raw", 40, 0}, DeepFilm{"raw", 12, 0.3},
                                         DeepFilm{"raw", 12, 1.2}, DeepFilm{"raw", 30, 2.5},
                                         DeepFilm{"jpeg 90", 20, 1.2}, DeepFilm{"jpeg 75", 30, 1.2},
                                         DeepFilm{"jpeg 75", 12, 1.2}, DeepFilm{"h264 18", 20, 1.2},
                                         DeepFilm{"h264 23", 40, 0.6}, DeepFilm{"h264 28", 60, 1.2}));

}  // namespace
}  // namespace emberlock::smear
