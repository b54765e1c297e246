// SPDX-License-Identifier: Apache-2.0
// The verbs that ask emberlockd, against a real server on a socket and a daemon without devices.
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "daemon/server/grpc_server.h"
#include "tests/support/fake_api.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

v1::DaemonStatus status_in(v1::Phase phase, v1::Light light = v1::GREEN, const std::string& reason = "") {
  v1::DaemonStatus status;
  status.set_phase(phase);
  status.set_light(light);
  status.set_reason(reason);
  status.set_rig("bench");
  return status;
}

class DaemonVerbs : public testing::Test {
 protected:
  DaemonVerbs() {
    api_.board().show(status_in(v1::IDLE));
    daemon::GrpcServerOptions options;
    options.socket = folder_ / "socket";
    options.sessions = sessions_;
    auto server = daemon::GrpcServer::start(api_, options);
    if (!server) throw std::runtime_error(server.error().message());
    server_ = std::move(*server);
  }
  ~DaemonVerbs() override {
    for (std::thread& thread : threads_) thread.join();
  }

  test::VerbRun run(void (*add)(CLI::App&), std::vector<std::string> words) const {
    words.insert(words.end(), {"--daemon", "unix:" + (folder_ / "socket").string()});
    return test::run_verb(add, std::move(words));
  }
  /// In a while, as a daemon's engine does it: each step a tenth of a second after the one before.
  void soon(std::vector<std::function<void()>> steps) {
    threads_.emplace_back([steps = std::move(steps)] {
      for (const auto& step : steps) {
        std::this_thread::sleep_for(std::chrono::milliseconds(150));
        step();
      }
    });
  }
  void show_soon(std::vector<v1::DaemonStatus> statuses) {
    std::vector<std::function<void()>> steps;
    for (v1::DaemonStatus& status : statuses)
      steps.emplace_back([this, status = std::move(status)] { api_.board().show(status); });
    soon(std::move(steps));
  }

  test::TempFolder folder_;
  test::FakeApi api_;
  std::shared_ptr<daemon::ConsoleSessions> sessions_ = std::make_shared<daemon::ConsoleSessions>();
  std::unique_ptr<daemon::GrpcServer> server_;
  std::vector<std::thread> threads_;
};

TEST(DaemonVerbsAlone, WithoutADaemonTheySayWhatToDoAndLeaveWithThree) {
  const test::TempFolder folder;
  const std::string nobody = "unix:" + (folder / "socket").string();
  for (const auto& [add, words] : std::vector<std::pair<void (*)(CLI::App&), std::vector<std::string>>>{
           {add_status, {"status"}},
           {add_watch, {"watch"}},
           {add_console, {"console"}},
           {add_align, {"align"}},
           {add_record, {"record"}},
           {add_strobe, {"strobe"}},
           {add_reconstruct, {"reconstruct", "candle"}}}) {
    std::vector<std::string> line = words;
    line.insert(line.end(), {"--daemon", nobody});
    const test::VerbRun result = test::run_verb(add, line);
    EXPECT_EQ(result.exit_code, kUnreachable) << words[0];
    EXPECT_THAT(result.err, HasSubstr("systemctl start emberlockd")) << words[0];
    EXPECT_EQ(result.out, "") << words[0];
  }
}

