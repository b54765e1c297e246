// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/flash_rate.h"

#include <cmath>
#include <map>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "smear_sync/ccd_model.h"

namespace emberlock::smear {
namespace {

constexpr Seconds kFlashWidthSeen = microseconds(20);
constexpr double kFrameRate = 23.976;

CcdTiming ccd_of(int shifts, ReadDirection direction) {
  return {.rows = 720, .shifts = shifts, .direction = direction};
}

/// What a camera's film shows whose read phase 0 begins at `start`, of flashes at `flashes`.
FlashFilm dots_filmed(const CcdTiming& timing, double lamp, Seconds start,
                      const std::vector<Seconds>& flashes, int frames = 12) {
  struct Image {
    bool lit = false;
    std::vector<double> dots;
  };
  std::map<int, Image> images;
  for (const Seconds at : flashes) {
    const Seconds t = at - start;
    const int frame = static_cast<int>(std::floor(t / timing.frame_period));
    images[frame + 1].lit = true;
    for (const FlashPart& part : split(timing, {t, Seconds(0)})) {
      if (part.shifts >= timing.shifts) continue;
      const auto centre = smear_centre(timing, Rows(lamp), part);
      if (centre && std::abs(centre->row.value() - lamp) > 20)
        images[centre->image].dots.push_back(centre->row.value());
    }
  }
  FlashFilm film{timing, {}};
  for (int i = 0; i < frames; ++i) {
    FrameReading frame{i, {}};
    if (images[i].lit) {
      frame.reading.lamp = LampReading{640, Rows(lamp), Rows(0.05), 4, false};
      const auto& dots = images[i].dots;
      frame.reading.state = dots.empty()       ? SmearState::no_dot
                            : dots.size() == 1 ? SmearState::dot
                                               : SmearState::comb;
      for (const double y : dots)
        frame.reading.dots.push_back({640, Rows(y), Rows(0.05), 20, 30, Side::below});
    }
    film.frames.push_back(frame);
  }
  return film;
}

std::vector<Seconds> flashes_at(Hertz rate, Seconds first = milliseconds(-90), Seconds until = Seconds(1)) {
  std::vector<Seconds> flashes;
  for (int i = 0; first + i * period(rate) < until; ++i) flashes.push_back(first + i * period(rate));
  return flashes;
}

std::vector<FlashFilm> rig_films(const std::vector<Seconds>& flashes) {
  const auto top = ReadDirection::top_first;
  const auto bottom = ReadDirection::bottom_first;
  return {dots_filmed(ccd_of(720, top), 300, milliseconds(3), flashes),
          dots_filmed(ccd_of(740, top), 410, milliseconds(17), flashes),
          dots_filmed(ccd_of(740, bottom), 350, milliseconds(29), flashes),
          dots_filmed(ccd_of(772, bottom), 500, milliseconds(36), flashes)};
}

class AtAnyRate : public testing::TestWithParam<double> {};

TEST_P(AtAnyRate, TellsItFromHalfASecondOfFilm) {
  const Hertz truth(GetParam() * kFrameRate);
  const FlashRate seen = see_flashes(rig_films(flashes_at(truth)), kFlashWidthSeen);
  ASSERT_EQ(seen.seen, FlashesSeen::rate) << name(seen.seen);
  EXPECT_NEAR(seen.rate / truth, 1, 5e-4);
  EXPECT_LT(std::abs(seen.rate / truth - 1) * 1e6, 4 * seen.sigma.value());
  EXPECT_GE(seen.cameras, 2);
}

INSTANTIATE_TEST_SUITE_P(FlashRate, AtAnyRate,
                         testing::Values(0.5, 2.0 / 3, 0.75, 0.95, 0.997, 0.9997, 1.0, 1.00005, 1.003, 1.05,
                                         1.3, 1.5, 2.0, 2.5, 4.0, 12.51));

TEST(FlashRate, ARowTimeThatIsOnePerCentOffTellsItStill) {
  for (const double times : {0.95, 1.003, 1.05, 2.0}) {
    const Hertz truth(times * kFrameRate);
    std::vector<FlashFilm> films = rig_films(flashes_at(truth));
    for (FlashFilm& film : films) film.timing.row_time *= 1.01;
    const FlashRate seen = see_flashes(films, kFlashWidthSeen);
    ASSERT_EQ(seen.seen, FlashesSeen::rate) << times;
    EXPECT_NEAR(seen.rate / truth, 1, 1e-3) << times;
  }
}

// One camera, whose transfer rests when every second flash comes.
TEST(FlashRate, WhatMayBeHiddenIsSaidToBePossible) {
  const CcdTiming timing = ccd_of(720, ReadDirection::top_first);
  const Seconds T = timing.frame_period;
  // Half a period after the flash that shows the register rests.
  const std::vector<Seconds> flashes = flashes_at(2 * rate(T), 0.48 * T - 3 * T);
  const FlashRate seen =
      see_flashes(std::vector{dots_filmed(timing, 300, Seconds(0), flashes)}, kFlashWidthSeen);
  ASSERT_EQ(seen.seen, FlashesSeen::rate);
  EXPECT_NEAR(seen.rate.value(), kFrameRate, 0.01);
  ASSERT_FALSE(seen.others.empty());
  EXPECT_NEAR(seen.others.front().value(), 2 * kFrameRate, 0.02);
  // Another camera, which shows them, leaves no doubt.
  const FlashRate sure = see_flashes(
      std::vector{dots_filmed(timing, 300, Seconds(0), flashes), dots_filmed(timing, 300, 0.2 * T, flashes)},
      kFlashWidthSeen);
  ASSERT_EQ(sure.seen, FlashesSeen::rate);
  EXPECT_NEAR(sure.rate.value(), 2 * kFrameRate, 0.02);
}

TEST(FlashRate, ADialThatIsTurnedMeanwhileShowsNone) {
  std::vector<Seconds> flashes = flashes_at(Hertz(0.95 * kFrameRate), milliseconds(-90), milliseconds(230));
  for (const Seconds t : flashes_at(Hertz(1.02 * kFrameRate), milliseconds(243))) flashes.push_back(t);
  EXPECT_EQ(see_flashes(rig_films(flashes), kFlashWidthSeen).seen, FlashesSeen::unsteady);
}

TEST(FlashRate, OneCameraThatIsReadTheOtherWayIsOutvoted) {
  const Hertz truth(1.004 * kFrameRate);
  std::vector<FlashFilm> films = rig_films(flashes_at(truth));
  films[1].timing.direction = ReadDirection::bottom_first;
  const FlashRate seen = see_flashes(films, kFlashWidthSeen);
  ASSERT_EQ(seen.seen, FlashesSeen::rate);
  EXPECT_NEAR(seen.rate / truth, 1, 5e-4);
}

TEST(FlashRate, WithoutDotsItSaysWhatIsSeenInstead) {
  const CcdTiming timing = ccd_of(720, ReadDirection::top_first);
  const auto of = [&](SmearState state) {
    FlashFilm film{timing, {}};
    for (int i = 0; i < 12; ++i)
      film.frames.push_back({i, {.state = state, .lamp = {}, .dots = {}, .reason = {}}});
    return see_flashes(std::vector{film, film}, kFlashWidthSeen).seen;
  };
  EXPECT_EQ(of(SmearState::no_lamp), FlashesSeen::none);
  EXPECT_EQ(of(SmearState::steady), FlashesSeen::too_fast);
  EXPECT_EQ(of(SmearState::no_dot), FlashesSeen::hidden);
  EXPECT_EQ(see_flashes({}, kFlashWidthSeen).seen, FlashesSeen::none);
  const FlashRate slow = see_flashes(rig_films({milliseconds(200)}), kFlashWidthSeen);
  EXPECT_EQ(slow.seen, FlashesSeen::too_slow);
  EXPECT_NEAR(slow.rate.value(), 3 * kFrameRate / 12, 0.01);
}

}  // namespace
}  // namespace emberlock::smear
