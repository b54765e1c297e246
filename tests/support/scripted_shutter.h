// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "smear_sync/sensors/phase_sensor.h"

namespace emberlock::test {

/// A shutter in a room, drawn by its definition: row r gathers [end + r t_row - exposure, end + r t_row) of
/// every period; t_row = 0 is a global one. Grey levels of 12 bits. Whatever is set may change at any time.
struct ScriptedShutter {
  Seconds period{1 / 30.0};
  Seconds end = milliseconds(9.1);  ///< of the first row, at time zero
  PartsPerMillion rate{0};          ///< by which its tau grows
  Seconds exposure = milliseconds(4);
  SecondsPerRow row_time{0};
  Seconds flash_width = microseconds(20);
  double ambient = 200;
  double flash = 900;
  double noise = 4;
  bool another_strobe = false;  ///< gives every third picture a whole flash
  std::uint64_t seed = 1;

  static constexpr ImageSize kSize{48, 120};

  /// tau at `at` of a flash that comes `delay` late.
  [[nodiscard]] Seconds tau(TimePoint at, Seconds delay) const {
    return wrap_positive(delay - end + (at - TimePoint{}) * (rate.value() * 1e-6), period);
  }

  [[nodiscard]] Image picture(TimePoint at, const smear::Look& look) {
    Image image(ImageLayout{kSize, PixelFormat::gray16, 12});
    RandomStream random(seed, static_cast<std::uint64_t>(++pictures_));
    const bool other = another_strobe && pictures_ % 3 == 0;
    for (int y = 0; y < kSize.height; ++y) {
      const double part = other ? 1 : look.delay ? gathered(at, *look.delay, y) : 0;
      const double scene = 1 + 0.4 * std::sin(0.05 * y);
      for (int x = 0; x < kSize.width; ++x) {
        const double level = scene * (ambient + flash * part) + random.normal(0, noise);
        image.row_as<std::uint16_t>(y)[x] =
            static_cast<std::uint16_t>(std::clamp(std::round(level), 0.0, 4095.0));
      }
    }
    return image;
  }

 private:
  [[nodiscard]] double gathered(TimePoint at, Seconds delay, int row) const {
    const double after = (tau(at, delay) - Rows(row) * row_time).value();  // of the row's end
    const double width = flash_width.value();
    double sum = 0;
    for (int turn = -2; turn <= 1; ++turn) {
      const double begin = after + turn * period.value() - width / 2;
      sum += std::max(0.0, std::min(begin + width, 0.0) - std::max(begin, -exposure.value())) / width;
    }
    return sum;
  }

  int pictures_ = 0;
};

inline const smear::PeriodOffset kStill{PartsPerMillion(0), PartsPerMillion(1)};

/// What a sensor told in a round.
struct ToldRound {
  smear::Phase phase;  ///< the last one
  TimePoint at;
  int looks = 0;
};

/// Films a shutter for a sensor as rig/align/bench.h films a camera: looks three periods apart until the
/// sensor is content, then four frames of flashes that come `delay` late.
class SensorRounds {
 public:
  SensorRounds(ScriptedShutter& shutter, smear::PhaseSensor& sensor) : shutter_(shutter), sensor_(sensor) {}

  ToldRound film(const smear::PeriodOffset& own, Seconds wanted = microseconds(10)) {
    ToldRound told;
    sensor_.begin_round(own);
    for (int asked = 0; asked < 40; ++asked) {
      const std::vector<smear::Look> looks = sensor_.next_looks(wanted);
      if (looks.empty()) break;
      for (const smear::Look& look : looks) {
        take(look, 3);
        ++told.looks;
      }
    }
    for (int i = 0; i < 4; ++i) take({kDelay}, 1);
    for (const smear::PhaseSample& sample : sensor_.phases(kDelay)) {
      told.phase = sample.phase;
      told.at = sample.at;
    }
    return told;
  }
  /// Films a round whose phase is right within its error, which is less than `sigma`.
  ToldRound expect_true(const smear::PeriodOffset& own, Seconds sigma = microseconds(40)) {
    const ToldRound told = film(own);
    EXPECT_EQ(told.phase.state, smear::PhaseState::known) << told.phase.reason;
    EXPECT_LT(off(told), 4 * told.phase.sigma);
    EXPECT_LT(told.phase.sigma, sigma);
    return told;
  }
  /// By how much the phase that was told is off.
  [[nodiscard]] Seconds off(const ToldRound& told) const {
    return abs(wrap_symmetric(told.phase.tau - shutter_.tau(told.at, kDelay), shutter_.period));
  }
  /// A picture whose rows overlap.
  smear::SmearReading take_malformed() {
    const Image picture = shutter_.picture(now_, {kDelay});
    ImageView view = picture.view();
    view.stride = 1;
    return sensor_.take(view, now_, {kDelay});
  }
  void wait(Seconds time) { now_ = now_ + time; }

  static constexpr Seconds kDelay{0.0175};

 private:
  void take(const smear::Look& look, double periods) {
    now_ = now_ + periods * shutter_.period;
    const Image picture = shutter_.picture(now_, look);
    (void)sensor_.take(picture.view(), now_, look);
  }

  ScriptedShutter& shutter_;
  smear::PhaseSensor& sensor_;
  TimePoint now_;
};

/// What is said of an exposure that is too short, and of one that is too long; then it is as it was.
inline void expect_exposures_advised(ScriptedShutter& shutter, SensorRounds& rounds,
                                     const char* of_long_one) {
  const Seconds right = shutter.exposure;
  shutter.exposure = microseconds(30);
  EXPECT_THAT(rounds.film(kStill).phase.reason, testing::HasSubstr("lengthen"));
  shutter.exposure = shutter.period;
  EXPECT_THAT(rounds.film(kStill).phase.reason, testing::HasSubstr(of_long_one));
  shutter.exposure = right;
}

}  // namespace emberlock::test
