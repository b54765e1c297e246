// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/frame_sequence.h"

#include <cstddef>
#include <map>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "base/clock.h"
#include "recon/adjust/picture_error.h"
#include "recon/hull/hull.h"
#include "recon/synthetic/flame.h"
#include "tests/support/devices.h"
#include "tests/support/results.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(FrameSequenceTest);
ON_EACH_DEVICE(FrameSequenceTestSlow);

/// A rising flame, frame by frame at 60 Hz.
const Scene& frame(int number) {
  static std::map<int, Scene> frames;
  const auto [at, first] = frames.try_emplace(number);
  if (first) {
    PaperSceneOptions film = small_film();
    film.flame.seed = 12;
    film.time = Seconds(number / 60.0);
    at->second = paper_scene(film);
  }
  return at->second;
}

enum class Asked { known, found_out };

ReconstructOptions options(Asked effects = Asked::known) {
  ReconstructOptions options;
  options.voxels = 24;
  if (effects == Asked::known) options.effects = parse_effects("extinction=32.8").value();
  options.solve.compute = {device_here(), 2};
  return options;
}

const SteadyClock kClock;

double error_of(const Outcome& outcome) { return all_channels(*outcome.report.heldout_rmse); }

TEST_P(FrameSequenceTestSlow, FramesStartWhereTheFlameIsThoughtToBeAndAreAsGoodAsAlone) {
  FrameSequence sequence(options(Asked::found_out), kClock);
  for (int n = 0; n < 3; ++n) {
    const Scene scene = frame(n);
    const auto in_turn = value_of(sequence.next(scene));
    const auto alone = value_of(reconstruct(scene, options(Asked::found_out), kClock));
    if (n == 0) {
      EXPECT_EQ(in_turn.reconstruction.volume.emission, alone.reconstruction.volume.emission);
    }
    EXPECT_EQ(sequence.started_from() == FrameStart::darkness, n == 0) << n;
    EXPECT_EQ(in_turn.report.effects.size(), alone.report.effects.size());
    EXPECT_LT(error_of(in_turn), 1.15 * error_of(alone)) << n;
  }
}

TEST_P(FrameSequenceTest, GoesOnBehindFramesThatAreDoneToTheSameBits) {
  FrameSequence whole(options(), kClock);
  std::vector<Outcome> outcomes;
  for (int n = 0; n < 4; ++n) outcomes.push_back(whole.next(frame(n)).value());
  const auto volume = [&](std::size_t n) {
    return std::make_shared<const Volume>(outcomes[n].reconstruction.volume);
  };
  for (const std::size_t done : {std::size_t{1}, std::size_t{3}}) {
    FrameSequence rest(options(), kClock);
    ASSERT_TRUE(rest.next(frame(0)).ok());
    rest.go_on_behind(done > 1 ? volume(done - 2) : nullptr, volume(done - 1));
    const auto next = value_of(rest.next(frame(static_cast<int>(done))));
    EXPECT_EQ(next.reconstruction.volume.emission, outcomes[done].reconstruction.volume.emission);
    EXPECT_EQ(next.reconstruction.volume.extinction, outcomes[done].reconstruction.volume.extinction);
    EXPECT_EQ(next.report.iterations, outcomes[done].report.iterations);
  }
}

TEST_P(FrameSequenceTest, ALightThatDoublesIsDecidedAnewAsIfAlone) {
  FrameSequence sequence(options(), kClock);
  ASSERT_TRUE(sequence.next(frame(0)).ok());
  EXPECT_TRUE(sequence.decided());
  const auto brighter = [](const Scene& scene, float by) {
    Scene bright = scene;
    for (View& view : bright.views) {
      RadianceImage image = *view.image;
      for (float& v : image.rgb) v *= by;
      view.image = share(std::move(image));
    }
    return bright;
  };
  ASSERT_TRUE(sequence.next(brighter(frame(1), 1.5F)).ok());
  EXPECT_FALSE(sequence.decided());
  ASSERT_TRUE(sequence.next(brighter(frame(1), 3)).ok());  // what came before it held
  EXPECT_FALSE(sequence.decided());
  const Scene next = brighter(frame(2), 3);
  const auto anew = value_of(sequence.next(next));
  EXPECT_TRUE(sequence.decided());
  EXPECT_EQ(sequence.started_from(), FrameStart::darkness);
  EXPECT_EQ(anew.reconstruction.volume.emission,
            reconstruct(next, options(), kClock)->reconstruction.volume.emission);
}

TEST_P(FrameSequenceTest, AFrameThatFailsIsLeftOutAndTheNextStartsFromBeforeIt) {
  FrameSequence sequence(options(), kClock);
  ASSERT_TRUE(sequence.next(frame(0)).ok());
  Scene black = frame(1);
  for (View& view : black.views) view.image = share(RadianceImage(view.image->size));
  EXPECT_FALSE(sequence.next(black).ok());
  ASSERT_TRUE(sequence.next(frame(2)).ok());
  EXPECT_EQ(sequence.started_from(), FrameStart::before);
}

TEST_P(FrameSequenceTest, ASceneWithABoxOfItsOwnStartsInDarkness) {
  FrameSequence sequence(options(), kClock);
  ASSERT_TRUE(sequence.next(frame(0)).ok());
  Scene moved = frame(1);
  moved.box.center.z() += 0.01;
  ASSERT_TRUE(sequence.next(moved).ok());
  EXPECT_EQ(sequence.started_from(), FrameStart::darkness);
}

TEST_P(FrameSequenceTest, AStartThatShowsThePicturesWorseThanNoLightIsNotTaken) {
  const Scene later = frame(1);
  // A start a thousand times too bright shows the pictures worse than no light at all.
  FrameSequence fooled(options(), kClock);
  const Outcome first = fooled.next(frame(0)).value();
  Volume glaring = first.reconstruction.volume;
  for (float& v : glaring.emission) v *= 1000;
  fooled.go_on_behind(nullptr, std::make_shared<const Volume>(glaring));
  const auto outcome = value_of(fooled.next(later));
  EXPECT_EQ(fooled.started_from(), FrameStart::darkness);
  const auto alone = reconstruct(later, options(), kClock);
  EXPECT_LT(error_of(outcome), 1.1 * error_of(*alone));
}

TEST(FrameSequenceOptions, AStartOfAnotherGridIsRefused) {
  const Scene scene = frame(0);
  SolveOptions solve_options;
  solve_options.compute = {Device::cpu, 1};
  const Grid grid = grid_over(scene.box, 24);
  const Grid other = grid_over(scene.box, 20);
  solve_options.starts = {
      std::make_shared<const Volume>(Volume{other, std::vector<float>(3 * other.size()), {}})};
  EXPECT_EQ(solve(scene, grid, {}, solve_options).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::recon
