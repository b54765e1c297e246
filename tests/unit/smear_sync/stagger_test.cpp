// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/stagger.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "smear_sync/align/align_words.h"

namespace emberlock::smear {
namespace {

using testing::HasSubstr;

const Seconds kPeriod(1 / 24.0);

std::vector<AlignCamera> staggered_rig(std::size_t n) {
  const std::vector<Seconds> offsets = staggered_offsets(n, kPeriod);
  std::vector<AlignCamera> cameras;
  for (std::size_t i = 0; i < n; ++i)
    cameras.push_back(
        {.id = "cam" + std::to_string(i), .model = "ccd", .expected_delay = {}, .offset = offsets[i]});
  return cameras;
}

AlignOptions stagger_options(AlignPolicy policy) {
  return {.policy = policy, .tolerance = {milliseconds(0.5)}, .period = kPeriod, .strobe_step = Seconds(0)};
}

/// Cameras that read later than `common` by these times.
AlignRound reading_late(Seconds common, const std::vector<Seconds>& late) {
  AlignRound round;
  for (const Seconds by : late) {
    CameraView view;
    view.phase = {PhaseState::known, wrap_positive(common - by, kPeriod), microseconds(15), {}};
    view.stamp = TimePoint{};
    round.cameras.push_back(view);
  }
  return round;
}

TEST(Stagger, InstantsLieEvenlyOnTheCircle) {
  for (std::size_t n = 1; n <= 64; ++n) {
    std::vector<Seconds> offsets = staggered_offsets(n, kPeriod);
    std::sort(offsets.begin(), offsets.end());
    for (std::size_t k = 0; k < n; ++k)
      EXPECT_NEAR(offsets[k].value(), kPeriod.value() * static_cast<double>(k) / static_cast<double>(n),
                  1e-15);
  }
}

TEST(Stagger, NeighboursInARowAreFarApartInTime) {
  for (std::size_t n = 5; n <= 64; ++n) {
    const std::vector<Seconds> offsets = staggered_offsets(n, kPeriod);
    const double one = 1.0 / static_cast<double>(n);
    for (std::size_t k = 1; k < n; ++k)
      EXPECT_GE(std::abs(wrap_symmetric(offsets[k] - offsets[k - 1], kPeriod) / kPeriod), 0.38 - one)
          << n << " cameras, camera " << k;
  }
}

TEST(Stagger, EveryCameraAtItsOwnInstantIsAligned) {
  const std::vector<AlignCamera> cameras = staggered_rig(11);
  for (const AlignPolicy policy : {AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed}) {
    const AlignRound round = reading_late(milliseconds(7), staggered_offsets(11, kPeriod));
    const AlignDecision decision = align_step({}, round, cameras, stagger_options(policy)).decision;
    EXPECT_EQ(decision.verdict, AlignVerdict::aligned);
    EXPECT_NEAR(decision.worst_pair->value(), 0, 1e-12);
    for (const CameraDecision& camera : decision.cameras) EXPECT_NEAR(camera.error->value(), 0, 1e-12);
    EXPECT_THAT(words(decision, round, cameras, stagger_options(policy)).reason,
                HasSubstr("within tolerance of its own instant"));
  }
}

TEST(Stagger, CamerasAtOneInstantAreNot) {
  const std::vector<AlignCamera> cameras = staggered_rig(6);
  const AlignRound round = reading_late(milliseconds(7), std::vector<Seconds>(6));
  const AlignOptions options = stagger_options(AlignPolicy::fixed_reference);
  const AlignDecision decision = align_step({}, round, cameras, options).decision;
  EXPECT_EQ(decision.verdict, AlignVerdict::go_on);
  for (std::size_t i = 1; i < 6; ++i) {
    // It reads early by its offset, and goes to its instant the shorter way round.
    EXPECT_NEAR(decision.cameras[i].error->value(), wrap_symmetric(cameras[i].offset, kPeriod).value(),
                1e-12);
    EXPECT_TRUE(decision.cameras[i].reset);
    EXPECT_THAT(words(decision, round, cameras, options).cameras[i], HasSubstr("its own instant"));
  }
}

TEST(Stagger, ATimedResetAimsAtTheCamerasOwnInstant) {
  std::vector<AlignCamera> cameras = staggered_rig(4);
  for (AlignCamera& camera : cameras) camera.expected_delay = ResetDelay{milliseconds(9), milliseconds(0.1)};
  std::vector<Seconds> late = staggered_offsets(4, kPeriod);
  late[2] += milliseconds(4);
  const AlignDecision decision =
      align_step({}, reading_late(milliseconds(7), late), cameras, stagger_options(AlignPolicy::timed))
          .decision;
  ASSERT_TRUE(decision.cameras[2].moment);
  // Its stamps shall come 4 ms earlier, 9 ms after the order.
  const Seconds ordered = *decision.cameras[2].moment - TimePoint{};
  EXPECT_NEAR(wrap_symmetric(ordered - milliseconds(-4 - 9), kPeriod).value(), 0, 1e-8);
}

TEST(Stagger, OneCameraHasNoOffsetAndIsRefused) {
  EXPECT_EQ(staggered_offsets(1, kPeriod), std::vector<Seconds>{Seconds(0)});
  EXPECT_THAT(check_stagger(1, kPeriod, Seconds(0)).error().message(), HasSubstr("one camera"));
}

TEST(Stagger, AToleranceThatMixesInstantsUpIsRefused) {
  EXPECT_TRUE(check_stagger(11, kPeriod, milliseconds(1.8)).ok());
  EXPECT_THAT(check_stagger(11, kPeriod, milliseconds(1.9)).error().message(),
              HasSubstr("less than 1.894 ms"));
}

}  // namespace
}  // namespace emberlock::smear
