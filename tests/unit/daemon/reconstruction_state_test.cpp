// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <csignal>
#include <limits>
#include <string>
#include <utility>

#include <gmock/gmock.h>

#include "daemon/reconstruction/state.h"
#include "tests/support/child_script.h"

namespace emberlock::daemon {
namespace {
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

ReconstructionState begun(const std::string& device = "cuda") {
  v1::ReconstructionStatus status;
  status.set_id("candle 1");
  status.set_session("candle");
  status.set_device(device);
  return ReconstructionState(status);
}

v1::ChildMessage at_work(double fraction, const std::string& doing) {
  v1::ChildMessage message;
  message.mutable_progress()->set_fraction(fraction);
  message.mutable_progress()->set_doing(doing);
  return message;
}

v1::ChildMessage iteration(std::uint32_t number) {
  v1::ChildMessage message;
  message.mutable_iteration()->mutable_iteration()->set_iteration(number);
  return message;
}

v1::ChildMessage done() {
  v1::ChildMessage message;
  message.mutable_done()->set_result("/results/candle");
  message.mutable_done()->add_advice("as many iterations again");
  message.mutable_done()->add_warnings("few views");
  return message;
}

/// Of a child that ended so while it carved the hull.
std::string error_of(const ChildEnd& end, const std::string& device = "cuda",
                     const std::string& last_words = "") {
  ReconstructionState state = begun(device);
  state.take(at_work(0.3, "carving the hull"));
  state.end(end, last_words);
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::FAILED);
  return state.status().error();
}

TEST(ReconstructionState, IsDoneWhenTheChildSaidSoAndLeftWell) {
  ReconstructionState state = begun();
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::RUNNING);
  state.take(done());
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::RUNNING) << "it hasn't left yet";
  state.end({}, "");
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::DONE);
  EXPECT_EQ(state.status().fraction(), 1);
  EXPECT_EQ(state.status().result(), "/results/candle");
  EXPECT_THAT(state.status().advice(), ElementsAre("as many iterations again", "few views"));
}

TEST(ReconstructionState, ACancelThatCameTooLateIsNone) {
  ReconstructionState state = begun();
  state.take(done());
  state.end({.why = ChildEnd::Why::cancelled}, "");
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::DONE);
}

TEST(ReconstructionState, AFractionThatIsNoneIsPassedOver) {
  ReconstructionState state = begun();
  state.take(at_work(0.25, "a"));
  state.take(at_work(std::nan(""), "b"));
  EXPECT_EQ(state.status().fraction(), 0.25);
  EXPECT_EQ(state.status().doing(), "b");
  state.take(at_work(1e300, "c"));
  EXPECT_EQ(state.status().fraction(), 1);
}

TEST(ReconstructionState, IterationsBearItsIdAndThePictureAtTheEndIsNoFurtherOne) {
  ReconstructionState state = begun();
  EXPECT_EQ(state.take(iteration(1))->reconstruction(), "candle 1");
  state.take(iteration(2));
  EXPECT_TRUE(state.take(iteration(2)).has_value()) << "the board shows its picture";
  EXPECT_TRUE(state.take(iteration(1)).has_value()) << "or that of an earlier one, which was kept";
  EXPECT_EQ(state.status().iterations_size(), 2);
}

TEST(ReconstructionState, OfAStylizationTheStatusHasTheViewsAndPreviewsTheRest) {
  ReconstructionState state = begun();
  EXPECT_FALSE(state.status().has_stylization()) << "it can't be edited yet";
  v1::ChildMessage message = iteration(3);
  message.mutable_iteration()->mutable_stylization()->set_passes(1);
  message.mutable_iteration()->mutable_stylization()->add_views()->set_name("cam0");
  const auto preview = state.take(std::move(message));
  ASSERT_TRUE(preview);
  EXPECT_EQ(preview->stylization().passes(), 1U);
  EXPECT_EQ(preview->stylization().views_size(), 0);
  ASSERT_EQ(state.status().stylization().views_size(), 1);
  v1::ChildMessage edited;
  *edited.mutable_edited()->mutable_taken() = state.status().stylization();
  edited.mutable_edited()->mutable_taken()->set_steps(4);
  EXPECT_FALSE(state.take(std::move(edited)));
  EXPECT_EQ(state.status().stylization().steps(), 4U);
}

TEST(ReconstructionState, OfManyIterationsTheNewestAreKept) {
  ReconstructionState state = begun();
  for (std::uint32_t i = 1; i <= 1200; ++i) state.take(iteration(i));
  ASSERT_EQ(state.status().iterations_size(), ReconstructionState::kIterations);
  EXPECT_EQ(state.status().iterations().rbegin()->iteration(), 1200U);
}

