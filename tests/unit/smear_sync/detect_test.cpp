// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/detect.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "tests/support/compressed_frames.h"
#include "tests/support/smear_frames.h"

namespace emberlock::smear {
namespace {

using test::SmearScene;
using test::through_h264;
using test::through_jpeg;

constexpr double kLampX = 81.3;
constexpr double kLampY = 340.4;
constexpr double kRadius = 4;
constexpr double kBright = 3000;  // a lamp overexposed tenfold: saturated

SmearScene lamp_scene(double peak = kBright) {
  return SmearScene(160, 720).disk(kLampX, kLampY, kRadius, peak);
}

testing::AssertionResult reads(const SmearReading& reading, SmearState state) {
  if (reading.state == state) return testing::AssertionSuccess() << reading.reason;
  return testing::AssertionFailure() << "state " << name(reading.state) << ": " << reading.reason;
}

void expect_lamp(const SmearReading& reading, double x, double y, double tolerance) {
  ASSERT_TRUE(reading.lamp) << reading.reason;
  EXPECT_NEAR(reading.lamp->x, x, tolerance);
  EXPECT_NEAR(reading.lamp->y.value(), y, tolerance);
}

void expect_one_dot(const SmearReading& reading, double y, double tolerance) {
  ASSERT_TRUE(reads(reading, SmearState::dot));
  ASSERT_EQ(reading.dots.size(), 1U);
  EXPECT_NEAR(reading.dots[0].y.value(), y, tolerance);
  EXPECT_FALSE(reading.reason.empty());
}

/// A saturated lamp whose columns overflow `above` and `below`, each as far as the disk's own rim and no
/// less.
SmearScene capsule(double above, double below) {
  SmearScene scene(160, 720);
  scene.disk(kLampX, kLampY, kRadius, kBright).disk(kLampX, kLampY - 100, kRadius, 20);
  for (double shift = -above; shift <= below; shift += 0.5)
    scene.disk(kLampX, kLampY + shift, kRadius - 0.5, kBright, 0.1);
  return scene;
}

/// A scene, and what its frame is read as.
struct Situation {
  const char* name;
  SmearScene (*scene)();
  SmearState state;
  double dot = 0, dot_within = 0;  ///< row
  double lamp_within = 0;          ///< 0: it may be anywhere
  double lamp_x = kLampX, lamp_y = kLampY;
  SmearScene::Sensor sensor = {};

