// SPDX-License-Identifier: Apache-2.0
// `emberlock sessions` of the daemon's recordings, against a real server and a daemon without devices.
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "cli/client.h"
#include "cli/commands.h"
#include "session/job_messages.h"
#include "tests/support/daemon_verbs.h"

namespace emberlock::cli {
namespace {
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

class SessionsOfDaemon : public test::VerbsOfADaemon {
 protected:
  [[nodiscard]] test::VerbRun run(std::vector<std::string> words) const {
    words.insert(words.begin(), "sessions");
    return VerbsOfADaemon::run(add_sessions, std::move(words));
  }
  /// Jobs end so.
  void end_with(const v1::JobOutcome& outcome) {
    api_.on_job = [outcome](const Observer& observer) -> daemon::JobResult {
      observer(0.5, "reads");
      return outcome;
    };
  }
};

TEST_F(SessionsOfDaemon, AreListedWithWhatTheyLostAndWhyOneCanNotBeRead) {
  EXPECT_EQ(run({"list"}).out, "No sessions.\n");
  api_.on_list_sessions = [] {
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

v1::JobOutcome verified(std::uint64_t good, const std::string& problem) {
  session::SessionCheck check;
  check.state = v1::Manifest::COMPLETE;
  session::CameraCheck& camera = check.cameras.emplace_back();
  camera.camera_id = "cam2";
  camera.recorded = 9;
  camera.good = good;
  camera.bad = 9 - good;
  if (!problem.empty()) camera.problems = {problem};
  check.to_do = "Repair it";
  return session::to_outcome(check);
}

TEST_F(SessionsOfDaemon, AreVerifiedRepairedAndExportedByTheirNames) {
  end_with(verified(9, ""));
  EXPECT_EQ(run({"verify", "flame"}).out, "cam2                     9 of 9 frames good\nAll there.\n");
  session::RepairReport mended;
  mended.cameras.push_back({"cam2", 8, 1, 0, {}});
  end_with(session::to_outcome(mended));
  EXPECT_EQ(json::parse(run({"repair", "flame", "--json"}).out)["cameras"][0]["lost"], 1);
  session::ExportReport pictures;
  pictures.cameras.push_back({"cam2", "cam2", 8, 0, 0, 0, {}});
  v1::JobOutcome exported = session::to_outcome(pictures);
  exported.mutable_export_()->set_folder("/data/exports/flame");
  end_with(exported);
  EXPECT_EQ(run({"export", "flame"}).out, "/data/exports/flame/cam2: 8 frames\n");
  EXPECT_EQ(run({"export", "flame", "--format", "video"}).exit_code, 0);
  EXPECT_THAT(api_.calls(),
              ElementsAre("verify_session session: \"flame\"", "repair_session session: \"flame\"",
                          "export_session session: \"flame\" format: PNG",
                          "export_session session: \"flame\" format: VIDEO"));
}

TEST_F(SessionsOfDaemon, OneThatIsNotWholeIsTheExitCodeAndItsReport) {
  end_with(verified(6, "000000.mkv: 3 frames can't be read back"));
  const test::VerbRun shown = run({"verify", "flame"});
  EXPECT_EQ(shown.exit_code, 1);
  EXPECT_EQ(shown.out,
            "cam2                     6 of 9 frames good, 3 can't be read back\n"
            "  000000.mkv: 3 frames can't be read back\nRepair it.\n");
  EXPECT_EQ(run({"verify", "flame", "--json"}).exit_code, 1);
}

TEST_F(SessionsOfDaemon, AJobThatCanNotBeginIsToldInTheDaemonsWords) {
  api_.on_begin =
      Error{ErrorKind::bad_input, "no such session", "candle", "`emberlock sessions list` shows them"};
  const test::VerbRun result = run({"repair", "candle"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("candle: no such session. `emberlock sessions list` shows them"));
  EXPECT_EQ(result.out, "");
}

TEST_F(SessionsOfDaemon, AJobThatFailsOnItsWayIsAFailureInTheDaemonsWords) {
  api_.on_job = [](const Observer& observer) -> daemon::JobResult {
    for (int i = 0; i < 20; ++i) observer(.5, {});
    return Error{ErrorKind::io, "no space left on device", "exports/flame", "Free space"};
  };
  for (const std::string verb : {"verify", "repair", "export"}) {
    const test::VerbRun result = run({verb, "flame"});
    EXPECT_EQ(result.exit_code, 1) << verb;
    EXPECT_THAT(result.err, HasSubstr("exports/flame: no space left on device. Free space"));
  }
}

TEST_F(SessionsOfDaemon, TheDaemonChoosesWhereItExports) {
  const test::VerbRun result = run({"export", "flame", "--out", "x"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("./flame"));
  EXPECT_THAT(api_.calls(), testing::IsEmpty());
}

}  // namespace
}  // namespace emberlock::cli
