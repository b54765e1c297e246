// SPDX-License-Identifier: Apache-2.0
// The verbs that ask emberlockd: what goes for all, and those that only look or set.
#include "tests/support/daemon_verbs.h"

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "cli/client.h"
#include "cli/commands.h"

namespace emberlock::cli {
namespace {
using nlohmann::json;
using test::status_in;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

using DaemonVerbs = test::VerbsOfADaemon;

TEST(DaemonVerbsAlone, WithoutADaemonTheySayWhatToDoAndLeaveWithThree) {
  const test::TempFolder folder;
  const std::string nobody = "unix:" + (folder / "socket").string();
  for (const auto& [add, words] : std::vector<std::pair<test::AddVerb, std::vector<std::string>>>{
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

}  // namespace
}  // namespace emberlock::cli