  friend std::ostream& operator<<(std::ostream& out, const Situation& s) { return out << s.name; }
};

class DetectSituation : public testing::TestWithParam<Situation> {};

TEST_P(DetectSituation, IsRead) {
  const Situation& s = GetParam();
  const SmearReading r = detect(s.scene().image(s.sensor).view());
  ASSERT_TRUE(reads(r, s.state));
  if (s.state == SmearState::dot) {
    expect_one_dot(r, s.dot, s.dot_within);
    EXPECT_EQ(r.dots[0].side, r.dots[0].y < r.lamp->y ? Side::above : Side::below);
  } else {
    EXPECT_TRUE(r.dots.empty());
    EXPECT_TRUE(!r.lamp || s.state != SmearState::no_lamp);
  }
  if (s.lamp_within > 0) expect_lamp(r, s.lamp_x, s.lamp_y, s.lamp_within);
}

constexpr auto kDot = SmearState::dot;
SmearScene dark(int width = 160) { return {width, 720}; }
SmearScene lamp_and_dot() { return lamp_scene().disk(kLampX, kLampY + 99, kRadius, 20); }
/// Two lamps, and a dot of each.
SmearScene two_lamps(double first_dot, double second_dot) {
  return dark(320)
      .disk(81.3, kLampY, kRadius, kBright)
      .disk(240.6, 300.2, kRadius, kBright)
      .disk(81.3, first_dot, kRadius, 20)
      .disk(240.6, second_dot, kRadius, 20);
}

INSTANTIATE_TEST_SUITE_P(
    Of, DetectSituation,
    testing::Values(
        Situation{"NoDot", [] { return lamp_scene(); }, SmearState::no_dot, 0, 0, 0.1},
        Situation{"DotAboveTheLamp", [] { return lamp_scene().disk(kLampX, kLampY - 200, kRadius, 20); },
                  kDot, kLampY - 200, 0.1},
        Situation{"SpotsOfUnevenSpacing",
                  [] {
                    SmearScene scene = lamp_scene();
                    for (const double y : {40, 104, 194}) scene.disk(kLampX, y, kRadius, 15);
                    return scene;
                  },
                  SmearState::ambiguous},
        Situation{"LampNotLit", [] { return dark(); }, SmearState::no_lamp},
        Situation{"LampNotLitButADotOfTheLastFlash", [] { return dark().disk(kLampX, 300, kRadius, 25); },
                  SmearState::no_lamp},
        Situation{"AFlame", [] { return SmearScene(320, 240).disk(160, 120, 70, 300, 20); },
                  SmearState::no_lamp},
        Situation{"DotJustOutsideTheBloom",
                  [] {
                    return lamp_scene()
                        .bloom(kLampX, kLampY, 2, 30, 30, 400)
                        .disk(kLampX, kLampY + 45, kRadius, 20);
                  },
                  kDot, kLampY + 45, 0.2},
        Situation{"DotThatRisesRightNextToALampsSoftEdge",
                  [] { return lamp_scene().disk(kLampX, kLampY + 15, kRadius, 40); }, kDot, kLampY + 15, 0.2},
        Situation{
            "DotOnTheFlankOfTheHalo",
            [] { return lamp_scene().halo(kLampX, kLampY, 120, 8).disk(kLampX, kLampY - 32, kRadius, 25); },
            kDot, kLampY - 32, 0.3},
        Situation{"DotInsideTheBloom",
                  [] {
                    return lamp_scene()
                        .bloom(kLampX, kLampY, 3, 60, 60, 900)
                        .disk(kLampX, kLampY + 20, kRadius, 20);
                  },
                  SmearState::no_dot},
        Situation{"AsymmetricBloom",
                  [] {
                    return lamp_scene()
                        .bloom(kLampX, kLampY, 2.5, 0, 60, 800)
                        .disk(kLampX, kLampY - 100, kRadius, 20);
                  },
                  kDot, kLampY - 100, 0.1, 0.35},
        Situation{"BloomUpAndDownByWholeColumns", [] { return capsule(4, 4); }, kDot, kLampY - 100, 0.1,
                  0.35},
        Situation{"GlareAroundAnUnevenBloom", [] { return capsule(3, 9).halo(kLampX, kLampY, 40, 8); }, kDot,
                  kLampY - 100, 0.1, 0.35},
        Situation{"LampDiskCutByTheTopEdge",
                  [] { return dark().disk(kLampX, 1.2, 6, kBright).disk(kLampX, 301.2, 6, 20); }, kDot, 301.2,
                  0.1, 0.3, kLampX, 1.2},
        Situation{"LampDiskCutByTheLeftEdge",
                  [] { return dark().disk(2.1, 300.4, 6, kBright).disk(2.1, 500.4, 6, 20); }, kDot, 500.4,
                  0.2, 0.3, 2.1, 300.4},
        Situation{"LampCentreOutsideTheFrame", [] { return dark().disk(kLampX, -2.5, 6, kBright); },
                  SmearState::blind},
        Situation{"BloomOverMostOfTheColumn",
                  [] { return lamp_scene().bloom(kLampX, kLampY, 3, 330, 330, 180); }, SmearState::blind},
        Situation{"ConstantLamp", [] { return lamp_scene().line(kLampX, kRadius, 9); }, SmearState::steady, 0,
                  0, 0.15},
        Situation{
            "DotOnTheFaintLineOfAGlowingLamp",
            [] { return lamp_scene().line(kLampX, kRadius, 3).disk(kLampX, kLampY + 150, kRadius, 20); },
            kDot, kLampY + 150, 0.2},
        Situation{"SaturatedLine", [] { return lamp_scene().line(kLampX, kRadius + 2, 2000); },
                  SmearState::saturated},
        Situation{"NearlySaturatedLine", [] { return lamp_scene().line(kLampX, 3 * kRadius, 228); },
                  SmearState::saturated},
        Situation{"SecondLampInAnotherColumnThatIsConstant",
                  [] {
                    return dark(320)
                        .disk(81.3, kLampY, kRadius + 1, kBright)
                        .line(81.3, kRadius, 9)
                        .disk(240.6, 300.2, kRadius, kBright)
                        .disk(240.6, 420.2, kRadius, 20);
                  },
                  kDot, 420.2, 0.2, 0.2, 240.6, 300.2},
        Situation{"SecondLampInAnotherColumnWithAnotherShift", [] { return two_lamps(kLampY + 120, 480.2); },
                  SmearState::ambiguous},
        Situation{"ReflectionOfEqualSizeInTheSameColumn",
                  [] {
                    return lamp_scene()
                        .disk(kLampX + 1, kLampY + 140, kRadius, kBright)
                        .disk(kLampX, kLampY - 100, kRadius, 20)
                        .disk(kLampX + 1, kLampY + 40, kRadius, 20);
                  },
                  SmearState::ambiguous},
        Situation{"Gamma",
                  [] { return lamp_scene().disk(kLampX, kLampY + 99, kRadius, 12); },
                  kDot,
                  kLampY + 99,
                  0.25,
                  0,
                  kLampX,
                  kLampY,
                  {.noise = 0.8, .gamma = 2.2}},
        Situation{"BayerOf8Bits",
                  lamp_and_dot,
                  kDot,
                  kLampY + 99,
                  0.25,
                  0.2,
                  kLampX,
                  kLampY,
                  {.format = PixelFormat::bayer_rggb8}},
        Situation{"BayerOf12Bits",
                  lamp_and_dot,
                  kDot,
                  kLampY + 99,
                  0.25,
                  0.2,
                  kLampX,
                  kLampY,
                  {.bit_depth = 12, .format = PixelFormat::bayer_rggb16}},
        Situation{"ColourOf8Bits",
                  lamp_and_dot,
                  kDot,
                  kLampY + 99,
                  0.2,
                  0,
                  kLampX,
                  kLampY,
                  {.format = PixelFormat::rgb8}},
        Situation{"ColourOf12Bits",
                  lamp_and_dot,
                  kDot,
                  kLampY + 99,
                  0.2,
                  0,
                  kLampX,
                  kLampY,
                  {.bit_depth = 12, .format = PixelFormat::rgb16}}),
    [](const auto& test) { return test.param.name; });

TEST(Detect, OneDotBelowTheLamp) {
  const Image image = lamp_scene().disk(kLampX, kLampY + 120, kRadius, 20).image({});
  const SmearReading r = detect(image.view());
  expect_one_dot(r, kLampY + 120, 0.1);
  expect_lamp(r, kLampX, kLampY, 0.1);
  EXPECT_EQ(r.dots[0].side, Side::below);
  EXPECT_NEAR(r.dots[0].amplitude, 20, 2);
  EXPECT_GT(r.dots[0].snr, 40);
  EXPECT_LT(r.dots[0].sigma.value(), 0.1);
  EXPECT_TRUE(r.lamp->saturated);
}

TEST(Detect, TwoDotsOnOppositeSides) {
  const Image image =
      lamp_scene().disk(kLampX, kLampY - 150, kRadius, 15).disk(kLampX, kLampY + 201, kRadius, 15).image({});
  const SmearReading r = detect(image.view());
  ASSERT_TRUE(reads(r, SmearState::comb));
  ASSERT_EQ(r.dots.size(), 2U);
  EXPECT_NEAR(r.dots[0].y.value(), kLampY - 150, 0.2);
  EXPECT_NEAR(r.dots[1].y.value(), kLampY + 201, 0.2);
}

TEST(Detect, ManyDotsOfAFastStrobe) {
  SmearScene scene = lamp_scene();
  std::vector<double> truth;
  for (int k = -5; k <= 6; ++k) {
    const double y = kLampY + std::floor(61.7 * k + 20);
    if (std::abs(y - kLampY) < 16 || y < 0 || y > 719) continue;
    truth.push_back(y);
    scene.disk(kLampX, y, kRadius, 12);
  }
  const SmearReading r = detect(scene.image({}).view());
  ASSERT_TRUE(reads(r, SmearState::comb));
  ASSERT_EQ(r.dots.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR(r.dots[i].y.value(), truth[i], 0.3);
}

TEST(Detect, DenseComb) {
  SmearScene scene = lamp_scene();
  int dots = 0;
  for (double y = kLampY + 24; y < 715; y += 18, ++dots) scene.disk(kLampX, y, kRadius, 20);
  const SmearReading r = detect(scene.image({}).view());
  ASSERT_TRUE(reads(r, SmearState::comb));
  EXPECT_NEAR(static_cast<double>(r.dots.size()), dots, 1);
}

TEST(Detect, CombWhoseDotsCoverMostOfTheColumn) {
  // The median of such a column is a dot's: its level is that of its dark rows.
  SmearScene scene = SmearScene(160, 480).disk(kLampX, 90.4, 7.4, kBright);
  int dots = 0;
  for (double y = 115; y < 470; y += 22, ++dots) scene.disk(kLampX, y, 7.4, 40);
  const SmearReading r = detect(scene.image({}).view());
  ASSERT_TRUE(reads(r, SmearState::comb));
  ASSERT_EQ(r.dots.size(), static_cast<std::size_t>(dots));
  for (int i = 0; i < dots; ++i) {
    const DotReading& dot = r.dots[static_cast<std::size_t>(i)];
    EXPECT_NEAR(dot.y.value(), 115 + 22 * i, 0.1);
    EXPECT_NEAR(dot.amplitude, 40, 2);
    EXPECT_LT(dot.sigma.value(), 0.04);
  }
}

TEST(Detect, UnsaturatedLamp) {
  const Image image = lamp_scene(190).disk(kLampX, 500.4, kRadius, 10).image({});
  const SmearReading r = detect(image.view());
  expect_one_dot(r, 500.4, 0.2);
  expect_lamp(r, kLampX, kLampY, 0.03);
  EXPECT_FALSE(r.lamp->saturated);
}

TEST(Detect, HotRowsInTheBloomAreNoEndOfIt) {
  SmearScene scene = lamp_scene().bloom(kLampX, kLampY, 3, 80, 80, 600);
  for (int x = 79; x <= 83; ++x) scene.at(x, 390) += 150;
  for (int x = 80; x <= 84; ++x) scene.at(x, 391) += 150;
  const SmearReading r = detect(scene.image({}).view());
  EXPECT_TRUE(r.dots.empty()) << r.reason;
}

TEST(Detect, ConstantLampWithPhotonNoise) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Image image = lamp_scene().line(kLampX, kRadius, 60).image({.shot = 0.3, .seed = seed});
    const SmearReading r = detect(image.view());
    EXPECT_TRUE(reads(r, SmearState::steady));
  }
}

TEST(Detect, SecondLampInAnotherColumnWithTheSameShift) {
  const SmearReading r = detect(two_lamps(kLampY + 120, 420.2).image({}).view());
  ASSERT_TRUE(reads(r, SmearState::dot));
  EXPECT_NEAR((r.dots[0].y - r.lamp->y).value(), 120, 0.2);
}

TEST(Detect, HotPixelClustersInTheLampsColumn) {
  RandomStream random(3, 1);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SmearScene scene = lamp_scene();
    for (int cluster = 0; cluster < 4; ++cluster) {
      const int x = static_cast<int>(kLampX + random.uniform(-3, 3));
      const int y = static_cast<int>(random.uniform(10, 300));
      const int shape = static_cast<int>(random.uniform(0, 5));
      const double value = random.uniform(8, 220);
      for (int i = 0; i < 4; ++i) {  // one, two upright, two across, an L of three, a square
        const bool lit = shape == 0   ? i == 0
                         : shape == 1 ? i % 2 == 0
                         : shape == 2 ? i < 2
                         : shape == 3 ? i < 3
                                      : true;
        if (lit) scene.at(x + i % 2, y + i / 2) += value;
      }
    }
    const SmearReading r = detect(scene.image({.seed = seed}).view());
    EXPECT_TRUE(r.dots.empty()) << "seed " << seed << ": " << r.reason;
  }
}

