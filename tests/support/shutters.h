// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "base/random.h"
#include "smear_sync/sensors/exposure_sweep.h"
#include "smear_sync/sensors/rolling_band.h"

namespace emberlock::test {

/// A rolling shutter by definition: row r gathers the flashes of the exposure before t_start + r t_row, of a
/// scene whose rows differ, in ambient light.
struct Roller {
  smear::CcdTiming timing{
      .rows = 480, .shifts = 480, .frame_period = Seconds(1 / 30.0), .row_time = microseconds_per_row(60)};
  double exposure = 4e-3;
  double ambient = 20;
  double flash = 60;
  double noise = 0.2;  ///< of a row's mean
  double flash_width = 20e-6;
  double flash_rate = 30;
  double first_flash = 0.012;
  std::uint64_t seed = 1;

  [[nodiscard]] smear::RowProfile frame(int i) const {
    smear::RowProfile p;
    p.noise = std::max(noise, 0.01);
    for (int y = 0; y < timing.rows; ++y) {
      const int order = timing.direction == smear::ReadDirection::top_first ? y : timing.rows - 1 - y;
      const double end = i * timing.frame_period.value() + order * timing.row_time.value();
      double light = 0;
      const int last = static_cast<int>(std::ceil((end - first_flash) * flash_rate)) + 1;
      for (int j = last - static_cast<int>(exposure * flash_rate) - 4; j <= last; ++j) {
        const double begin = first_flash + j / flash_rate - flash_width / 2;
        const double inside = std::min(begin + flash_width, end) - std::max(begin, end - exposure);
        light += std::clamp(inside / flash_width, 0.0, 1.0);
      }
      const double scene = 1 + 0.4 * std::sin(0.05 * y);
      p.level.push_back(
          scene * (ambient + flash * light) +
          noise * random_normal(seed, static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(y)));
    }
    return p;
  }
  /// A strobe detuned by 1 %, for as long as its band crosses the frame.
  [[nodiscard]] smear::BandReference reference() const {
    Roller detuned = *this;
    detuned.flash_rate = 1 / timing.frame_period.value() * 1.023;
    detuned.exposure = std::min(exposure, 0.4 * timing.frame_period.value());
    std::vector<smear::RowProfile> frames;
    for (int i = 0; i < 90; ++i) frames.push_back(detuned.frame(i));
    auto r = smear::learn_band_reference(frames);
    EXPECT_TRUE(r.ok());
    return r.ok() ? *r : smear::BandReference{};
  }
  [[nodiscard]] smear::BandReading read(int i) const {
    return smear::read_bands(frame(i), reference(), {.direction = timing.direction});
  }
};

constexpr double kShutterPeriod = 1 / 60.0;

/// A global shutter that gathers [end - exposure, end) of every period.
struct Shutter {
  double end = 0.0031;
  double exposure = 5e-3;
  double ambient = 12;
  double flash = 80;
  double noise = 0.5;
  double width = 20e-6;
  double white = 1e9;
  std::uint64_t seed = 1;

  [[nodiscard]] smear::SweepSample film(Seconds delay) const {
    double light = 0;
    for (int turn = -1; turn <= 2; ++turn) {
      const double begin = delay.value() - width / 2 + turn * kShutterPeriod;
      light += std::max(0.0, std::min(begin + width, end + kShutterPeriod) -
                                 std::max(begin, end + kShutterPeriod - exposure)) /
               width;
    }
    const auto counter = static_cast<std::uint64_t>(std::llround(delay.value() * 1e9));
    const double level = ambient + flash * light + noise * random_normal(seed, 5, counter);
    return {delay, std::min(level, white), noise, level >= white};
  }
  /// Films what next_delays() asks for, to the end.
  [[nodiscard]] std::vector<smear::SweepSample> sweep(
      Seconds resolution, smear::SweepEdges edges = smear::SweepEdges::both) const {
    std::vector<smear::SweepSample> samples;
    for (int round = 0; round < 40; ++round) {
      const auto delays = smear::next_delays(samples, options(), resolution, edges);
      if (delays.empty()) break;
      for (const Seconds d : delays) samples.push_back(film(d));
    }
    return samples;
  }
  [[nodiscard]] smear::SweepOptions options() const {
    return {.period = Seconds(kShutterPeriod), .flash_width = Seconds(width)};
  }
};

}  // namespace emberlock::test