TEST(ReconstructionState, AVolumeWhoseBytesAreNotItsSizeIsNotShown) {
  ReconstructionState state = begun();
  v1::ChildMessage message = iteration(1);
  v1::VolumePreview& volume = *message.mutable_iteration()->mutable_volume();
  test::fill(volume, 2, 2, 2, "12345678");
  EXPECT_TRUE(state.take(v1::ChildMessage(message))->has_volume());
  v1::VolumeLayer& layer = *volume.add_layers();
  layer.set_voxels("12345678");
  EXPECT_TRUE(state.take(v1::ChildMessage(message))->has_volume());
  layer.set_high(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(state.take(v1::ChildMessage(message))->has_volume());
  layer.set_high(2);
  layer.set_voxels("123456789");
  EXPECT_FALSE(state.take(v1::ChildMessage(message))->has_volume());
  volume.clear_layers();
  volume.set_voxels("1234567");
  EXPECT_FALSE(state.take(v1::ChildMessage(message))->has_volume());
  volume.set_nx(std::numeric_limits<std::uint32_t>::max());
  EXPECT_FALSE(state.take(std::move(message))->has_volume());
}

TEST(ReconstructionState, ACrashNamesItsSignalWhatItDidAndTheWayOut) {
  const std::string error = error_of({.signal = SIGSEGV}, "cuda", "CUDA error 700");
  EXPECT_THAT(error, HasSubstr("SIGSEGV"));
  EXPECT_THAT(error, HasSubstr("carving the hull"));
  EXPECT_THAT(error, HasSubstr("CUDA error 700"));
  EXPECT_THAT(error, HasSubstr("device cpu"));
  EXPECT_THAT(error_of({.signal = SIGSEGV}, "cpu"), Not(HasSubstr("device cpu"))) << "it is what failed";
  EXPECT_THAT(error_of({.signal = SIGKILL}), HasSubstr("memory"));
}

TEST(ReconstructionState, WhatTheChildSaidOfItsFailureIsTheError) {
  ReconstructionState state = begun();
  v1::ChildMessage message;
  message.mutable_failure()->set_message("--voxels: not enough memory. Give fewer");
  state.take(std::move(message));
  state.end({.code = 2}, "emberlock: the same");
  EXPECT_EQ(state.status().error(), "--voxels: not enough memory. Give fewer");
}

TEST(ReconstructionState, AResultThatIsNotWhatWasAskedForIsAFailureAndIsKept) {
  ReconstructionState state = begun();
  v1::ChildMessage result = done();
  result.mutable_done()->add_temperature("no voxel tells its temperature");
  state.take(std::move(result));
  v1::ChildMessage message;
  message.mutable_failure()->set_message("candle: no voxel tells its temperature");
  state.take(std::move(message));
  state.end({.code = 1}, "");
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::FAILED);
  EXPECT_EQ(state.status().error(), "candle: no voxel tells its temperature");
  EXPECT_EQ(state.status().result(), "/results/candle") << "the colours";
  EXPECT_EQ(state.status().temperature_size(), 1);
}

TEST(ReconstructionState, AnEndWithoutAResultIsAFailure) {
  EXPECT_THAT(error_of({}), HasSubstr("without a result"));
  EXPECT_THAT(error_of({.code = 127}), HasSubstr("127"));
  EXPECT_THAT(error_of({.why = ChildEnd::Why::silent, .words = "it told nothing for 600 s"}),
              HasSubstr("600 s"));
}

SequenceState sequence(const std::vector<std::uint64_t>& frames) {
  v1::ReconstructionStatus status;
  status.set_id("candle 1");
  status.set_session("candle");
  return {status, frames, "/results/candle"};
}

/// Its next frame, reconstructed.
void succeed(SequenceState& state, double error = 2) {
  ASSERT_TRUE(state.next());
  v1::ChildMessage kept = iteration(9);
  kept.mutable_iteration()->mutable_iteration()->set_input_rmse(error);
  state.take(std::move(kept));
  v1::ChildMessage result = done();
  result.mutable_done()->add_temperature("1700 K on average");
  result.mutable_done()->add_temperature("read from a grey glow");
  state.take(std::move(result));
  state.end({}, "");
}
void fail(SequenceState& state, const ChildEnd& end = {.code = 2}) {
  ASSERT_TRUE(state.next());
  state.end(end, "no light");
}

TEST(SequenceState, WithoutFramesItIsTheReconstructionOfOne) {
  SequenceState state = sequence({});
  ASSERT_TRUE(state.next());
  EXPECT_FALSE(state.frame());
  EXPECT_FALSE(state.take(iteration(1))->has_frame());
  state.take(at_work(0.5, "carving the hull"));
  EXPECT_EQ(state.fraction(), 0.5);
  EXPECT_EQ(state.doing(), "carving the hull");
  state.take(done());
  state.end({}, "");
  EXPECT_FALSE(state.next());
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::DONE);
  EXPECT_EQ(state.status().result(), "/results/candle");
  EXPECT_EQ(state.status().frames_size(), 0);
}

