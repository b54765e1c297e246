// SPDX-License-Identifier: Apache-2.0
// What virtual cameras show: dots, lines, bloom, noise, colours, each pass by itself.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/virtual_cameras.h"

namespace emberlock::drivers {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

constexpr double kDotSum = 0.01 * 4000;  // of one flash: times the area of the lamp's disk

Frame next(VirtualRig& rig, int camera = 0) { return rig.camera(camera).next_frame(Seconds(5)).value(); }

std::vector<std::uint64_t> grey_levels(const Frame& frame) {
  std::set<std::uint64_t> levels;
  const ImageView v = frame.image->view();
  for (int y = 0; y < v.height(); ++y) {
    for (int x = 0; x < v.width(); ++x) levels.insert(v.sample(x, y));
  }
  return {levels.begin(), levels.end()};
}

int pixels_that_differ(const Frame& a, const Frame& b) {
  int count = 0;
  const ImageView v = a.image->view(), w = b.image->view();
  for (int y = 0; y < v.height(); ++y) {
    for (int x = 0; x < v.width(); ++x) count += v.sample(x, y) != w.sample(x, y);
  }
  return count;
}

/// Frame 1 of a rig whose strobe flashes once a frame, `tau` after the start of the read phase.
Frame frame_with(const VirtualCameraOptions& camera, std::vector<Pass> passes, double tau,
                 std::uint64_t frame_id = 1) {
  const auto rig = small_rig({camera}, std::move(passes));
  EXPECT_TRUE(rig->camera(0).start().ok());
  EXPECT_TRUE(
      rig->strobe().apply({.output = StrobeOutput::flashing, .rate = Hertz(24), .phase = Seconds(tau)}).ok());
  for (;;) {
    Frame f = next(*rig);
    if (f.stamp.frame_id == frame_id) return f;
  }
}

TEST(VirtualPicture, DotsLieWhereTheShiftRegisterPutsThem) {
  for (const auto direction : {smear::ReadDirection::top_first, smear::ReadDirection::bottom_first}) {
    for (const int shifts : {120, 140, 166}) {
      for (const double k : {5.3, 30.3, 60.3, 80.3, 105.3, 135.3, 155.3, 165.9}) {
        const VirtualCameraOptions c = small_camera(direction, shifts);
        const auto rows = column_light(frame_with(c, {Pass::smear}, k * 250e-6), c.lamp.x);
        const int d = static_cast<int>(direction);
        // The formula of the forward model, written down apart from ccd_model.
        const int order = d > 0 ? 50 : 119 - 50;
        const int packet = (order + static_cast<int>(k)) % shifts;
        const bool rest = k >= shifts;
        const double expected = rest ? 50 : d > 0 ? packet : 119 - packet;
        const bool visible = rest || packet < 120;
        const double all = blob(rows, 60, 200).sum;
        if (!visible) {
          EXPECT_LT(all, 0.2 * kDotSum) << "K " << shifts << " k " << k;
          continue;
        }
        const Blob dot = blob(rows, expected);
        EXPECT_NEAR(dot.sum, all, 0.02 * all) << "K " << shifts << " k " << k;
        EXPECT_GT(dot.sum, 20 * kDotSum) << "K " << shifts << " k " << k;
        EXPECT_NEAR(dot.centre, expected, 0.02) << "K " << shifts << " k " << k << " d " << d;
      }
    }
  }
}

TEST(VirtualPicture, DotsKeepTheFractionOfTheLampsRow) {
  VirtualCameraOptions c = small_camera();
  for (const double fraction : {0.0, 0.25, 0.5, 0.8}) {
    c.lamp.y = Rows(40 + fraction);
    const auto rows = column_light(frame_with(c, {Pass::smear}, 30.3 * 250e-6), c.lamp.x);
    EXPECT_NEAR(blob(rows, 70).centre, 70 + fraction, 0.02);
  }
}

TEST(VirtualPicture, AWrappedDotShowsInTheNextImageAndNotBefore) {
  const auto rig = small_rig({small_camera()}, {Pass::smear});
  ASSERT_TRUE(rig->camera(0).start().ok());
  // One flash in the read phase of frame 1 (which starts two periods in), 90 rows after its start.
  std::vector<bool> once(100);
  once[2] = true;
  ASSERT_TRUE(rig->strobe()
                  .apply({.output = StrobeOutput::flashing,
                          .rate = Hertz(24),
                          .phase = Seconds(90.3 * 250e-6),
                          .code = once})
                  .ok());
  for (std::uint64_t id = 0; id < 5; ++id) {
    const Frame f = next(*rig);
    ASSERT_EQ(f.stamp.frame_id, id);
    const auto rows = column_light(f, 30);
    const Blob all = blob(rows, 60, 200);
    if (id == 2) {
      EXPECT_NEAR(blob(rows, 20).centre, 20, 0.02);  // 50 + 90 - 120
      EXPECT_EQ(rig->dots(0, id).size(), 1U);
      EXPECT_EQ(rig->dots(0, id).at(0).y, Rows(20));
    } else {
      EXPECT_LT(std::abs(all.sum), 5) << "frame " << id;
      EXPECT_TRUE(rig->dots(0, id).empty());
    }
  }
}

TEST(VirtualPicture, CodedSkipsShowInTheirFramesAndTheLampAnImageLater) {
  const std::vector<bool> code = {true, false, true, true, false, false, true};
  const auto rig = small_rig({small_camera()}, {Pass::lamp, Pass::smear});
  ASSERT_TRUE(rig->camera(0).start().ok());
  ASSERT_TRUE(rig->strobe()
                  .apply({.output = StrobeOutput::flashing,
                          .rate = Hertz(24),
                          .phase = Seconds(40.3 * 250e-6),
                          .code = code})
                  .ok());
  for (std::size_t id = 0; id < 20; ++id) {
    const Frame f = next(*rig);
    const ImageView v = f.image->view();
    // Frame 0 is read one period after the start; flash 1 falls into its read phase.
    EXPECT_EQ(v.sample(30, 90) > 500, code[(id + 1) % code.size()]) << "dot of frame " << id;
    EXPECT_EQ(v.sample(30, 50) == 4095, code[id % code.size()]) << "lamp of frame " << id;
  }
}

TEST(VirtualPicture, SweepOutLeavesOneSide) {
  VirtualCameraOptions c = small_camera();
  c.sweep_out = smear::SweepOut::before_transfer;
  EXPECT_GT(blob(column_light(frame_with(c, {Pass::smear}, 30.3 * 250e-6), 30), 80).sum, 20 * kDotSum);
  EXPECT_LT(blob(column_light(frame_with(c, {Pass::smear}, 90.3 * 250e-6), 30), 60, 200).sum, 5);
}

TEST(VirtualPicture, SteadyLightDrawsALineOfFullHeight) {
  for (const auto direction : {smear::ReadDirection::top_first, smear::ReadDirection::bottom_first}) {
    const auto rig = small_rig({small_camera(direction, 140)}, {Pass::smear});
    ASSERT_TRUE(rig->strobe().apply({.output = StrobeOutput::steady}).ok());
    ASSERT_TRUE(rig->camera(0).start().ok());
    const auto rows = column_light((next(*rig), next(*rig)), 30);
    // Away from the edges every row has looked at every lit row of the lamp for one row time.
    for (int y = 0; y < 120; ++y) {
      if (std::abs(y - 50) <= 8) continue;
      EXPECT_NEAR(rows[y], rows[60], 0.02 * rows[60]) << y;
    }
    EXPECT_GT(rows[60], 100);
    EXPECT_GT(rows[50], rows[60]);  // the rest phase
  }
}

TEST(VirtualPicture, ACombIsSpacedByTheFlashPeriodInRows) {
  const auto rig = small_rig({small_camera()}, {Pass::smear});
  ASSERT_TRUE(rig->strobe()
                  .apply({.output = StrobeOutput::flashing, .rate = Hertz(200), .phase = milliseconds(2.43)})
                  .ok());
  ASSERT_TRUE(rig->camera(0).start().ok());
  const auto rows = column_light((next(*rig), next(*rig)), 30);
  // 1 / (200 /s * 250 us) = 20 rows; the phase keeps the dots clear of the lamp's row, where the rest's
  // charge lies.
  const auto truth = rig->dots(0, 1);
  std::vector<double> below;
  for (const TrueDot& dot : truth) {
    if (dot.y > Rows(57) && dot.y < Rows(113)) below.push_back(blob(rows, dot.y.value()).centre);
  }
  ASSERT_EQ(below.size(), 3U);
  EXPECT_NEAR(below[1] - below[0], 20, 0.05);
  EXPECT_NEAR(below[2] - below[1], 20, 0.05);
}

TEST(VirtualPicture, WithoutAPassThePictureIsTheBackgroundAlone) {
  const Frame f = frame_with(small_camera(), {}, 0.01);
  const auto levels = grey_levels(f);
  ASSERT_EQ(levels.size(), 1U);
  EXPECT_EQ(levels[0], static_cast<std::uint64_t>(std::lround(6.0 * 4095 / 255)));
}

TEST(VirtualPicture, EachPassTouchesItsOwnPixelsOnly) {
  const VirtualCameraOptions c = small_camera();
  const double tau = 40.3 * 250e-6;
  const Frame none = frame_with(c, {}, tau);
  const auto area = [&](const Frame& f) {
    int x0 = 64, x1 = -1, y0 = 120, y1 = -1;
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 64; ++x) {
        if (f.image->view().sample(x, y) == none.image->view().sample(x, y)) continue;
        x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
      }
    }
    return std::array<int, 4>{x0, x1, y0, y1};
  };
  const auto lamp = area(frame_with(c, {Pass::lamp}, tau));
  EXPECT_GE(lamp[0], 23);
  EXPECT_LE(lamp[1], 37);
  EXPECT_GE(lamp[2], 43);
  EXPECT_LE(lamp[3], 57);
  const auto smear = area(frame_with(c, {Pass::smear}, tau));
  EXPECT_GE(smear[0], 23);
  EXPECT_LE(smear[1], 37);
  EXPECT_GE(smear[2], 83);
  EXPECT_LE(smear[3], 97);
  EXPECT_EQ(pixels_that_differ(frame_with(c, {Pass::hot_pixels}, tau), none), 12);
  EXPECT_GT(pixels_that_differ(frame_with(c, {Pass::read_noise}, tau), none), 64 * 120 / 2);
  EXPECT_GT(pixels_that_differ(frame_with(c, {Pass::shot_noise}, tau), none), 64 * 120 / 2);
}