TEST(Detect, DotBesideHotPixelClusters) {
  SmearScene scene = lamp_scene().disk(kLampX, kLampY + 130, kRadius, 15);
  scene.at(80, 100) += 200;
  scene.at(81, 100) += 150;
  scene.at(82, 101) += 120;
  scene.at(82, static_cast<int>(kLampY) + 131) += 90;  // in the dot itself
  expect_one_dot(detect(scene.image({}).view()), kLampY + 130, 0.3);
}

TEST(Detect, HotColumnThroughTheLamp) {
  SmearScene scene = lamp_scene();
  for (int y = 0; y < scene.height(); ++y) scene.at(79, y) += 25;
  EXPECT_TRUE(detect(scene.image({}).view()).dots.empty());
}

TEST(Detect, JpegOfQuality75WithoutADot) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    RandomStream random(seed, 2);
    const SmearScene scene = SmearScene(160, 720).disk(random.uniform(60, 100), random.uniform(200, 500),
                                                       random.uniform(2.5, 5), kBright);
    const Image image = through_jpeg(scene.image({.noise = random.uniform(0.8, 1.8), .seed = seed}), 75);
    const SmearReading r = detect(image.view());
    EXPECT_TRUE(r.dots.empty()) << "seed " << seed << ": " << r.reason;
  }
}

