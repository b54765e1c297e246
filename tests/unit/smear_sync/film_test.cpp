// SPDX-License-Identifier: Apache-2.0
// What many frames tell that one can't.
#include "smear_sync/detect/film.h"

#include <cmath>

#include <gtest/gtest.h>

#include "smear_sync/detect/detect.h"
#include "tests/support/smear_frames.h"

namespace emberlock::smear {
namespace {

using test::SmearScene;

constexpr double kFilmLampX = 81.3;
constexpr double kFilmLampY = 180.4;

SmearScene film_scene(double bright = 3000) {
  return SmearScene(160, 360).disk(kFilmLampX, kFilmLampY, 4, bright);
}

TEST(Film, UnsaturatedFramesTellTheLampsRow) {
  std::vector<SmearReading> film;
  for (std::uint64_t i = 0; i < 40; ++i) {
    // A bloom drags the saturated lamp down.
    const bool saturated = i % 4 != 0;
    SmearScene scene = film_scene(saturated ? 3000 : 180);
    if (saturated) scene.bloom(kFilmLampX, kFilmLampY, 2.5, 0, 60, 800);
    film.push_back(detect(scene.image({.seed = i}).view()));
  }
  const auto lamp = combine_lamps(film);
  ASSERT_TRUE(lamp);
  EXPECT_FALSE(lamp->saturated);
  EXPECT_NEAR(lamp->y.value(), kFilmLampY, 0.02);
  EXPECT_NEAR(lamp->x, kFilmLampX, 0.02);
  EXPECT_LT(lamp->sigma.value(), 0.02);
  EXPECT_GE(lamp->sigma.value() * 5, std::abs(lamp->y.value() - kFilmLampY));

  film[1].lamp->y += Rows(3);  // as if the camera had been bumped
  const std::vector<SmearReading> shared = share_lamp(film);
  for (std::size_t i = 0; i < film.size(); ++i) {
    EXPECT_EQ(shared[i].lamp->y, i == 1 ? film[i].lamp->y : combine_lamps(film)->y);
    EXPECT_EQ(shared[i].state, film[i].state);
  }
}

// A flash that the transfer cut in two is dim, and its dot stands a row beside the lamp.
TEST(Film, AFewUnsaturatedFramesAmongSaturatedOnesTellNothing) {
  std::vector<SmearReading> film;
  for (std::uint64_t i = 0; i < 40; ++i) film.push_back(detect(film_scene().image({.seed = i}).view()));
  for (const std::size_t dim : {7U, 19U}) {
    film[dim] = detect(film_scene(90).disk(kFilmLampX, kFilmLampY + 1.6, 4, 90).image({.seed = dim}).view());
    ASSERT_FALSE(film[dim].lamp->saturated);
  }
  EXPECT_NEAR(combine_lamps(film)->y.value(), kFilmLampY, 0.1);
}

TEST(Film, AWalkJustLongEnoughToTellLosesNoDot) {
  for (const double travel : {2.0, 3.0, 3.9, 4.2, 6.0}) {
    std::vector<SmearReading> film;
    for (int i = 0; i < 40; ++i) {
      SmearScene scene = film_scene();
      scene.disk(kFilmLampX, kFilmLampY - 30 - travel * i / 39, 4, 20);
      film.push_back(detect(scene.image({.seed = static_cast<std::uint64_t>(i)}).view()));
    }
    for (const SmearReading& r : settle(film))
      EXPECT_EQ(r.state, SmearState::dot) << travel << ": " << r.reason;
  }
}

TEST(Film, ManySaturatedFramesDontHideTheirCommonError) {
  std::vector<SmearReading> film;
  for (std::uint64_t i = 0; i < 30; ++i) film.push_back(detect(film_scene().image({.seed = i}).view()));
  const auto lamp = combine_lamps(film);
  ASSERT_TRUE(lamp);
  EXPECT_TRUE(lamp->saturated);
  EXPECT_GE(lamp->sigma.value(), 0.015);
  EXPECT_FALSE(combine_lamps({}));
}

/// A camera's film: the lamp, its reflection below it if there is one, and their dots k0 + i rows on.
std::vector<SmearReading> film_of(double reflection, double aside, int first_shift, int rows_a_frame,
                                  const std::vector<double>& hot) {
  std::vector<SmearReading> film;
  for (int i = 0; i < 12; ++i) {
    SmearScene scene = film_scene();
    const double shift = first_shift + rows_a_frame * i;
    scene.disk(kFilmLampX, kFilmLampY - shift, 4, 20);
    if (reflection > 0) {
      scene.disk(kFilmLampX + aside, kFilmLampY + reflection, 4, 3000);
      scene.disk(kFilmLampX + aside, kFilmLampY + reflection - shift, 4, 20);
    }
    for (const double row : hot) scene.disk(kFilmLampX, row, 4, 20);
    film.push_back(detect(scene.image({.seed = static_cast<std::uint64_t>(i)}).view()));
  }
  return film;
}

TEST(Film, AReflectionInTheSameColumnIsToldFromTheLampByTheWalkOfBothDots) {
  for (const double aside : {0.0, 1.0}) {
    const std::vector<SmearReading> film = film_of(120, aside, 30, 3, {});
    for (const SmearReading& r : film) ASSERT_EQ(r.state, SmearState::ambiguous) << r.reason;
    const std::vector<SmearReading> settled = settle(film);
    for (std::size_t i = 0; i < settled.size(); ++i) {
      ASSERT_EQ(settled[i].state, SmearState::dot) << "frame " << i << ": " << settled[i].reason;
      EXPECT_NEAR((settled[i].lamp->y - settled[i].dots[0].y).value(), 30 + 3.0 * static_cast<double>(i),
                  0.5);
    }
  }
}

TEST(Film, ASpotThatStandsWhileTheDotWalksIsNone) {
  const std::vector<SmearReading> film = film_of(0, 0, 30, 3, {300});
  const std::vector<SmearReading> settled = settle(film);
  for (std::size_t i = 0; i < settled.size(); ++i) {
    ASSERT_EQ(settled[i].state, SmearState::dot) << settled[i].reason;
    ASSERT_EQ(settled[i].dots.size(), 1U);
    EXPECT_NEAR(settled[i].dots[0].y.value(), kFilmLampY - 30 - 3.0 * static_cast<double>(i), 0.3);
  }
}

// Flashes at a multiple of the frame rate; faint teeth at either end are seen in every third frame.
TEST(Film, ACombThatStandsStaysAComb) {
  std::vector<SmearReading> film;
  for (int i = 0; i < 12; ++i) {
    SmearScene scene = film_scene();
    for (int tooth = 1; tooth <= 4; ++tooth) scene.disk(kFilmLampX, kFilmLampY - 30 * tooth, 4, 20);
    if (i % 3 == 0) scene.disk(kFilmLampX, kFilmLampY + 30, 4, 20);
    if (i % 3 == 1) scene.disk(kFilmLampX, kFilmLampY + 60, 4, 20);
    film.push_back(detect(scene.image({.seed = static_cast<std::uint64_t>(i)}).view()));
    ASSERT_EQ(film.back().state, SmearState::comb) << film.back().reason;
  }
  const std::vector<SmearReading> settled = settle(film);
  for (std::size_t i = 0; i < film.size(); ++i) {
    EXPECT_EQ(settled[i].state, SmearState::comb) << settled[i].reason;
    EXPECT_EQ(settled[i].dots.size(), film[i].dots.size());
  }
}

TEST(Film, WhereNothingMovesNothingIsSettled) {
  const std::vector<SmearReading> settled = settle(film_of(120, 1, 30, 0, {}));
  for (const SmearReading& r : settled) {
    EXPECT_EQ(r.state, SmearState::ambiguous);
    EXPECT_NE(r.reason.find("detune"), std::string::npos) << r.reason;
  }
}

}  // namespace
}  // namespace emberlock::smear
