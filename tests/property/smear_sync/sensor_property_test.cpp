// SPDX-License-Identifier: Apache-2.0
// Laws of what reads walks, codes, bands and sweeps: what is told is true, whatever was filmed; else it says
// why not.
#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "smear_sync/clocks/frame_code.h"
#include "smear_sync/clocks/read_mode.h"
#include "smear_sync/clocks/staircase.h"
#include "tests/support/clock_film.h"
#include "tests/support/properties.h"
#include "tests/support/shutters.h"

namespace emberlock::smear {
namespace {

using test::any_real;
using test::law;

ReadDirection any_direction() {
  return *rc::gen::element(ReadDirection::top_first, ReadDirection::bottom_first);
}

TEST(ReadModeLaws, ADirectionThatIsToldIsTheCameras) {
  int films = 0;
  int told = 0;
  int shifts_told = 0;
  law("whatever strobe, lamp and crystal", [&] {
    test::ClockFilm f{.flash_rate = 23.976 * any_real(0.985, 1.015),
                      .first_flash = any_real(0, 0.04),
                      .frames = *rc::gen::inRange(20, 200),
                      .lamp = any_real(180, 540),
                      .seed = static_cast<std::uint64_t>(*rc::gen::inRange(0, 1'000'000))};
    f.timing.direction = any_direction();
    f.timing.shifts = *rc::gen::element(720, 740, 772);
    f.timing.frame_period = Seconds(1 / 23.976 * (1 + any_real(-40e-6, 40e-6)));
    f.dot_noise = any_real(0, 0.2);
    f.miss = any_real(0, 0.2);
    const auto mode =
        find_read_mode(film(f), {.flash_rate = Hertz(f.flash_rate), .row_time = f.timing.row_time});
    RC_ASSERT(mode.ok());
    RC_ASSERT(!mode->direction_reason.empty());
    ++films;
    if (!mode->direction) return;
    ++told;
    RC_ASSERT(*mode->direction == f.timing.direction);
    const double off = (1 / (23.976 * f.timing.frame_period.value()) - 1) * 1e6;
    RC_ASSERT(std::abs(mode->frame_rate_error->value() - off) < 6 * mode->frame_rate_sigma.value() + 0.1);
    shifts_told += mode->shifts ? 1 : 0;
    if (mode->shifts_sigma > Rows(0)) {
      const Rows shifts_off = mode->shifts_measured - Rows(f.timing.shifts);
      RC_ASSERT(abs(wrap_symmetric(shifts_off, mode->shifts_modulo)) < 5 * mode->shifts_sigma);
    }
    if (!mode->shifts) return;
    RC_ASSERT(*mode->shifts == f.timing.shifts);
  });
  EXPECT_GT(told, 0.9 * films) << "a law of what is never told would be empty";
  EXPECT_GT(shifts_told, 0.15 * films);
}

TEST(StaircaseLaws, StairsClimbARowARowAndAreInvertedToTheirOwnRow) {
  law("stair(x + 1) = stair(x) + 1; never down; its inverse is within the step", [] {
    const double width = any_real(0, 1.5);
    const double x = any_real(2, 700);
    const double u = stair(x, width);
    RC_ASSERT(std::abs(stair(x + 1, width) - u - 1) < 1e-9);
    RC_ASSERT(stair(x + any_real(0, 1), width) >= u - 1e-12);
    RC_ASSERT(std::abs(u - (x - 0.5)) <= 0.5 + 1e-9);
    const StairMoments back = invert_stair(u, 0.01, width);
    RC_ASSERT(std::abs(back.mean - x) <= 0.55);
    RC_ASSERT(std::abs(back.mean - x) <= 4 * back.sigma + 0.01);
  });
}

TEST(FrameCodeLaws, FramesAreNumberedAsTheFlashesThatLitThem) {
  const FrameCode code;
  const auto pattern = flash_pattern(code);
  ASSERT_TRUE(pattern.ok());
  int films = 0;
  int numbered = 0;
  law("numbers are right or not given, though frames were misread", [&] {
    const double step = 1 + any_real(-2e-4, 2e-4);
    const double start = any_real(0, code.flashes());
    const int frames = *rc::gen::inRange(60, 500);
    const auto seed = static_cast<std::uint64_t>(*rc::gen::inRange(0, 1'000'000));
    std::vector<CodeFrame> seen;
    for (int i = 0; i < frames; ++i) {
      const double read = start + step * i;
      // The picture is lit by the flash of the period before its read phase.
      const auto flash = static_cast<std::int64_t>(std::ceil(read)) - 1;
      const auto place = static_cast<std::size_t>((flash % code.flashes() + code.flashes()) % code.flashes());
      bool lit = (*pattern)[place];
      if (random_uniform(seed, 1, static_cast<std::uint64_t>(i)) < 0.01) lit = !lit;
      seen.push_back({i, lit ? FlashSeen::yes : FlashSeen::no});
    }
    const auto numbers = number_frames(seen, {.code = code, .flashes_per_frame = step});
    RC_ASSERT(numbers.ok());
    RC_ASSERT(!numbers->reason.empty());
    ++films;
    numbered += numbers->runs.empty() ? 0 : 1;
    for (const NumberedRun& run : numbers->runs) {
      const std::int64_t i = run.first + (run.last - run.first) / 2;
      const double truth = start + step * static_cast<double>(i);
      const double told = run.start + step * static_cast<double>(i - run.first);
      RC_ASSERT(std::abs(wrap_symmetric(told - truth, code.flashes())) <= run.start_slack + 0.51);
    }
  });
  EXPECT_GT(numbered, 0.7 * films) << "a law of what is never told would be empty";
}

TEST(RollingBandLaws, APhaseThatIsToldIsTheFlashs) {
  law("whatever exposure, direction, light and phase", [] {
    test::Roller r;
    r.timing.direction = any_direction();
    r.exposure = any_real(0.5e-3, 30e-3);
    r.ambient = any_real(0, 60);
    r.flash = any_real(10, 100);
    r.noise = any_real(0.01, 0.4);
    r.seed = static_cast<std::uint64_t>(*rc::gen::inRange(0, 1'000'000));
    const double tau = any_real(0, r.timing.frame_period.value());
    r.first_flash = tau;
    const BandReading bands = r.read(3);
    const Phase phase = phase_of(bands.reading, r.timing, Seconds(r.flash_width));
    RC_CLASSIFY(phase.state == PhaseState::known, "told");
    const double row = r.timing.row_time.value();
    const bool in_frame = tau > 4 * row && tau < (r.timing.rows - 4) * row;
    if (in_frame) RC_ASSERT(phase.state == PhaseState::known);
    if (phase.state != PhaseState::known) return;
    const double off = wrap_symmetric(phase.tau.value() - tau, r.timing.frame_period.value());
    RC_ASSERT(std::abs(off) < row);
  });
}

TEST(ExposureSweepLaws, AWindowThatIsToldIsTheShutters) {
  law("whatever shutter and light", [] {
    test::Shutter s;
    s.end = any_real(0, test::kShutterPeriod);
    s.exposure = any_real(0.01, 0.97) * test::kShutterPeriod;
    s.ambient = any_real(0, 60);
    s.flash = any_real(10, 100);
    s.noise = any_real(0.01, 0.5);
    s.seed = static_cast<std::uint64_t>(*rc::gen::inRange(0, 1'000'000));
    const auto window = fit_exposure(s.sweep(microseconds(2)), s.options());
    RC_ASSERT(window.ok());
    const auto off = [](Seconds a, double b) {
      return std::abs(wrap_symmetric(a.value() - b, test::kShutterPeriod));
    };
    RC_ASSERT(off(window->end, s.end) < 5 * window->end_sigma.value());
    RC_ASSERT(off(window->begin, s.end - s.exposure) < 5 * window->begin_sigma.value());
  });
}

}  // namespace
}  // namespace emberlock::smear