TEST(Detect, JpegOfQuality75WithADot) {
  const Image image = through_jpeg(lamp_and_dot().image({}), 75);
  const SmearReading r = detect(image.view());
  expect_one_dot(r, kLampY + 99, 0.3);
  EXPECT_GT(r.dots[0].sigma.value(), 0.03) << "the rounding of a compressor is part of the error";
}

/// A film of a lamp, with a dot of this amplitude.
std::vector<Image> film(double amplitude, std::uint64_t seed) {
  std::vector<Image> frames;
  SmearScene scene = lamp_scene();
  if (amplitude > 0) scene.disk(kLampX, kLampY + 99, kRadius, amplitude);
  for (std::uint64_t i = 0; i < 12; ++i) frames.push_back(scene.image({.seed = seed + i}));
  return frames;
}

TEST(Detect, H264WithoutADot) {
  for (const int crf : {18, 23, 28}) {
    for (const Image& image : through_h264(film(0, 100), crf)) {
      const SmearReading r = detect(image.view());
      EXPECT_TRUE(r.dots.empty()) << "CRF " << crf << ": " << r.reason;
    }
  }
}

TEST(Detect, H264WithADot) {
  for (const int crf : {18, 23, 28}) {
    const std::vector<Image> frames = through_h264(film(20, 200), crf);
    ASSERT_EQ(frames.size(), 12U);
    for (const Image& image : frames) expect_one_dot(detect(image.view()), kLampY + 99, 0.6);
  }
}

