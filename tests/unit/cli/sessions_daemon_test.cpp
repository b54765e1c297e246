// SPDX-License-Identifier: Apache-2.0
// `emberlock sessions` of the daemon's recordings, against a real server and a daemon without devices.
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "cli/client.h"
#include "cli/commands.h"
#include "tests/support/grpc_server.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

class SessionsOfDaemon : public test::GrpcServerTest {
 protected:
  SessionsOfDaemon() { serve(); }
  test::VerbRun run(std::vector<std::string> words) const {
    words.insert(words.begin(), "sessions");
    words.insert(words.end(), {"--daemon", "unix:" + socket.string()});
    return test::run_verb(add_sessions, std::move(words));
  }
  /// Jobs end so.
  void end_with(bool ok, const std::string& report) {
    api.on_job = [ok, report](const daemon::JobObserver& observer) {
      v1::JobProgress progress;
      progress.set_fraction(0.5);
      progress.set_doing("reads");
      observer(progress);
      progress.set_fraction(1);
      progress.set_done(true);
      progress.set_ok(ok);
      progress.set_report(report);
      observer(progress);
      return Status();
    };
  }
};

TEST_F(SessionsOfDaemon, AreListedWithWhatTheyLostAndWhyOneCanNotBeRead) {
  EXPECT_EQ(run({"list"}).out, "No sessions.\n");
  api.on_list_sessions = [] {
    v1::ListSessionsResponse response;
    v1::ListSessionsResponse::Entry& flame = *response.add_sessions();
    flame.set_session("flame 1");
    flame.set_state(v1::Manifest::COMPLETE);
    flame.set_cameras(11);
    flame.set_frames(15840);
    flame.set_lost(3);
    flame.set_bytes(15'000'000'000);
    flame.set_calibrated(true);
    v1::ListSessionsResponse::Entry& broken = *response.add_sessions();
    broken.set_session("broken");
    broken.set_error("its manifest is empty");
    return Result<v1::ListSessionsResponse>(response);
  };
  const test::VerbRun table = run({"list"});
  EXPECT_EQ(table.exit_code, 0) << table.err;
  for (const char* words : {"flame 1", "COMPLETE", "11 cameras", "15840 frames", "3 lost", "15000.0 MB",
                            "calibrated", "broken", "unreadable: its manifest is empty"})
    EXPECT_THAT(table.out, HasSubstr(words));
  const json printed = json::parse(run({"list", "--json"}).out);
  EXPECT_EQ(printed["sessions"][0]["frames"], "15840");
  EXPECT_EQ(printed["sessions"][1]["error"], "its manifest is empty");
}

TEST_F(SessionsOfDaemon, AreVerifiedRepairedAndExportedByTheirNames) {
  end_with(true, R"({"whole":true})");
  EXPECT_THAT(run({"verify", "flame"}).out, HasSubstr("flame: all good"));
  EXPECT_EQ(json::parse(run({"repair", "flame", "--json"}).out), json({{"whole", true}}));
  EXPECT_EQ(run({"export", "flame"}).exit_code, 0);
  EXPECT_EQ(run({"export", "flame", "--format", "video"}).exit_code, 0);
  EXPECT_THAT(api.calls(),
              ElementsAre("verify_session session: \"flame\"", "repair_session session: \"flame\"",
                          "export_session session: \"flame\" format: PNG",
                          "export_session session: \"flame\" format: VIDEO"));
}

TEST_F(SessionsOfDaemon, OneThatIsNotWholeIsTheExitCodeAndItsReport) {
  end_with(false, R"({"problems":["cam2: 3 frames can't be read back"]})");
  const test::VerbRun shown = run({"verify", "flame"});
  EXPECT_EQ(shown.exit_code, 1);
  EXPECT_THAT(shown.out, HasSubstr("cam2: 3 frames can't be read back"));
  EXPECT_THAT(shown.out, HasSubstr("flame: damaged, see above"));
  EXPECT_EQ(run({"verify", "flame", "--json"}).exit_code, 1);
}

TEST_F(SessionsOfDaemon, AJobThatCanNotBeginIsToldInTheDaemonsWords) {
  api.on_job = [](const daemon::JobObserver&) {
    return Error{ErrorKind::bad_input, "no such session", "candle", "`emberlock sessions list` shows them"};
  };
  const test::VerbRun result = run({"repair", "candle"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("candle: no such session. `emberlock sessions list` shows them"));
  EXPECT_EQ(result.out, "");
}

TEST_F(SessionsOfDaemon, AJobThatFailsOnItsWayIsAFailureInTheDaemonsWords) {
  api.on_job = [](const daemon::JobObserver& observer) -> Status {
    v1::JobProgress progress;
    progress.set_fraction(.5);
    for (int i = 0; i < 20; ++i) observer(progress);
    return Error{ErrorKind::io, "no space left on device", "exports/flame", "Free space"};
  };
  for (const std::string verb : {"verify", "repair", "export"}) {
    const test::VerbRun result = run({verb, "flame"});
    EXPECT_EQ(result.exit_code, 1) << verb;
    EXPECT_THAT(result.err, HasSubstr("exports/flame: no space left on device. Free space"));
  }
}

TEST_F(SessionsOfDaemon, AJobThatEndsBeforeItIsDoneIsAFailure) {
  api.on_job = [](const daemon::JobObserver& observer) {
    observer({});
    return Status();
  };
  const test::VerbRun result = run({"verify", "flame"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("it ended without saying what came of it"));
}

TEST_F(SessionsOfDaemon, TheDaemonChoosesWhereItExports) {
  const test::VerbRun result = run({"export", "flame", "--out", "x"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("./flame"));
  EXPECT_THAT(api.calls(), testing::IsEmpty());
}

}  // namespace
}  // namespace emberlock::cli