TEST(SequenceState, TellsTheFrameAtHandAndHowFarTheWholeIs) {
  SequenceState state = sequence({10, 12, 14, 16});
  EXPECT_EQ(state.doing(), "starting");
  succeed(state, 3.5);
  ASSERT_TRUE(state.next());
  EXPECT_EQ(state.take(iteration(1))->frame(), 12U);
  state.take(at_work(0.5, "iterating"));
  const v1::ReconstructionStatus status = state.status();
  EXPECT_EQ(status.state(), v1::ReconstructionStatus::RUNNING);
  EXPECT_EQ(status.doing(), "frame 12 (2 of 4): iterating");
  EXPECT_EQ(status.fraction(), 1.5 / 4);
  EXPECT_EQ(status.iterations_size(), 1) << "of the frame at hand";
  EXPECT_EQ(status.result(), "/results/candle");
  ASSERT_EQ(status.frames_size(), 4);
  EXPECT_EQ(status.frames(0).state(), v1::ReconstructionStatus::DONE);
  EXPECT_EQ(status.frames(0).input_rmse(), 3.5);
  EXPECT_EQ(status.frames(0).temperature(), "1700 K on average");
  EXPECT_EQ(status.frames(1).state(), v1::ReconstructionStatus::RUNNING);
  EXPECT_EQ(status.frames(2).state(), v1::ReconstructionStatus::STATE_UNSPECIFIED);
  EXPECT_EQ(status.frames(3).frame(), 16U);
}

TEST(SequenceState, AllDoneIsDone) {
  SequenceState state = sequence({1, 2});
  succeed(state);
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::RUNNING) << "between two children";
  succeed(state);
  EXPECT_FALSE(state.next());
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::DONE);
  EXPECT_EQ(state.status().fraction(), 1);
  EXPECT_EQ(state.status().doing(), "done");
}

TEST(SequenceState, AFrameThatFailsIsMarkedAndTheOthersGoOn) {
  SequenceState state = sequence({1, 2, 3});
  succeed(state);
  fail(state);
  succeed(state);
  const v1::ReconstructionStatus status = state.status();
  EXPECT_EQ(status.state(), v1::ReconstructionStatus::FAILED);
  EXPECT_EQ(status.doing(), "1 of 3 frames failed");
  EXPECT_EQ(status.frames(1).state(), v1::ReconstructionStatus::FAILED);
  EXPECT_THAT(status.frames(1).error(), HasSubstr("exit code 2"));
  EXPECT_THAT(status.error(),
              HasSubstr("1 of 3 frames failed: 2. The others are in /results/candle. Frame 2: "));
  EXPECT_THAT(status.error(), HasSubstr("no light"));
  EXPECT_EQ(status.fraction(), 1);
}

TEST(SequenceState, WhereTheFirstThreeFailTheOthersAreNotTried) {
  SequenceState state = sequence({0, 1, 2, 3, 4});
  for (int i = 0; i < 3; ++i) fail(state);
  EXPECT_FALSE(state.next());
  EXPECT_EQ(state.status().state(), v1::ReconstructionStatus::FAILED);
  EXPECT_THAT(state.status().error(), HasSubstr("3 of 5 frames failed: 0, 1, 2. The other 2 were not tried"));
  EXPECT_EQ(state.status().result(), "");
}

TEST(SequenceState, LaterOnFramesMayFailInARow) {
  SequenceState state = sequence({0, 1, 2, 3, 4});
  succeed(state);
  for (int i = 0; i < 4; ++i) fail(state);
  EXPECT_FALSE(state.next());
  EXPECT_THAT(state.status().error(), HasSubstr("4 of 5 frames failed: 1, 2, 3, 4"));
}

TEST(SequenceState, AChildThatCannotBeStartedEndsIt) {
  SequenceState state = sequence({0, 1, 2});
  succeed(state);
  fail(state, {.why = ChildEnd::Why::not_started, .words = "/usr/bin/emberlock: isn't there"});
  EXPECT_FALSE(state.next());
  EXPECT_THAT(state.status().error(), HasSubstr("/usr/bin/emberlock: isn't there"));
}

TEST(SequenceState, CancelledItKeepsWhatIsDone) {
  SequenceState state = sequence({0, 1, 2});
  succeed(state);
  fail(state, {.why = ChildEnd::Why::cancelled});
  EXPECT_FALSE(state.next());
  const v1::ReconstructionStatus status = state.status();
  EXPECT_EQ(status.state(), v1::ReconstructionStatus::CANCELLED);
  EXPECT_EQ(status.doing(), "cancelled, with 1 of 3 frames done");
  EXPECT_EQ(status.frames(1).state(), v1::ReconstructionStatus::CANCELLED);
  EXPECT_EQ(status.result(), "/results/candle");
  SequenceState waiting = sequence({0, 1});
  waiting.end({.why = ChildEnd::Why::cancelled}, "");
  EXPECT_EQ(waiting.status().state(), v1::ReconstructionStatus::CANCELLED) << "before it began";
}

}  // namespace
}  // namespace emberlock::daemon