TEST(Detect, AFaintSpotUnderCompressionIsLeftOpenAndSaysWhy) {
  int open = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Image image = through_jpeg(
        lamp_scene().disk(kLampX, kLampY + 99, kRadius, 3).image({.noise = 0.6, .seed = seed}), 75);
    const SmearReading r = detect(image.view());
    EXPECT_TRUE(r.dots.empty()) << r.reason;
    if (r.state != SmearState::ambiguous) continue;
    ++open;
    EXPECT_NE(r.reason.find("compression"), std::string::npos) << r.reason;
    EXPECT_FALSE(r.spots.empty());
  }
  EXPECT_GE(open, 5);
}

TEST(Detect, XenonTailDrawsTheDotOutAlongItsColumn) {
  // The tube glows on while rows are shifted: the dot's copies fade away from the lamp.
  SmearScene scene = lamp_scene();
  for (int k = 0; k < 6; ++k) scene.disk(kLampX, kLampY + 99 + k, kRadius, 24 * std::exp(-k / 1.5));
  const SmearReading r = detect(scene.image({}).view());
  ASSERT_TRUE(reads(r, SmearState::dot));
  EXPECT_GE(r.dots[0].y.value(), kLampY + 99 - 0.2);
  EXPECT_LE(r.dots[0].y.value(), kLampY + 99 + 2.5) << "the mean of the tail is 1.5 rows late";
}

