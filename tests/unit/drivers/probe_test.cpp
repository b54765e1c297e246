// SPDX-License-Identifier: Apache-2.0
#include "drivers/probe.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/virtual_cameras.h"

namespace emberlock::drivers {
namespace {

using ::testing::HasSubstr;

const ProbeFinding& finding(const ProbeVerdict& verdict, std::string_view what) {
  for (const ProbeFinding& f : verdict.findings) {
    if (f.what == what) return f;
  }
  ADD_FAILURE() << "nothing is said of " << what;
  return verdict.findings.front();
}

/// A hundred frames at 25/s; those whose numbers `lost` names never came.
ProbeFilm even_film(const std::vector<std::uint64_t>& lost = {}) {
  ProbeFilm film;
  film.info.id = "c7";
  film.info.frame_rate = Hertz(25);
  film.info.layout = {.size = {640, 480}};
  for (std::uint64_t id = 0; id < 100; ++id) {
    if (std::find(lost.begin(), lost.end(), id) != lost.end()) continue;
    FrameStamp stamp;
    stamp.frame_id = 1000 + id;
    stamp.monotonic_time = TimePoint{5'000'000'000} + milliseconds(40) * static_cast<double>(id);
    film.stamps.push_back(stamp);
    ++film.counts.delivered;
  }
  film.counts.transport = lost.size();
  return film;
}

TEST(ProbeThreads, AnEvenCameraIsGoodAndItsRateExact) {
  const ProbeVerdict verdict = assess(even_film(), {});
  EXPECT_EQ(verdict.fitness, Fitness::good);
  EXPECT_NEAR(verdict.rate.value(), 25, 1e-9);
  EXPECT_NEAR(*verdict.megabits, 640 * 480 * 8e-6 * 25, 1e-6);
  EXPECT_THAT(finding(verdict, "bandwidth").measured, HasSubstr("isn't known"));
}

TEST(ProbeThreads, LostFramesAreSaidByCauseAndDoNotBendTheRate) {
  const ProbeVerdict few = assess(even_film({50}), {});
  EXPECT_NEAR(few.rate.value(), 25, 1e-9);
  EXPECT_EQ(few.fitness, Fitness::poor);
  EXPECT_THAT(finding(few, "frames").measured, HasSubstr("1 lost on the way"));
  EXPECT_THAT(finding(few, "frames").remedy, HasSubstr("cable"));
  EXPECT_EQ(assess(even_film({10, 11, 12, 13}), {}).fitness, Fitness::unfit);
}

TEST(ProbeThreads, ACameraThatKeepsAnotherRateThanItSaysIsPoor) {
  ProbeFilm film = even_film();
  film.info.frame_rate = Hertz(30);
  const ProbeVerdict verdict = assess(film, {});
  EXPECT_EQ(finding(verdict, "rate").fitness, Fitness::poor);
  EXPECT_THAT(finding(verdict, "rate").measured, HasSubstr("25.0000 frames/s"));
}

TEST(ProbeThreads, UnevenArrivalCountsWhereFramesCouldBeMistaken) {
  ProbeFilm film = even_film();
  for (std::size_t i = 0; i < film.stamps.size(); i += 2) {
    film.stamps[i].monotonic_time = film.stamps[i].monotonic_time + milliseconds(3);
  }
  EXPECT_NEAR(in_milliseconds(assess(film, {}).arrival_jitter), 1.5, .01);
  EXPECT_EQ(assess(film, {}).fitness, Fitness::good);
  film.stamps[40].monotonic_time = film.stamps[40].monotonic_time + milliseconds(15);
  EXPECT_EQ(finding(assess(film, {}), "arrival").fitness, Fitness::poor);
}

TEST(ProbeThreads, TheCamerasOwnClockIsBelievedWhereItSaysWhatItMarks) {
  ProbeFilm film = even_film();
  film.info.device_time_of = DeviceTimeOf::exposure_start;
  for (FrameStamp& stamp : film.stamps) {
    stamp.device_time = TimePoint{} + milliseconds(39.999) * static_cast<double>(stamp.frame_id);
  }
  EXPECT_NEAR(assess(film, {}).rate.value(), 1000 / 39.999, 1e-6);
}

TEST(ProbeThreads, AFullLinkIsPoor) {
  EXPECT_EQ(finding(assess(even_film(), 480.), "bandwidth").fitness, Fitness::good);
  EXPECT_THAT(finding(assess(even_film(), 480.), "bandwidth").measured, HasSubstr("87 % left"));
  EXPECT_EQ(finding(assess(even_film(), 65.), "bandwidth").fitness, Fitness::poor);
}

TEST(ProbeThreads, ACameraThatFailsMeanwhileIsUnfitAndItsErrorIsSaid) {
  ProbeFilm film = even_film();
  film.failed = Error{ErrorKind::device, "it was unplugged", "camera c7", "plug it in"};
  EXPECT_EQ(assess(film, {}).fitness, Fitness::unfit);
  EXPECT_THAT(finding(assess(film, {}), "ended").measured, HasSubstr("unplugged"));
  EXPECT_EQ(assess({}, {}).fitness, Fitness::unfit);
}

TEST(ProbeThreads, AVirtualCameraShowsItsTrueRateAndResetDelay) {
  VirtualCameraOptions camera = testing_support::small_camera();
  camera.timing.frame_period = Seconds(1 / (24 * (1 + 150e-6)));
  camera.reset_latency = milliseconds(180);
  camera.reset_jitter = milliseconds(2);
  const auto rig = testing_support::small_rig({camera}, {});
  const ProbeFilm film =
      film_probe(rig->camera(0), {.film = Seconds(20), .resets = 100}, rig->clock(), {}).value();
  const ProbeVerdict verdict = assess(film, {});
  EXPECT_EQ(verdict.fitness, Fitness::good);
  EXPECT_NEAR(verdict.rate.value(), 24 * (1 + 150e-6), 1e-6);
  EXPECT_EQ(film.counts.lost(), 0);
  // The image that the register still held is kept back; the next one takes a period and its shifting.
  const Seconds first =
      camera.reset_latency + camera.timing.frame_period + Rows(120) * camera.timing.row_time;
  ASSERT_TRUE(verdict.reset);
  EXPECT_NEAR(in_milliseconds(verdict.reset->mean), in_milliseconds(first), .6);
  EXPECT_NEAR(in_milliseconds(verdict.reset->sigma), 2, .5);
}

TEST(ProbeThreads, AResetThatIsRefusedEndsTheFilmAndIsSaid) {
  const auto rig = testing_support::small_rig({testing_support::small_camera()}, {});
  rig->set_reset(ShutterReset::none);
  const ProbeFilm film =
      film_probe(rig->camera(0), {.film = Seconds(1), .resets = 2}, rig->clock(), {}).value();
  ASSERT_TRUE(film.failed);
  EXPECT_THAT(film.failed->message(), HasSubstr("can't be reset"));
}

}  // namespace
}  // namespace emberlock::drivers
