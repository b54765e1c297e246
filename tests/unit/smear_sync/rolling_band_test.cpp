// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/sensors/rolling_band.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "smear_sync/clocks/drift.h"
#include "smear_sync/clocks/row_clock.h"
#include "tests/support/shutters.h"

namespace emberlock::smear {
namespace {

using test::Roller;
using testing::HasSubstr;

TEST(RollingBand, TheFirstEdgeIsThePhaseWhateverTheExposureAndDirection) {
  for (const auto direction : {ReadDirection::top_first, ReadDirection::bottom_first}) {
    for (const double exposure : {1e-3, 4e-3, 20e-3, 31e-3}) {
      for (const double tau : {0.002, 0.0121, 0.0266}) {
        Roller r;
        r.timing.direction = direction;
        r.exposure = exposure;
        r.first_flash = tau;
        const BandReading bands = r.read(3);
        ASSERT_EQ(bands.reading.state, SmearState::dot)
            << bands.reading.reason << " " << exposure << " " << tau;
        const Phase phase = phase_of(bands.reading, r.timing, Seconds(r.flash_width));
        EXPECT_NEAR(phase.tau.value(), tau, 0.5 * 60e-6);
        EXPECT_LT(std::abs(phase.tau.value() - tau), 3 * phase.sigma.value());
      }
    }
  }
}

TEST(RollingBand, ABandThatReachesIntoTheNextFrameKeepsItsOwnFirstEdge) {
  Roller r;
  r.first_flash = 0.027;  // rows 450 and on, and the top of the next frame
  r.exposure = 8e-3;
  const BandReading bands = r.read(5);
  ASSERT_EQ(bands.reading.state, SmearState::dot);
  EXPECT_NEAR(bands.reading.dots[0].y.value(), 450, 1);
}

TEST(RollingBand, TheLengthOfABandIsTheExposure) {
  const BandReading bands = Roller{}.read(2);
  ASSERT_EQ(bands.lengths.size(), 1U);
  EXPECT_NEAR(bands.lengths[0].value(), 4e-3 / 60e-6, 0.6);
}

TEST(RollingBand, AFlashInThePauseBetweenFramesIsBlindNotWrong) {
  Roller r;
  r.first_flash = 0.031;
  r.exposure = 6e-3;
  EXPECT_EQ(r.read(4).reading.state, SmearState::no_dot);
  EXPECT_EQ(phase_of(r.read(4).reading, r.timing, Seconds(r.flash_width)).state, PhaseState::blind);
}

TEST(RollingBand, AnExposureOfThePeriodShowsNoEdge) {
  Roller r;
  r.exposure = 1 / 30.0;
  EXPECT_EQ(r.read(4).reading.state, SmearState::steady);
}

TEST(RollingBand, AmbientLightAloneIsNoFlash) {
  Roller r;
  RowProfile dark = r.frame(0);
  r.flash = 0;
  EXPECT_EQ(read_bands(r.frame(1), Roller{}.reference()).reading.state, SmearState::no_lamp);
  Roller faint;
  const BandReference reference = faint.reference();
  RowProfile noisy = faint.frame(2);
  noisy.noise = 30;
  EXPECT_THAT(read_bands(noisy, reference).reading.reason, HasSubstr("faint"));
}

TEST(RollingBand, SeveralBandsAFrameTellTheRowTime) {
  for (const auto direction : {ReadDirection::top_first, ReadDirection::bottom_first}) {
    Roller r;
    r.timing.direction = direction;
    r.exposure = 0.4e-3;
    const BandReference reference = r.reference();
    r.flash_rate = 411.3;
    std::vector<SmearReading> combs;
    for (int i = 0; i < 24; ++i) {
      combs.push_back(read_bands(r.frame(i), reference, {.direction = direction}).reading);
      ASSERT_EQ(combs.back().state, SmearState::comb) << combs.back().reason;
    }
    const auto clock = fit_row_clock(combs, Hertz(r.flash_rate));
    ASSERT_TRUE(clock.ok()) << clock.error().message();
    EXPECT_NEAR(clock->row_time.value() * 1e9, 60e3, std::max(3 * clock->sigma.value() * 1e9, 3.0));
    EXPECT_LT(clock->sigma.value(), 20e-9);
  }
}

TEST(RollingBand, ADetunedStrobeGivesAPhaseBelowARow) {
  Roller r;
  r.flash_rate = 30 * (1 - 400e-6);
  const BandReference reference = r.reference();
  std::vector<PhaseSample> samples;
  for (int i = 0; i < 300; ++i) {
    samples.push_back(sample_of(read_bands(r.frame(i), reference).reading, r.timing, Seconds(r.flash_width),
                                TimePoint{} + r.timing.frame_period * i));
  }
  const auto line = fit_drift(samples, {.period = r.timing.frame_period, .row_time = r.timing.row_time});
  ASSERT_TRUE(line.ok());
  const double at = (line->at - TimePoint{}).value();
  const double truth =
      r.first_flash + (at - r.first_flash) * (1 - r.timing.frame_period.value() * r.flash_rate);
  EXPECT_NEAR(wrap_symmetric(line->tau.value() - truth, r.timing.frame_period.value()) / 60e-6, 0, 0.02);
}

/// First edges at delays over the whole period, each of another frame.
std::vector<SweptEdge> swept(ReadDirection direction, double beat_ppm = 0) {
  std::vector<SweptEdge> edges;
  Roller still;
  still.timing.direction = direction;
  const BandReference reference = still.reference();
  for (int i = 0; i < 24; ++i) {
    Roller r = still;
    const double delay = (i * 7 % 24) / 24.0 * still.timing.frame_period.value();
    const double at = 5 * i * still.timing.frame_period.value();
    r.first_flash = 0.004 + delay + beat_ppm * 1e-6 * at;
    const BandReading bands = read_bands(r.frame(2), reference, {.direction = direction});
    if (bands.reading.state != SmearState::dot) continue;
    const double y = bands.reading.dots[0].y.value();
    edges.push_back({TimePoint{} + Seconds(at), Seconds(delay),
                     Rows(direction == ReadDirection::top_first ? y : r.timing.rows - 1 - y)});
  }
  return edges;
}

TEST(RollingBand, ASweepOfTheStrobesPhaseTellsTheRowTimeWhateverTheBeat) {
  for (const auto direction : {ReadDirection::top_first, ReadDirection::bottom_first}) {
    for (const double beat : {0.0, 150.0, -150.0}) {
      const auto edges = swept(direction, beat);
      ASSERT_GT(edges.size(), 15U);
      const auto clock = fit_swept_row_clock(edges, Roller{}.timing.frame_period);
      ASSERT_TRUE(clock.ok()) << clock.error().message();
      EXPECT_LT(std::abs(clock->row_time.value() - 60e-6), 3 * clock->sigma.value()) << beat;
      EXPECT_LT(clock->sigma.value(), 60e-6 / 1500);
    }
  }
}

TEST(RollingBand, ASweepReadFromTheWrongEndIsToldByItsDirection) {
  auto edges = swept(ReadDirection::top_first);
  for (SweptEdge& e : edges) e.row = Rows(479) - e.row;
  const auto clock = fit_swept_row_clock(edges, Roller{}.timing.frame_period);
  ASSERT_FALSE(clock.ok());
  EXPECT_THAT(clock.error().remedy, HasSubstr("other read direction"));
}

TEST(RollingBand, EdgesThatStandAnywhereTellNoRowTime) {
  auto edges = swept(ReadDirection::top_first);
  for (std::size_t i = 0; i < edges.size(); ++i) edges[i].row = Rows(480 * random_uniform(3, 3, i));
  EXPECT_FALSE(fit_swept_row_clock(edges, Roller{}.timing.frame_period).ok());
  edges.resize(5);
  EXPECT_FALSE(fit_swept_row_clock(edges, Roller{}.timing.frame_period).ok());
}

TEST(RollingBand, AReferenceNeedsEveryRowLitAndDark) {
  Roller r;
  const std::vector<RowProfile> still(10, r.frame(0));
  const auto refused = learn_band_reference(still);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().what, HasSubstr("row 0"));
  EXPECT_FALSE(learn_band_reference({}).ok());
  EXPECT_EQ(read_bands(r.frame(0), {}).reading.state, SmearState::ambiguous);
}

TEST(RollingBand, TheProfileOfAPictureIsTheMeanOfItsRows) {
  Image image({{64, 20}, PixelFormat::gray8, 8});
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 64; ++x) image.row_as<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(y * 3 + x % 2);
  }
  const RowProfile profile = row_profile(image.view());
  ASSERT_EQ(profile.level.size(), 20U);
  for (int y = 0; y < 20; ++y) EXPECT_NEAR(profile.level[static_cast<std::size_t>(y)], y * 3 + 0.5, 1e-9);
  EXPECT_GT(profile.noise, 0);
  EXPECT_TRUE(row_profile({}).level.empty());
}

}  // namespace
}  // namespace emberlock::smear