TEST(Detect, LumaOfAPlanarVideoFrame) {
  // Of I420, NV12 and the like the first plane is a grey frame with a stride of its own.
  const Image image = lamp_and_dot().image({});
  constexpr std::size_t kStride = 192;
  std::vector<std::byte> yuv(kStride * 720 * 3 / 2, std::byte{128});
  for (int y = 0; y < 720; ++y)
    std::memcpy(yuv.data() + static_cast<std::size_t>(y) * kStride, image.view().row(y), 160);
  expect_one_dot(detect({image.layout(), yuv.data(), kStride}), kLampY + 99, 0.1);
}

TEST(Detect, FieldsOfAnInterlacedFrameReadSeparately) {
  // Two flashes, one a field: a field is a view with twice the stride, its rows are half as many.
  SmearScene scene = lamp_scene();
  const SmearScene upper = SmearScene(160, 720, 0).disk(kLampX, kLampY + 100, kRadius, 25);
  const SmearScene lower = SmearScene(160, 720, 0).disk(kLampX, kLampY + 161, kRadius, 25);
  for (int y = 0; y < 720; ++y) {
    for (int x = 0; x < 160; ++x) scene.at(x, y) += (y % 2 == 0 ? upper : lower).at(x, y);
  }
  const Image image = scene.image({});
  ImageView field = image.view();
  field.layout.size.height /= 2;
  field.stride *= 2;
  expect_one_dot(detect(field), (kLampY + 100) / 2, 0.2);
  field.data = image.view().row(1);
  expect_one_dot(detect(field), (kLampY + 161 - 1) / 2, 0.2);
}

TEST(Detect, PhotonNoiseIsWeighedIn) {
  // A bright dot with much photon noise: the stated error is the true one.
  double squares = 0;
  double stated = 0;
  constexpr int kFrames = 60;
  for (std::uint64_t seed = 0; seed < kFrames; ++seed) {
    const Image image =
        lamp_scene().disk(kLampX, kLampY + 99, kRadius, 90).image({.noise = 0.8, .shot = 0.5, .seed = seed});
    const SmearReading r = detect(image.view());
    ASSERT_TRUE(reads(r, SmearState::dot));
    squares += std::pow(r.dots[0].y.value() - kLampY - 99, 2) / kFrames;
    stated += std::pow(r.dots[0].sigma.value(), 2) / kFrames;
  }
  EXPECT_NEAR(std::sqrt(stated / squares), 1, 0.35);
}

TEST(Detect, NineToSixteenBits) {
  for (const int depth : {9, 10, 12, 14, 16}) {
    const Image image = lamp_scene()
                            .disk(kLampX, kLampY + 99, kRadius, 12)
                            .image({.bit_depth = depth, .format = PixelFormat::gray16});
    const SmearReading r = detect(image.view());
    expect_one_dot(r, kLampY + 99, 0.2);
    EXPECT_NEAR(r.dots[0].amplitude, 12.0 / 255 * image.layout().white(),
                0.15 * 12 / 255 * image.layout().white());
    EXPECT_TRUE(r.lamp->saturated);
  }
}