TEST(VirtualPicture, TheLampSaturatesAndBloomSurroundsIt) {
  const VirtualCameraOptions c = small_camera();
  const Frame lamp = frame_with(c, {Pass::lamp}, 0.035);
  EXPECT_EQ(lamp.image->view().sample(30, 50), 4095);
  EXPECT_EQ(lamp.image->view().sample(40, 50), 96);
  const Frame bloom = frame_with(c, {Pass::lamp, Pass::bloom}, 0.035);
  const ImageView v = bloom.image->view();
  EXPECT_EQ(v.sample(30, 50 + 7), 4095);  // overflow: 3 rows of disk, 4 more
  EXPECT_EQ(v.sample(30, 50 - 7), 4095);
  EXPECT_LT(v.sample(30, 50 + 14), 1000);
  EXPECT_GT(v.sample(37, 50), v.sample(41, 50));  // glare falls off
  EXPECT_GT(v.sample(41, 50), 96);
}

TEST(VirtualPicture, ALampThatIsNotLitLeavesNoBloom) {
  const auto rig = small_rig({small_camera()}, {Pass::lamp, Pass::bloom, Pass::smear});
  ASSERT_TRUE(rig->camera(0).start().ok());
  EXPECT_EQ(grey_levels(next(*rig)).size(), 1U);
}

