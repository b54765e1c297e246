// SPDX-License-Identifier: Apache-2.0
// The verbs that ask emberlockd to align, and to record.
#include <csignal>
#include <cstdint>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "tests/support/daemon_verbs.h"

namespace emberlock::cli {
namespace {
using nlohmann::json;
using test::status_in;
using testing::ElementsAre;
using testing::HasSubstr;

using DaemonRecordingVerbs = test::VerbsOfADaemon;

TEST_F(DaemonRecordingVerbs, AlignShowsItsRoundsUntilItIsLocked) {
  api_.board().show(status_in(v1::LOCKED, v1::GREEN, "of yesterday"));
  v1::DaemonStatus round = status_in(v1::ALIGNING);
  round.mutable_alignment()->set_round(1);
  round.mutable_alignment()->set_reason("cam3 is to be reset");
  round.set_next_step("Reset cam3.");
  v1::DaemonStatus second = round;
  second.mutable_alignment()->set_round(2);
  v1::DaemonStatus locked = second;
  locked.set_phase(v1::LOCKED);
  locked.set_reason("All within 40 rows.");
  api_.on_align = [&](const v1::AlignRequest&) {
    show_in_turn(round, {{"round 1", second}, {"round 2", locked}});
    return Status();
  };
  const test::VerbRun result = run(add_align, {"align", "--tolerance", "50rows"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("round 1: cam3 is to be reset"));
  EXPECT_THAT(result.out, HasSubstr("next: Reset cam3."));
  EXPECT_THAT(result.out, HasSubstr("round 2"));
  EXPECT_THAT(result.out, HasSubstr("locked: All within 40 rows."));
  EXPECT_THAT(api_.calls(), ElementsAre("align tolerance: \"50rows\""));
}

TEST_F(DaemonRecordingVerbs, AnAlignmentThatIsRefusedSaysWhatCouldBeMet) {
  v1::DaemonStatus refused = status_in(v1::IDLE, v1::AMBER, "would take 900 resets");
  refused.mutable_alignment()->set_verdict(v1::AlignmentStatus::REFUSED);
  v1::AlignmentOffer& offer = *refused.mutable_alignment()->add_offers();
  offer.set_policy("timed");
  offer.set_tolerance_rows(200);
  offer.set_tolerance_s(10.8e-3);
  api_.on_align = [&](const v1::AlignRequest&) {
    show_in_turn(status_in(v1::ALIGNING), {{"round 0", refused}});
    return Status();
  };
  const test::VerbRun result = run(add_align, {"align"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("900 resets"));
  EXPECT_THAT(result.out, HasSubstr("10.80 ms (200 rows) with policy timed"));
}

TEST_F(DaemonRecordingVerbs, AlignStopLetsTheLockGo) {
  EXPECT_EQ(run(add_align, {"align", "--stop"}).exit_code, 0);
  EXPECT_THAT(api_.calls(), ElementsAre("stop_sync"));
}

v1::DaemonStatus recording(v1::RecordingStatus::State state, std::uint64_t frames) {
  v1::DaemonStatus status = status_in(v1::CAPTURING);
  status.mutable_recording()->set_session("candle");
  status.mutable_recording()->set_state(state);
  status.mutable_recording()->set_frames(frames);
  if (state != v1::RecordingStatus::RECORDING) status.mutable_recording()->set_verdict("The books agree.");
  return status;
}

TEST_F(DaemonRecordingVerbs, RecordFollowsToTheVerdict) {
  api_.on_record = [&](const v1::RecordRequest&) {
    show_in_turn(recording(v1::RecordingStatus::RECORDING, 24),
                 {{"24 frames", recording(v1::RecordingStatus::COMPLETE, 48)}});
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::RECORDING, 0).recording());
  };
  const test::VerbRun result = run(add_record, {"record", "candle", "--seconds", "2", "--reconstruct"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("24 frames"));
  EXPECT_THAT(result.out, HasSubstr("48 frames recorded, none lost"));
  EXPECT_THAT(result.out, HasSubstr("The books agree."));
  EXPECT_THAT(api_.calls().front(), HasSubstr("name: \"candle\""));
  EXPECT_THAT(api_.calls().front(), HasSubstr("seconds: 2"));
  EXPECT_THAT(api_.calls().front(), HasSubstr("reconstruct: true"));
}

TEST_F(DaemonRecordingVerbs, LiveVolumesAreAskedForWithTheRecordingAndToldBesideIt) {
  v1::RecordRequest asked;
  api_.on_record = [&](const v1::RecordRequest& request) {
    asked = request;
    v1::DaemonStatus running = recording(v1::RecordingStatus::RECORDING, 240);
    running.set_now_ns(5'000'000'000);
    v1::LiveStatus& live = *running.mutable_live();
    live.set_session("candle");
    live.set_state(v1::LiveStatus::RUNNING);
    live.set_frame(120);
    live.set_filmed_ns(4'100'000'000);
    live.set_takes_s(0.41);
    live.set_voxels(48);
    live.set_volumes(11);
    live.set_skipped(109);
    live.set_device("cuda");
    show_in_turn(running, {{"240 frames", recording(v1::RecordingStatus::COMPLETE, 480)}});
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::RECORDING, 0).recording());
  };
  const test::VerbRun result =
      run(add_record, {"record", "candle", "--live", "--every", "12", "--voxels", "48"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(asked.live().every(), 12U);
  EXPECT_EQ(asked.live().voxels(), 48U);
  EXPECT_THAT(result.out, HasSubstr("; live: frame 120, 0.9 s ago, 48 voxels, 0.41 s a volume, 11 shown, 109 "
                                    "skipped, on cuda"));
  EXPECT_NE(run(add_record, {"record", "candle", "--every", "12"}).exit_code, 0) << "without --live";
}

TEST(LiveWords, SayWhatIsShownAndWhyNothingIs) {
  v1::LiveStatus live;
  live.set_state(v1::LiveStatus::STARTING);
  EXPECT_EQ(live_line(live, 0), "starting");
  live.set_state(v1::LiveStatus::ENDED);
  live.set_frame(7);
  live.set_delay_s(0.5);
  live.set_voxels(32);
  live.set_takes_s(0.25);
  EXPECT_EQ(live_line(live, 0), "ended, frame 7, 0.5 s after it was filmed, 32 voxels, 0.25 s a volume");
  live.set_state(v1::LiveStatus::STOPPED);
  live.set_reason("Stopped.");
  EXPECT_THAT(live_line(live, 0), testing::EndsWith(". Stopped."));
  v1::IterationPreview preview;
  preview.set_reconstruction("take 1 live");
  preview.set_frame(120);
  preview.set_live_delay_s(0.9);
  preview.mutable_iteration()->set_seconds(0.41);
  EXPECT_EQ(live_preview_line(preview), "take 1 live: frame 120, 0.9 s after it was filmed, 0.41 s a volume");
}

TEST_F(DaemonRecordingVerbs, ARecordingWhoseCountsDoNotAgreeIsAFailure) {
  api_.on_record = [&](const v1::RecordRequest&) {
    v1::DaemonStatus failed = recording(v1::RecordingStatus::FAILED, 47);
    failed.mutable_recording()->mutable_lost()->set_queue(1);
    api_.board().show(failed);
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::RECORDING, 0).recording());
  };
  const test::VerbRun result = run(add_record, {"record", "candle", "--json"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(
      json::parse(result.out.substr(result.out.rfind('\n', result.out.size() - 2) + 1))["lost"]["queue"],
      "1");
}

TEST_F(DaemonRecordingVerbs, CtrlCEndsTheRecordingAndWaitsUntilItIsFinished) {
  api_.on_record = [&](const v1::RecordRequest&) {
    api_.board().show(recording(v1::RecordingStatus::RECORDING, 24));
    in_turn({{[] { return test::has_printed("24 frames"); }, [] { ::raise(SIGINT); }}});
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::RECORDING, 0).recording());
  };
  api_.on_stop_recording = [&] {
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::COMPLETE, 30).recording());
  };
  const test::VerbRun result = run(add_record, {"record", "candle"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("30 frames"));
  EXPECT_EQ(api_.calls().back(), "stop_recording");
}

TEST_F(DaemonRecordingVerbs, ATakeThatIsLongerThanTheLockRenewsItFirstAndSaysSo) {
  const auto locked = [](double left, v1::Phase phase = v1::LOCKED) {
    v1::DaemonStatus status = status_in(phase);
    status.mutable_alignment()->set_verdict(v1::AlignmentStatus::ALIGNED);
    status.mutable_alignment()->set_time_left_s(left);
    if (left < 20) status.mutable_alignment()->set_renewed_left_s(95);
    return status;
  };
  api_.board().show(locked(8.6));
  api_.on_align = [&](const v1::AlignRequest&) {
    api_.board().show(locked(8.5, v1::ALIGNING));
    in_turn({{[&] { return server_->watchers() == 1; }, [&] { api_.board().show(locked(95)); }}});
    return Status();
  };
  api_.on_record = [&](const v1::RecordRequest&) {
    api_.board().show(recording(v1::RecordingStatus::COMPLETE, 48));
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::RECORDING, 0).recording());
  };
  const test::VerbRun result = run(add_record, {"record", "candle", "--seconds", "20"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(api_.calls(),
              ElementsAre("align renew: true hold_s: 20", HasSubstr("record name: \"candle\"")));
  EXPECT_THAT(result.err,
              HasSubstr("The lock surely holds for 8.6 s, and 20 s are asked for: renewing it first."));
  EXPECT_THAT(result.err, HasSubstr("Renewed: a take may be 95 s long."));
}

TEST_F(DaemonRecordingVerbs, NoLockIsRenewedForATakeThatItHoldsForOrThatIsAskedForAsItIs) {
  v1::DaemonStatus status = status_in(v1::LOCKED);
  status.mutable_alignment()->set_verdict(v1::AlignmentStatus::ALIGNED);
  status.mutable_alignment()->set_time_left_s(30);
  api_.board().show(status);
  api_.on_record = [&](const v1::RecordRequest&) {
    api_.board().show(recording(v1::RecordingStatus::COMPLETE, 48));
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::RECORDING, 0).recording());
  };
  for (const auto& words :
       std::vector<std::vector<std::string>>{{"record", "candle", "--seconds", "20"},
                                             {"record", "candle", "--seconds", "40"},
                                             {"record", "candle", "--seconds", "40", "--unlocked"},
                                             {"record", "candle", "--seconds", "40", "--no-renewal"}})
    EXPECT_EQ(run(add_record, words).exit_code, 0);
  for (const std::string& call : api_.calls()) EXPECT_THAT(call, HasSubstr("record"));
}

}  // namespace
}  // namespace emberlock::cli