TEST(Detect, TwelveBitsInASixteenBitContainer) {
  const Image twelve = lamp_scene().image({.bit_depth = 12, .format = PixelFormat::gray16});
  Image image(ImageLayout{twelve.layout().size, PixelFormat::gray16, 16});
  image.bytes() = twelve.bytes();
  const SmearReading r = detect(image.view());
  EXPECT_TRUE(reads(r, SmearState::no_dot));
  ASSERT_TRUE(r.lamp);
  EXPECT_TRUE(r.lamp->saturated);
}

TEST(Detect, BayerMosaicWithoutADot) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Image image = lamp_scene(400).image({.seed = seed, .format = PixelFormat::bayer_rggb8});
    EXPECT_TRUE(reads(detect(image.view()), SmearState::no_dot));
  }
}

TEST(Detect, FieldsOfDifferentOffset) {
  SmearScene scene = lamp_scene().disk(kLampX, kLampY + 99, kRadius, 12);
  for (int y = 0; y < scene.height(); y += 2) {
    for (int x = 0; x < scene.width(); ++x) scene.at(x, y) += 4;
  }
  expect_one_dot(detect(scene.image({}).view()), kLampY + 99, 0.25);
}

TEST(Detect, DotInOneFieldOfAnInterlacedFrame) {
  SmearScene scene = lamp_scene();
  SmearScene dot = SmearScene(160, 720, 0).disk(kLampX, kLampY + 99, kRadius, 25);
  for (int y = 0; y < scene.height(); y += 2) {
    for (int x = 0; x < scene.width(); ++x) scene.at(x, y) += dot.at(x, y);
  }
  const SmearReading r = detect(scene.image({}).view());
  EXPECT_TRUE(reads(r, SmearState::ambiguous));
  EXPECT_NE(r.reason.find("interlaced"), std::string::npos) << r.reason;
  EXPECT_TRUE(r.dots.empty());
}

TEST(Detect, StridesAreHonoured) {
  const Image image = lamp_and_dot().image({});
  const std::size_t stride = 160 + 37;
  std::vector<std::byte> padded(stride * 720, std::byte{255});
  for (int y = 0; y < 720; ++y) {
    std::memcpy(padded.data() + static_cast<std::size_t>(y) * stride, image.view().row(y), 160);
  }
  const SmearReading a = detect(image.view());
  const SmearReading b = detect({image.layout(), padded.data(), stride});
  expect_one_dot(b, kLampY + 99, 0.1);
  EXPECT_EQ(a.dots[0].y, b.dots[0].y);
}

TEST(Detect, OverexposedFrame) {
  const Image image = SmearScene(160, 120, 300).image({});
  const SmearReading r = detect(image.view());
  EXPECT_TRUE(r.dots.empty());
  EXPECT_FALSE(r.reason.empty());
}

TEST(Detect, EmptyMalformedAndTinyFrames) {
  EXPECT_TRUE(reads(detect(ImageView{}), SmearState::no_lamp));
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::gray16, PixelFormat::bayer_rggb8,
                                   PixelFormat::bayer_rggb16, PixelFormat::rgb8, PixelFormat::rgb16}) {
    for (int width = 1; width < 24; ++width) {
      for (const int height : {1, 2, 3, 5, 8, 9, 13, 24}) {
        const int depth = bytes_per_sample(format) == 1 ? 8 : 12;
        Image image({{width, height}, format, depth});
        EXPECT_TRUE(detect(image.view()).dots.empty());
        SmearScene scene(width, height);
        scene.disk(width / 2.0, height / 2.0, 2.2, kBright);
        const Image lit = scene.image({.bit_depth = depth, .format = format});
        EXPECT_FALSE(detect(lit.view()).reason.empty());
      }
    }
  }
  Image image({{32, 32}, PixelFormat::gray8, 8});
  ImageView bad = image.view();
  bad.stride = 3;
  EXPECT_TRUE(reads(detect(bad), SmearState::no_lamp));
}

}  // namespace
}  // namespace emberlock::smear