TEST(VirtualPicture, OverflowMayBeLopsided) {
  const auto rig = small_rig({small_camera()}, {Pass::lamp, Pass::bloom});
  VirtualScene scene;
  scene.passes = {Pass::lamp, Pass::bloom};
  scene.overflow_up = 0;
  scene.overflow_down = 20;
  ASSERT_TRUE(rig->set_scene(scene).ok());
  ASSERT_TRUE(rig->strobe().apply({.output = StrobeOutput::flashing, .rate = Hertz(24)}).ok());
  ASSERT_TRUE(rig->camera(0).start().ok());
  const Frame f = (next(*rig), next(*rig));
  EXPECT_EQ(f.image->view().sample(30, 50 + 22), 4095);
  EXPECT_LT(f.image->view().sample(30, 50 - 10), 1500);
}

TEST(VirtualPicture, AShortExposureMissesTheLampButNotTheDot) {
  const auto rig = small_rig({small_camera()}, {Pass::lamp, Pass::smear});
  VirtualScene scene;
  scene.passes = {Pass::lamp, Pass::smear};
  scene.exposure = milliseconds(1);
  ASSERT_TRUE(rig->set_scene(scene).ok());
  ASSERT_TRUE(
      rig->strobe()
          .apply({.output = StrobeOutput::flashing, .rate = Hertz(24), .phase = Seconds(40.3 * 250e-6)})
          .ok());
  ASSERT_TRUE(rig->camera(0).start().ok());
  const Frame f = (next(*rig), next(*rig));
  EXPECT_EQ(f.image->view().sample(30, 50), 96);
  EXPECT_GT(f.image->view().sample(30, 90), 500);
}

