// SPDX-License-Identifier: Apache-2.0
// Sessions that earlier versions wrote (tests/files/session_VERSION) stay what they were: read, verified,
// salvaged, compressed, backed up.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "session/backup.h"
#include "session/reader.h"
#include "session/salvage.h"
#include "session/verify.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::put_bytes;
using test::TempFolder;

/// A copy of one of them, which may be changed.
struct Earlier {
  explicit Earlier(const char* name) {
    fs::copy(EMBERLOCK_SOURCE_DIR "/tests/files/session_0.2.0/" + std::string(name), session,
             fs::copy_options::recursive);
  }
  void expect_whole(const std::vector<std::uint64_t>& frames) const {
    const auto check = verify_session(session);
    ASSERT_TRUE(check) << check.error().message();
    EXPECT_TRUE(check->whole()) << check->to_do;
    ASSERT_EQ(check->cameras.size(), frames.size());
    for (std::size_t c = 0; c < frames.size(); ++c) EXPECT_EQ(check->cameras[c].good, frames[c]);
  }
  TempFolder temp;
  fs::path session = temp / "session";
};

TEST(Upgrade, SessionsOfEarlierVersionsAreWhole) {
  Earlier("ffv1").expect_whole({9, 9});
  Earlier("raw").expect_whole({10, 9});
  Earlier("calibrated").expect_whole({3, 3, 3, 3});
}

TEST(Upgrade, TheirManifestsSayWhatTheySaid) {
  const Earlier earlier("calibrated");
  const auto session = SessionReader::open(earlier.session);
  ASSERT_TRUE(session) << session.error().message();
  const v1::Manifest& manifest = session->manifest();
  EXPECT_EQ(manifest.state(), v1::Manifest::COMPLETE);
  EXPECT_TRUE(manifest.has_box());
  ASSERT_EQ(manifest.cameras_size(), 4);
  for (const v1::CameraStream& camera : manifest.cameras()) {
    EXPECT_NEAR(camera.calibration().fx(), 120, 1e-9);
    EXPECT_EQ(camera.calibration().camera_from_world_size(), 12);
  }
}

TEST(Upgrade, TheirCertificatesHold) {
  const auto check = verify_session(Earlier("calibrated").session);
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_EQ(check->certified_files, 10U);
  EXPECT_TRUE(check->problems.empty());
}

TEST(Upgrade, TheEventsOfTheirAlignmentsAreRead) {
  const Earlier earlier("alignment/timed");
  const auto session = SessionReader::open(earlier.session);
  ASSERT_TRUE(session) << session.error().message();
  const std::vector<v1::Event>& events = session->events();
  ASSERT_TRUE(events.front().has_settings());
  EXPECT_EQ(events.front().settings().policy(), v1::AlignmentSettings::TIMED);
  EXPECT_EQ(events.front().settings().cameras_size(), 2);
  const auto last =
      std::find_if(events.rbegin(), events.rend(), [](const v1::Event& e) { return e.has_decision(); });
  ASSERT_NE(last, events.rend());
  EXPECT_EQ(last->decision().verdict(), v1::DecisionEvent::ALIGNED);
}

TEST(Upgrade, OneWhoseRecorderWasKilledIsSalvaged) {
  const Earlier earlier("killed");
  EXPECT_FALSE(verify_session(earlier.session)->whole());
  const auto report = salvage(earlier.session);
  ASSERT_TRUE(report) << report.error().message();
  for (const SalvagedCamera& camera : report->cameras) {
    EXPECT_EQ(camera.kept, 11U);
    EXPECT_EQ(camera.lost, 0U);
  }
  earlier.expect_whole({11, 11});
}

TEST(Upgrade, UncompressedOnesAreCompressed) {
  const Earlier earlier("raw");
  const Status done = transcode(earlier.session);
  ASSERT_TRUE(done) << done.error().message();
  EXPECT_TRUE(fs::exists(earlier.session / "virtual-00/000000.mkv"));
  EXPECT_FALSE(fs::exists(earlier.session / "virtual-00/000000.nut"));
  earlier.expect_whole({10, 9});
}

TEST(Upgrade, DamageIsFoundAndRepaired) {
  const Earlier earlier("ffv1");
  const fs::path segment = earlier.session / "virtual-01/000000.mkv";
  const std::string good = bytes_of(segment);
  put_bytes(segment, std::string(good).replace(good.size() / 3, 16, 16, '\0'));
  EXPECT_FALSE(verify_session(earlier.session)->whole());
  const auto repaired = repair_session(earlier.session);
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(repaired->cameras[0].kept, 9U);
  EXPECT_GE(repaired->cameras[1].kept, 7U);
  EXPECT_LT(repaired->cameras[1].kept, 9U);
}

TEST(Upgrade, TheyAreBackedUp) {
  const Earlier earlier("calibrated");
  EXPECT_EQ(back_up_session(earlier.session, earlier.temp / "backups", Compare::times)->outcome,
            Backup::Outcome::copied);
  EXPECT_TRUE(remove_backed_up(earlier.session, earlier.temp / "backups"));
}

}  // namespace
}  // namespace emberlock::session
