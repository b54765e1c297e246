// SPDX-License-Identifier: Apache-2.0
#include "films/import_plan.h"

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::films {
namespace {

using testing::HasSubstr;

/// A film of `frames` whose place 0 was read at `start`.
TimedFilm film_of(const std::string& id, double start, double period, std::int64_t frames) {
  smear::ClipTimes times;
  times.start = Seconds(start);
  times.period = Seconds(period);
  times.start_sigma = Seconds(3e-6);
  times.period_sigma = Seconds(4e-9);
  return {id, id + ".mp4", times, frames, {}};
}

TEST(ImportPlan, TakesOfEachFilmTheFrameNearestToTheReferencesInstant) {
  const std::vector films{film_of("a", 0, 0.04, 100), film_of("b", -0.21, 0.04, 110),
                          film_of("c", 1.013, 0.0400008, 60)};
  const auto plan = plan_frames(films, 0, {});
  ASSERT_TRUE(plan.ok()) << plan.error().message();
  for (std::size_t i = 0; i < plan->instants.size(); ++i) {
    const Seconds instant = films[0].times.read_start(plan->cameras[0].places[i]);
    for (std::size_t c = 0; c < films.size(); ++c) {
      double least = 1e9;
      for (std::int64_t p = 0; p < films[c].frames; ++p)
        least = std::min(least, std::abs((films[c].times.read_start(p) - instant).value()));
      EXPECT_EQ(std::abs(plan->cameras[c].late_s[i]), least);
      const auto own = [&](std::size_t film) {
        return std::hypot(3e-6, 4e-9 * static_cast<double>(plan->cameras[film].places[i]));
      };
      EXPECT_NEAR(plan->cameras[c].sigma_s[i], c == 0 ? 0 : std::hypot(own(c), own(0)), 1e-12);
    }
  }
  EXPECT_EQ(plan->cameras[0].places.front(), 25);
  EXPECT_EQ(plan->cameras[1].places.front(), 30);
  EXPECT_EQ(plan->cameras[2].places.front(), 0);
  EXPECT_EQ(plan->instants.size(), 60U);
}

TEST(ImportPlan, TakesNoErrorForTheCamerasThatTheyShare) {
  std::vector films{film_of("a", 0, 0.04, 100), film_of("b", 0.01, 0.04, 100)};
  for (TimedFilm& film : films) {
    film.times.start_by_row_time = Seconds(3e-6);
    film.times.period_by_row_time = Seconds(4e-9);
  }
  const auto alike = plan_frames(films, 0, {});
  EXPECT_NEAR(alike->cameras[1].sigma_s[50], 0, 1e-12);
  films[1].times.start_by_row_time = Seconds(-3e-6);
  films[1].times.period_by_row_time = Seconds(-4e-9);
  const auto against = plan_frames(films, 0, {});
  EXPECT_NEAR(against->cameras[1].sigma_s[50], 2 * (3e-6 + 50 * 4e-9), 1e-12);
}

TEST(ImportPlan, TakesTheLongestPartInWhichNoFilmShowsTheStrobe) {
  std::vector films{film_of("a", 0, 0.04, 1000), film_of("b", 0.4, 0.04, 1000)};
  films[0].lit = {{0, 300}};
  films[1].lit = {{0, 295}, {900, 950}};  // to the instants 305, and from 910
  const auto plan = plan_frames(films, 0, {});
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(plan->cameras[0].places.front(), 307);
  EXPECT_EQ(plan->cameras[0].places.back(), 907);
}

TEST(ImportPlan, LeavesInstantsOutWhoseFrameACameraLost) {
  std::vector films{film_of("a", 0, 0.04, 50), film_of("b", 0, 0.04, 48)};
  films[1].times.drops = {{9, 10, 2}};
  EXPECT_EQ(films[1].times.place_of(9), 9);
  EXPECT_EQ(films[1].times.place_of(10), std::nullopt);
  EXPECT_EQ(films[1].times.place_of(12), 10);
  EXPECT_EQ(films[1].times.count_of(10), 12);
  const auto plan = plan_frames(films, 0, {});
  ASSERT_TRUE(plan.ok());
  EXPECT_EQ(plan->left_out, 2);
  EXPECT_EQ(plan->instants.size(), 48U);
  EXPECT_EQ(plan->instants[10], 12);
  EXPECT_EQ(plan->cameras[1].places[10], 10);
}

TEST(ImportPlan, NamesTheFilmThatWasFilmedAtAnotherTime) {
  const std::vector films{film_of("a", 0, 0.04, 50), film_of("b", 0, 0.04, 50), film_of("c", 100, 0.04, 50)};
  const auto plan = plan_frames(films, 0, {});
  ASSERT_FALSE(plan.ok());
  EXPECT_THAT(plan.error().message(), HasSubstr("c.mp4"));
  const auto asked =
      plan_frames(std::vector{film_of("a", 0, 0.04, 50), film_of("b", 0, 0.04, 30)}, 0, {PlaceRange{10, 40}});
  ASSERT_FALSE(asked.ok());
  EXPECT_THAT(asked.error().message(), testing::AllOf(HasSubstr("b.mp4"), HasSubstr("doesn't reach")));
}

TEST(ImportStrobe, AFilmThatIsDarkShowsNone) {
  FilmToSearch film{200, Hertz(24), {0, 24, 48, 72, 96, 120, 144, 168, 192}, {}};
  const auto parts = find_strobe(film, [](std::int64_t) -> Result<Image> {
    return Image({.size = {64, 48}});
  });
  ASSERT_TRUE(parts.ok());
  EXPECT_TRUE(parts->lit.empty());
  EXPECT_LE(parts->looked_at, 9);
}

}  // namespace
}  // namespace emberlock::films