TEST(VirtualPicture, ALampCutByTheEdgeOrOutsideIsDrawnAsFarAsItShows) {
  VirtualCameraOptions c = small_camera();
  c.lamp = {.x = 0.4, .y = Rows(118.7), .radius = 5};
  EXPECT_EQ(frame_with(c, {Pass::lamp, Pass::bloom, Pass::smear}, 0.01).image->view().sample(0, 119), 4095);
  c.lamp = {.x = -300, .y = Rows(900), .radius = 5};
  EXPECT_EQ(grey_levels(frame_with(c, {Pass::lamp, Pass::bloom, Pass::smear}, 0.01)).size(), 1U);
}

TEST(VirtualPicture, NoiseHasTheVarianceThatWasAskedFor) {
  VirtualCameraOptions c = small_camera();
  c.layout.size = {400, 120};
  for (const auto& [passes, expected] :
       std::map<std::vector<Pass>, double>{{{Pass::read_noise}, 0.49},
                                           {{Pass::shot_noise}, 100.0 / 60},
                                           {{Pass::shot_noise, Pass::read_noise}, 100.0 / 60 + 0.49}}) {
    const auto rig = small_rig({c}, {});
    VirtualScene scene;
    scene.passes = passes;
    scene.background = 100;
    ASSERT_TRUE(rig->set_scene(scene).ok());
    ASSERT_TRUE(rig->camera(0).start().ok());
    const Frame f = next(*rig);
    double sum = 0, squares = 0, tails = 0, neighbours = 0;
    const double n = 400 * 120;
    for (int y = 0; y < 120; ++y) {
      double left = 0;
      for (int x = 0; x < 400; ++x) {
        const double v = f.image->view().sample(x, y) * 255.0 / 4095 - 100;
        sum += v, squares += v * v, neighbours += v * left;
        tails += std::abs(v) > 3 * std::sqrt(expected);
        left = v;
      }
    }
    EXPECT_NEAR(sum / n, 0, 5 * std::sqrt(expected / n));
    EXPECT_NEAR(squares / n, expected, 5 * expected * std::sqrt(2 / n));
    EXPECT_NEAR(neighbours / n, 0, 5 * expected / std::sqrt(n));
    EXPECT_NEAR(tails / n, 0.0027, 0.0012);
  }
}

TEST(VirtualPicture, QuantiseLeavesOnlyTheConvertersCodes) {
  const auto rig = small_rig({small_camera()}, {});
  VirtualScene scene;
  scene.passes = {Pass::read_noise, Pass::quantise};
  scene.read_noise = 30;
  scene.background = 128;
  scene.adc_bits = 4;
  ASSERT_TRUE(rig->set_scene(scene).ok());
  ASSERT_TRUE(rig->camera(0).start().ok());
  const auto levels = grey_levels(next(*rig));
  EXPECT_LE(levels.size(), 16U);
  EXPECT_GT(levels.size(), 8U);
  for (const auto level : levels) EXPECT_EQ(level % 273, 0U);  // 4095 / 15
}