TEST(DaemonVerbsAlone, AnAddressThatIsNoneAndADaemonElsewhereWithoutItsTokenAreBadInput) {
  EXPECT_EQ(test::run_verb(add_status, {"status", "--daemon", "unix:" + std::string(200, 'x')}).exit_code, 2);
  const test::VerbRun result = test::run_verb(add_status, {"status", "--daemon", "lab:7410"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--token-file"));
}

TEST(DaemonVerbsAlone, WhatOnlyARigOfItsOwnKnowsIsNotAskedOfTheDaemon) {
  EXPECT_THAT(test::run_verb(add_align, {"align", "--seed", "3"}).err, HasSubstr("--seed"));
  EXPECT_THAT(test::run_verb(add_reconstruct, {"reconstruct", "candle", "--daemon", "--out", "x"}).err,
              HasSubstr("--out"));
  EXPECT_EQ(test::run_verb(add_reconstruct, {"reconstruct", "candle"}).exit_code, 2) << "without --out";
}

TEST_F(DaemonVerbs, StatusIsAScreenForPeopleAndJsonForPrograms) {
  v1::DaemonStatus status = status_in(v1::LOCKED, v1::AMBER, "cam1 drifts");
  status.set_next_step("Look at cam1.");
  v1::Fault& fault = *status.add_faults();
  fault.set_kind(v1::Fault::CAMERA_LOST);
  fault.set_light(v1::AMBER);
  fault.set_subject("cam2");
  fault.set_what("its cable came off");
  fault.set_remedy("Plug it in.");
  v1::CameraStatus& camera = *status.add_cameras();
  camera.set_id("cam1");
  camera.set_state(v1::CameraStatus::FILMING);
  camera.set_error_rows(-3.25);
  camera.set_error_s(-175.2e-6);
  v1::AlignmentStatus& lock = *status.mutable_alignment();
  lock.set_verdict(v1::AlignmentStatus::ALIGNED);
  lock.set_tolerance_s(0.5e-3);
  lock.set_tolerance_rows(9.26);
  lock.set_time_left_s(42);
  lock.set_likely_left_s(200);
  lock.set_renewed_left_s(95);
  lock.set_leaves_first("cam1");
  v1::Job& salvage = *status.add_jobs();
  salvage.set_kind(v1::Job::SALVAGE);
  salvage.set_session("candle");
  salvage.set_state(v1::Job::RUNNING);
  salvage.set_fraction(.34);
  v1::Job& waits = *status.add_jobs();
  waits.set_kind(v1::Job::COMPRESS);
  waits.set_session("torch");
  waits.set_state(v1::Job::WAITING);
  api_.board().show(status);
  const test::VerbRun screen = run(add_status, {"status"});
  EXPECT_EQ(screen.exit_code, 0) << screen.err;
  for (const char* words :
       {"bench", "locked, amber: cam1 drifts", "Look at cam1.", "camera lost cam2", "Plug it in.", "cam1",
        "-3.2 rows (-0.175 ms)", "tolerance  0.500 ms (9.3 rows)",
        "a take may be 42 s long, most likely 3 min 20 s, then cam1 leaves tolerance; 95 s if renewed",
        "salvage of candle: 34 % done", "compression of torch: waits"}) {
    EXPECT_THAT(screen.out, HasSubstr(words));
  }
  const json printed = json::parse(run(add_status, {"status", "--json"}).out);
  EXPECT_EQ(printed["faults"][0]["remedy"], "Plug it in.");
  EXPECT_EQ(printed["next_step"], "Look at cam1.") << "named as in the .proto";
}

TEST_F(DaemonVerbs, JobsAreListedWithTheNumbersThatCancelThem) {
  EXPECT_EQ(run(add_jobs, {"jobs"}).out, "No jobs.\n");
  api_.on_job = [](const Observer& observer) -> daemon::JobResult {
    while (observer(.5, "reads")) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return Error{ErrorKind::refused, "ended early, as asked"};
  };
  v1::SessionRequest candle;
  candle.set_session("candle");
  const auto job = api_.verify_session(candle);
  ASSERT_TRUE(job.ok());
  v1::DaemonStatus status = status_in(v1::IDLE, v1::GREEN, "");
  v1::Job& shown = *status.add_jobs();
  shown = (*job)->state();
  shown.set_state(v1::Job::RUNNING);
  shown.set_fraction(.5);
  shown.set_silent_s(41);
  api_.board().show(status);
  EXPECT_EQ(run(add_jobs, {"jobs"}).out, "   1  verification of candle: 50 % done, nothing new for 41 s\n");
  EXPECT_EQ(json::parse(run(add_jobs, {"jobs", "--json"}).out)["jobs"][0]["session"], "candle");
  const test::VerbRun none = run(add_jobs, {"jobs", "cancel", "7"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.err, HasSubstr("job 7: there is none"));
  EXPECT_EQ(run(add_jobs, {"jobs", "cancel", "1"}).exit_code, 0);
  const auto result = (*job)->wait(std::chrono::seconds(20));
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->error().kind, ErrorKind::refused);
}

TEST_F(DaemonVerbs, StatusSaysWhatToSetAStrobeWithADialToAndWhatItDoes) {
  v1::DaemonStatus status = status_in(v1::ALIGNING);
  v1::StrobeStatus& strobe = *status.mutable_strobe();
  strobe.set_id("manual");
  strobe.set_light(v1::AMBER);
  strobe.set_by_hand(true);
  strobe.mutable_settings()->set_output(v1::StrobeState::FLASHING);
  strobe.mutable_settings()->set_rate_hz(1438.6 / 60);
  strobe.set_measured_hz(1510.5 / 60);
  strobe.set_reason("turn it down");
  api_.board().show(status);
  EXPECT_THAT(
      run(add_status, {"status"}).out,
      HasSubstr("set by hand, amber: to 1438.6 a minute (23.9767 Hz), measured 1510.5 (25.175 Hz). Turn it"));
}

TEST_F(DaemonVerbs, ConsolePrintsALinkAloneAndBesideItWhatItIsGoodFor) {
  const test::VerbRun nowhere = run(add_console, {"console"});
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("http_listen"));
  sessions_->serve_at("http://127.0.0.1:7140");
  const test::VerbRun link = run(add_console, {"console"});
  EXPECT_EQ(link.exit_code, 0) << link.err;
  EXPECT_THAT(link.out, testing::MatchesRegex("http://127\\.0\\.0\\.1:7140/open\\?link=[0-9a-f]{64}\n"));
  EXPECT_THAT(link.err, HasSubstr("once, within 120 s"));
  const json printed = json::parse(run(add_console, {"console", "--json"}).out);
  EXPECT_NE(printed["url"].get<std::string>() + "\n", link.out) << "each is another";
}

TEST_F(DaemonVerbs, AStatusThatIsRedIsTheExitCodeToo) {
  api_.board().show(status_in(v1::IDLE, v1::RED, "all cameras are gone"));
  EXPECT_EQ(run(add_status, {"status"}).exit_code, 1);
  EXPECT_EQ(run(add_status, {"status", "--acknowledge"}).exit_code, 1);
  EXPECT_THAT(api_.calls(), ElementsAre(HasSubstr("acknowledge")));
}

TEST_F(DaemonVerbs, AlignShowsItsRoundsUntilItIsLocked) {
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
    show_soon({round, second, locked});
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

TEST_F(DaemonVerbs, AnAlignmentThatIsRefusedSaysWhatCouldBeMet) {
  v1::DaemonStatus refused = status_in(v1::IDLE, v1::AMBER, "would take 900 resets");
  refused.mutable_alignment()->set_verdict(v1::AlignmentStatus::REFUSED);
  v1::AlignmentOffer& offer = *refused.mutable_alignment()->add_offers();
  offer.set_policy("timed");
  offer.set_tolerance_rows(200);
  offer.set_tolerance_s(10.8e-3);
  api_.on_align = [&](const v1::AlignRequest&) {
    show_soon({status_in(v1::ALIGNING), refused});
    return Status();
  };
  const test::VerbRun result = run(add_align, {"align"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("900 resets"));
  EXPECT_THAT(result.out, HasSubstr("10.80 ms (200 rows) with policy timed"));
}

TEST_F(DaemonVerbs, AlignStopLetsTheLockGo) {
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

TEST_F(DaemonVerbs, RecordFollowsToTheVerdict) {
  api_.on_record = [&](const v1::RecordRequest&) {
    show_soon({recording(v1::RecordingStatus::RECORDING, 24), recording(v1::RecordingStatus::COMPLETE, 48)});
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

TEST_F(DaemonVerbs, LiveVolumesAreAskedForWithTheRecordingAndToldBesideIt) {
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
    show_soon({running, recording(v1::RecordingStatus::COMPLETE, 480)});
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

TEST_F(DaemonVerbs, ARecordingWhoseCountsDoNotAgreeIsAFailure) {
  api_.on_record = [&](const v1::RecordRequest&) {
    v1::DaemonStatus failed = recording(v1::RecordingStatus::FAILED, 47);
    failed.mutable_recording()->mutable_lost()->set_queue(1);
    show_soon({failed});
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::RECORDING, 0).recording());
  };
  const test::VerbRun result = run(add_record, {"record", "candle", "--json"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(
      json::parse(result.out.substr(result.out.rfind('\n', result.out.size() - 2) + 1))["lost"]["queue"],
      "1");
}

TEST_F(DaemonVerbs, CtrlCEndsTheRecordingAndWaitsUntilItIsFinished) {
  api_.on_record = [&](const v1::RecordRequest&) {
    soon(
        {[&] { api_.board().show(recording(v1::RecordingStatus::RECORDING, 24)); }, [] { ::raise(SIGINT); }});
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

TEST_F(DaemonVerbs, ARefusalIsToldInTheDaemonsWords) {
  api_.on_record = [](const v1::RecordRequest&) {
    return Result<v1::RecordingStatus>(
        Error{ErrorKind::refused, "the cameras aren't locked", "candle", "align first, or give --unlocked"});
  };
  const test::VerbRun result = run(add_record, {"record", "candle"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("candle: the cameras aren't locked. Align first, or give --unlocked"));
}

TEST_F(DaemonVerbs, WatchFollowsStatusJournalAndIterations) {
  v1::IterationPreview preview;
  preview.set_reconstruction("candle 1");
  preview.mutable_iteration()->set_iteration(3);
  preview.set_rendered_jpeg("bytes");
  soon({[&] { api_.board().notice(v1::AMBER, "cam2 is slow"); },
        [&] { api_.board().show(std::make_shared<const v1::IterationPreview>(preview)); },
        [&] { api_.board().show(status_in(v1::LOCKED, v1::GREEN, "All in tolerance.")); }});
  const test::VerbRun result = run(add_watch, {"watch", "--seconds", "1.5", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("cam2 is slow"));
  EXPECT_THAT(result.out, HasSubstr("{\"iteration\":"));
  EXPECT_THAT(result.out, Not(HasSubstr("rendered_jpeg")));
  EXPECT_THAT(result.out, HasSubstr("All in tolerance."));
  std::istringstream lines(result.out);
  for (std::string line; std::getline(lines, line);) EXPECT_TRUE(json::accept(line)) << line;
}

TEST_F(DaemonVerbs, WatchBeginsWithNowAndNotWithWhatIsOver) {
  api_.board().notice(v1::AMBER, "cam1 was slow yesterday");
  v1::IterationPreview old;
  old.set_reconstruction("candle 1");
  old.mutable_iteration()->set_iteration(7);
  api_.board().show(std::make_shared<const v1::IterationPreview>(old));
  std::this_thread::sleep_for(std::chrono::milliseconds(3));
  v1::DaemonStatus now = status_in(v1::LOCKED, v1::GREEN, "All in tolerance.");
  now.set_now_utc(utc_now());
  now.mutable_reconstruction()->set_id("candle 1");
  now.mutable_reconstruction()->set_state(v1::ReconstructionStatus::DONE);
  now.mutable_reconstruction()->add_iterations()->set_iteration(7);
  api_.board().show(now);
  soon({[&] { api_.board().notice(v1::AMBER, "cam2 is slow today"); }});
  const test::VerbRun result = run(add_watch, {"watch", "--seconds", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out.substr(0, result.out.find('\n')), HasSubstr("locked, green: All in tolerance."));
  EXPECT_THAT(result.out, HasSubstr("cam2 is slow today"));
  EXPECT_THAT(result.out, Not(HasSubstr("yesterday")));
  EXPECT_THAT(result.out, Not(HasSubstr("candle 1")));
}

TEST_F(DaemonVerbs, ADaemonThatGoesAwayWhileItIsWatchedIsToldApart) {
  soon({[&] { server_.reset(); }});
  const test::VerbRun result = run(add_watch, {"watch", "--seconds", "20"});
  EXPECT_EQ(result.exit_code, kUnreachable);
  EXPECT_THAT(result.err, HasSubstr("went away"));
}

TEST_F(DaemonVerbs, AWatchThatHasSeenEnoughEndsWell) {
  DaemonAddress address;
  address.address = "unix:" + (folder_ / "socket").string();
  Client client = Client::connect(address).value();
  for (int i = 0; i < 200; ++i) {  // its end meets its beginning in every way
    const Status watched = client.watch_status([](const v1::DaemonStatus&) { return false; }, {});
    ASSERT_TRUE(watched.ok()) << i << ": " << watched.error().message();
    ASSERT_FALSE(client.lost());
  }
}

TEST_F(DaemonVerbs, StrobeChangesWhatItIsToldAlone) {
  v1::StrobeState state;
  state.set_output(v1::StrobeState::OFF);
  state.set_rate_hz(24);
  state.set_width_s(1e-4);
  api_.on_strobe = [state] { return Result<v1::StrobeState>(state); };
  api_.on_apply_strobe = [](const v1::StrobeState& wanted) { return Result<v1::StrobeState>(wanted); };
  EXPECT_THAT(run(add_strobe, {"strobe"}).out, HasSubstr("24 Hz"));
  EXPECT_THAT(api_.calls(), ElementsAre("strobe"));
  const test::VerbRun result =
      run(add_strobe, {"strobe", "--output", "flashing", "--code", "1101", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json applied = json::parse(result.out);
  EXPECT_EQ(applied["output"], "FLASHING");
  EXPECT_EQ(applied["rate_hz"], 24);
  EXPECT_EQ(applied["code"], (json{true, true, false, true}));
  EXPECT_EQ(run(add_strobe, {"strobe", "--code", "12"}).exit_code, 2);
  const auto played =
      run(add_strobe, {"strobe", "--frame-code", "--play", "--rate", "24.2", "--code-words", "2"});
  EXPECT_THAT(played.out,
              testing::AllOf(HasSubstr("flashing"), HasSubstr("24.2 Hz"), HasSubstr("... (240 flashes, ")));
}

v1::DaemonStatus reconstructing(v1::ReconstructionStatus::State state, int iterations) {
  v1::DaemonStatus status = status_in(v1::IDLE);
  v1::ReconstructionStatus& reconstruction = *status.mutable_reconstruction();
  reconstruction.set_id("candle 1");
  reconstruction.set_session("candle");
  reconstruction.set_state(state);
  for (int i = 1; i <= iterations; ++i) {
    v1::Iteration& iteration = *reconstruction.add_iterations();
    iteration.set_iteration(static_cast<std::uint32_t>(i));
    iteration.set_seconds(i);
  }
  if (state == v1::ReconstructionStatus::DONE) reconstruction.set_result("/results/candle");
  if (state == v1::ReconstructionStatus::FAILED)
    reconstruction.set_error("it crashed by SIGSEGV. Try device cpu");
  return status;
}

TEST_F(DaemonVerbs, ReconstructShowsEveryIterationAndTheResult) {
  api_.on_reconstruct = [&](const v1::ReconstructRequest&) {
    show_soon({reconstructing(v1::ReconstructionStatus::RUNNING, 1),
               reconstructing(v1::ReconstructionStatus::RUNNING, 3),
               reconstructing(v1::ReconstructionStatus::DONE, 4)});
    return Result<v1::ReconstructionStatus>(
        reconstructing(v1::ReconstructionStatus::RUNNING, 0).reconstruction());
  };
  const test::VerbRun result =
      run(add_reconstruct, {"reconstruct", "candle", "--voxels", "64", "--hold-out", "1,3"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* line : {"iteration 1:", "iteration 2:", "iteration 3:", "iteration 4:", "/results/candle"})
    EXPECT_THAT(result.out, HasSubstr(line));
  EXPECT_THAT(api_.calls(),
              ElementsAre("reconstruct session: \"candle\" voxels: 64 hold_out: 1 hold_out: 3"));
}

TEST_F(DaemonVerbs, ReconstructAsksForTemperaturesWithTheResponseItself) {
  const test::TempFolder folder;
  std::ofstream(folder / "response.json")
      << R"({"unit": "relative", "wavelength_nm": [500, 600], "r": [0, 1], "g": [1, 0], "b": [0, 0]})";
  api_.on_reconstruct = [&](const v1::ReconstructRequest&) {
    v1::DaemonStatus done = reconstructing(v1::ReconstructionStatus::DONE, 1);
    done.mutable_reconstruction()->add_temperature("1650 K on average");
    show_soon({done});
    return Result<v1::ReconstructionStatus>(
        reconstructing(v1::ReconstructionStatus::RUNNING, 0).reconstruction());
  };
  const std::string file = (folder / "response.json").string();
  const test::VerbRun result =
      run(add_reconstruct, {"reconstruct", "candle", "--quantity", "temperature", "--emitter", "soot",
                            "--lines", "auto", "--response", file});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("1650 K on average"));
  EXPECT_THAT(api_.calls(),
              ElementsAre(AllOf(HasSubstr("quantity: \"temperature\""), HasSubstr("wavelength_nm: 600"),
                                HasSubstr("emitter: \"soot\""), HasSubstr("lines: \"auto\""))));
  EXPECT_EQ(run(add_reconstruct, {"reconstruct", "candle", "--errors"}).exit_code, 0);
  EXPECT_THAT(api_.calls().back(), HasSubstr("errors: true"));
  const test::VerbRun refused = run(add_reconstruct, {"reconstruct", "candle", "--quantity", "temperature",
                                                      "--response", (folder / "no.json").string()});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("no.json"));
  EXPECT_EQ(api_.calls().size(), 2U) << "the daemon isn't asked";
}

TEST_F(DaemonVerbs, ASequenceIsToldFrameByFrame) {
  using State = v1::ReconstructionStatus;
  const auto at = [](State::State whole, std::initializer_list<State::State> frames) {
    v1::DaemonStatus status = reconstructing(whole, 2);
    std::uint64_t number = 10;
    for (const State::State state : frames) {
      v1::SequenceFrame& frame = *status.mutable_reconstruction()->add_frames();
      frame.set_frame(number += 2);
      frame.set_state(state);
      frame.set_input_rmse(4.5);
      if (state == State::FAILED) frame.set_error("No light.");
    }
    return status;
  };
  api_.on_reconstruct = [&](const v1::ReconstructRequest&) {
    show_soon({at(State::RUNNING, {State::DONE, State::RUNNING, State::STATE_UNSPECIFIED}),
               at(State::FAILED, {State::DONE, State::FAILED, State::DONE})});
    return Result<v1::ReconstructionStatus>(at(State::RUNNING, {}).reconstruction());
  };
  const test::VerbRun result =
      run(add_reconstruct, {"reconstruct", "candle", "--frame", "12", "--last-frame", "16", "--every", "2"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out,
            "1 of 3: frame 12: done, input error 4.50 grey levels\n"
            "2 of 3: frame 14: failed. No light.\n"
            "3 of 3: frame 16: done, input error 4.50 grey levels\n");
  EXPECT_THAT(api_.calls(), ElementsAre("reconstruct session: \"candle\" frame: 12 last_frame: 16 every: 2"));
  EXPECT_THAT(run(add_status, {"status"}).out, HasSubstr("candle: failed"));
}

TEST_F(DaemonVerbs, AReconstructionThatFailedSaysWhy) {
  api_.on_reconstruct = [&](const v1::ReconstructRequest&) {
    show_soon({reconstructing(v1::ReconstructionStatus::FAILED, 1)});
    return Result<v1::ReconstructionStatus>(
        reconstructing(v1::ReconstructionStatus::RUNNING, 0).reconstruction());
  };
  const test::VerbRun result = run(add_reconstruct, {"reconstruct", "candle", "--json"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("SIGSEGV"));
}

TEST_F(DaemonVerbs, ATakeThatIsLongerThanTheLockRenewsItFirstAndSaysSo) {
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
    show_soon({locked(95)});
    return Status();
  };
  api_.on_record = [&](const v1::RecordRequest&) {
    show_soon({recording(v1::RecordingStatus::COMPLETE, 48)});
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

TEST_F(DaemonVerbs, NoLockIsRenewedForATakeThatItHoldsForOrThatIsAskedForAsItIs) {
  v1::DaemonStatus status = status_in(v1::LOCKED);
  status.mutable_alignment()->set_verdict(v1::AlignmentStatus::ALIGNED);
  status.mutable_alignment()->set_time_left_s(30);
  api_.board().show(status);
  api_.on_record = [&](const v1::RecordRequest&) {
    show_soon({recording(v1::RecordingStatus::COMPLETE, 48)});
    return Result<v1::RecordingStatus>(recording(v1::RecordingStatus::RECORDING, 0).recording());
  };
  for (const auto& words :
       std::vector<std::vector<std::string>>{{"record", "candle", "--seconds", "20"},
                                             {"record", "candle", "--seconds", "40"},
                                             {"record", "candle", "--seconds", "40", "--unlocked"},
                                             {"record", "candle", "--seconds", "40", "--no-renewal"}})
    run(add_record, words);
  for (const std::string& call : api_.calls()) EXPECT_THAT(call, HasSubstr("record"));
}

}  // namespace
}  // namespace emberlock::cli