/// Red grows with x, green with y, blue is constant.
class Ramp final : public LightField {
 public:
  explicit Ramp(int width) : width_(width) {}
  void add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                    std::span<float> rgb) const override {
    windows.push_back({camera, exposure_start, exposure});
    for (std::size_t i = 0; i < rgb.size() / 3; ++i) {
      const std::size_t row = i / width_;
      rgb[3 * i] += static_cast<float>(i % width_);
      rgb[3 * i + 1] += static_cast<float>(row);
      rgb[3 * i + 2] += 200;
    }
  }
  struct Window {
    int camera;
    TimePoint begin;
    Seconds exposure;
  };
  mutable std::vector<Window> windows;

 private:
  int width_;
};

Frame film(PixelFormat format, const std::shared_ptr<const Ramp>& ramp) {
  VirtualCameraOptions c = small_camera();
  c.layout.format = format;
  c.layout.bit_depth = bytes_per_sample(format) == 1 ? 8 : 16;
  const auto rig = small_rig({c}, {});
  VirtualScene scene = flame_scene(ramp);
  scene.passes = {Pass::flame};
  EXPECT_TRUE(rig->set_scene(scene).ok());
  EXPECT_TRUE(rig->camera(0).start().ok());
  return next(*rig);
}

TEST(VirtualPicture, AFlameFillsEveryPixelFormat) {
  const auto ramp = std::make_shared<Ramp>(64);
  const Frame rgb = film(PixelFormat::rgb8, ramp);
  EXPECT_EQ(rgb.image->view().sample(17, 90, 0), 17);
  EXPECT_EQ(rgb.image->view().sample(17, 90, 1), 90);
  EXPECT_EQ(rgb.image->view().sample(17, 90, 2), 200);
  const Frame rgb16 = film(PixelFormat::rgb16, ramp);
  EXPECT_EQ(rgb16.image->view().sample(17, 90, 1), 90 * 257);
  const Frame bayer = film(PixelFormat::bayer_rggb8, ramp);
  EXPECT_EQ(bayer.image->view().sample(16, 90), 16);   // R
  EXPECT_EQ(bayer.image->view().sample(17, 90), 90);   // G
  EXPECT_EQ(bayer.image->view().sample(16, 91), 91);   // G
  EXPECT_EQ(bayer.image->view().sample(17, 91), 200);  // B
  const Frame gray = film(PixelFormat::gray8, ramp);
  EXPECT_EQ(gray.image->view().sample(17, 90), std::lround(0.2126 * 17 + 0.7152 * 90 + 0.0722 * 200));
}

TEST(VirtualPicture, CamerasOfEqualPhaseFilmTheFlameAtTheSameInstant) {
  const auto ramp = std::make_shared<Ramp>(64);
  VirtualCameraOptions second = small_camera(smear::ReadDirection::bottom_first, 140);
  second.id = "second";
  const auto rig = small_rig({small_camera(), second}, {});
  VirtualScene scene = flame_scene(ramp);
  ASSERT_TRUE(rig->set_scene(scene).ok());
  for (int i : {0, 1}) ASSERT_TRUE(rig->camera(i).start().ok());
  for (int i : {0, 1}) next(*rig, i);
  ASSERT_EQ(ramp->windows.size(), 2U);
  EXPECT_EQ(ramp->windows[1].camera, 1);
  EXPECT_EQ(ramp->windows[0].begin, ramp->windows[1].begin);
  EXPECT_EQ(ramp->windows[0].begin + milliseconds(1), rig->read_start(0, 0));
}

TEST(VirtualPicture, TheStrobeIsWhiteInColour) {
  VirtualCameraOptions c = small_camera();
  c.layout.format = PixelFormat::rgb8;
  c.layout.bit_depth = 8;
  const Frame f = frame_with(c, {Pass::smear}, 40.3 * 250e-6);
  for (int channel = 0; channel < 3; ++channel) EXPECT_NEAR(f.image->view().sample(30, 90, channel), 46, 1);
}

}  // namespace
}  // namespace emberlock::drivers
