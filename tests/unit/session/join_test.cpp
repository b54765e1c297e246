// SPDX-License-Identifier: Apache-2.0
// One session of the parts that several hosts recorded, each on its own clock.
#include "session/join.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/certificate.h"
#include "session/files.h"
#include "session/join_events.h"
#include "session/reader.h"
#include "session/salvage.h"
#include "session/shutter_times.h"
#include "session/verify.h"
#include "tests/support/session_parts.h"

namespace emberlock::session {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::change_manifest;
using test::instant_of;
using test::PartHost;
using test::PartsRecording;
using test::TempFolder;
using testing::ElementsAre;
using testing::HasSubstr;

/// Parts of a session beside what they are joined to.
class Join : public testing::Test {
 protected:
  void record(const std::vector<PartHost>& hosts, const PartsRecording& recording = {}) {
    parts_ = test::record_parts(temp_ / "parts", hosts, recording);
  }
  [[nodiscard]] Result<Joined> join(Missing missing = Missing::is_an_error,
                                    const Observer& observer = {}) const {
    return join_sessions(parts_, out_, missing, observer);
  }
  Joined join_well(Missing missing = Missing::is_an_error) const {
    auto joined = join(missing);
    EXPECT_TRUE(joined) << joined.error().message();
    return joined ? std::move(joined).value() : Joined();
  }
  /// For `why`, and with nothing left.
  void expect_refused(ErrorKind kind, const std::string& why) const {
    const auto joined = join();
    ASSERT_FALSE(joined) << why;
    EXPECT_EQ(joined.error().kind, kind) << joined.error().message();
    EXPECT_THAT(joined.error().message(), HasSubstr(why));
    expect_nothing_left();
  }
  void expect_nothing_left() const {
    EXPECT_FALSE(fs::exists(out_));
    EXPECT_EQ(std::distance(fs::directory_iterator(temp_.path()), fs::directory_iterator()), 1);
  }
  [[nodiscard]] std::vector<std::string> camera_ids() const {
    std::vector<std::string> ids;
    const v1::Manifest manifest = test::checked(read_manifest(out_));
    for (const v1::CameraStream& camera : manifest.cameras()) ids.push_back(camera.camera_id());
    return ids;
  }
  void expect_whole() const {
    const auto check = verify_session(out_);
    ASSERT_TRUE(check) << check.error().message();
    EXPECT_TRUE(check->whole()) << check->to_do;
  }

  TempFolder temp_;
  fs::path out_ = temp_ / "joined";
  std::vector<fs::path> parts_;
};

/// Each frame of each camera within a nanosecond of its instant.
void expect_on_session(const SessionReader& session, std::uint64_t frames) {
  for (std::size_t c = 0; c < session.camera_count(); ++c) {
    const auto& stamps = session.stamps(c);
    ASSERT_EQ(stamps.size(), frames);
    for (std::uint64_t i = 0; i < frames; ++i)
      EXPECT_NEAR(static_cast<double>(stamps[i].monotonic_time.ns - instant_of(i)), 0, 2)
          << session.manifest().cameras(static_cast<int>(c)).camera_id() << ' ' << i;
  }
}

TEST_F(Join, FramesOfThreeHostsAreOnOneClockOverTwentyMinutes) {
  record(test::three_hosts());
  const Joined joined = join_well();
  EXPECT_EQ(joined.hosts.size(), 2U);
  EXPECT_EQ(joined.events_left_out, 0U);
  auto session = SessionReader::open(out_);
  ASSERT_TRUE(session) << session.error().message();
  EXPECT_EQ(joined.manifest.SerializeAsString(), session->manifest().SerializeAsString());
  EXPECT_THAT(camera_ids(), ElementsAre("left", "right", "back", "above", "front"));
  expect_on_session(*session, 21);
  for (std::size_t c = 0; c < 5; ++c) {
    const auto frame = session->read(c, 20);
    ASSERT_TRUE(frame) << frame.error().message();
    EXPECT_EQ(frame->stamp, session->stamps(c)[20]) << "the frame's stamp is what the list has";
  }
  EXPECT_EQ(session->manifest().session_id(), "take 1");
  EXPECT_EQ(session->manifest().state(), v1::Manifest::COMPLETE);
  EXPECT_EQ(session->manifest().hosts_size(), 0);
  EXPECT_EQ(session->manifest().led_by(), "");
  expect_whole();
}

TEST_F(Join, FilesOfCamerasAreCopiedAsTheyAre) {
  record(test::three_hosts());
  join_well();
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const std::vector<std::string> cameras = test::three_hosts()[i].cameras;
    for (const std::string& id : cameras) {
      std::size_t files = 0;
      for (const auto& entry : fs::directory_iterator(parts_[i] / id)) {
        const fs::path copy = out_ / id / entry.path().filename();
        EXPECT_EQ(bytes_of(copy), bytes_of(entry.path())) << copy;
        EXPECT_EQ(fs::hard_link_count(copy), 1U) << "sessions are changed in place";
        ++files;
      }
      EXPECT_EQ(files, 4U) << "three segments and the index";
    }
  }
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(out_)) names.push_back(entry.path().filename().string());
  EXPECT_THAT(names, testing::UnorderedElementsAre("left", "right", "back", "above", "front", "events.binpb",
                                                   "manifest.json"));
}

TEST_F(Join, TheOrderOfThePartsIsTheLeaders) {
  record(test::three_hosts());
  std::reverse(parts_.begin(), parts_.end());
  join_well();
  EXPECT_THAT(camera_ids(), ElementsAre("left", "right", "back", "above", "front"));
  expect_on_session(*SessionReader::open(out_), 21);
}

TEST_F(Join, EachPartsOwnStreamIsKept) {
  record(test::three_hosts());
  change_manifest(parts_[1], [](v1::Manifest& manifest) {
    v1::CameraStream& camera = *manifest.mutable_cameras(0);
    camera.mutable_calibration()->set_fx(700);
    camera.mutable_colour()->add_gain(2);
    camera.set_late_s(0.004);
    camera.mutable_counts()->set_transport(3);
  });
  const Joined joined = join_well();
  const v1::CameraStream& camera = joined.manifest.cameras(2);
  EXPECT_EQ(camera.camera_id(), "back");
  EXPECT_EQ(camera.calibration().fx(), 700);
  EXPECT_EQ(camera.colour().gain(0), 2);
  EXPECT_EQ(camera.late_s(), 0.004);
  EXPECT_EQ(camera.counts().transport(), 3U);
  EXPECT_EQ(camera.counts().recorded(), 21U);
  EXPECT_EQ(camera.clock_size(), 2);
  EXPECT_EQ(joined.manifest.cameras(0).clock_size(), 0);
}

/// Compression, repair and a second look leave the stamps of the hosts' clocks in the files.
TEST_F(Join, WhatChangesFilesKeepsTheStampsThatTheHostsWrote) {
  record(test::three_hosts(), {.encoding = Encoding::raw_nut});
  join_well();
  std::vector<std::string> indices;
  for (const std::string& id : camera_ids()) indices.push_back(bytes_of(index_path(out_, id)));
  ASSERT_TRUE(transcode(out_));
  const fs::path segment = find_segment(out_, "back", 1);
  EXPECT_EQ(segment.extension(), ".mkv");
  expect_whole();
  fs::remove(index_path(out_, "back"));  // it is made anew of what the segments tell
  const auto repaired = repair_session(out_);
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_TRUE(repaired->changed);
  const std::vector<std::string> ids = camera_ids();
  for (std::size_t i = 0; i < ids.size(); ++i) EXPECT_EQ(bytes_of(index_path(out_, ids[i])), indices[i]);
  expect_on_session(*SessionReader::open(out_), 21);
}

TEST_F(Join, WhoFollowsReadsTheSameStamps) {
  record(test::three_hosts());
  join_well();
  auto session = SessionReader::follow(out_);
  ASSERT_TRUE(session);
  ASSERT_TRUE(session->advance({3, 3, 3, 3, 3}));
  ASSERT_TRUE(session->advance({21, 21, 21, 21, 21}));
  expect_on_session(*session, 21);
}

/// As if a camera's stream were copied for a new recording.
TEST_F(Join, WhatIsRecordedAnewBearsTheSessionsClockAlone) {
  record(test::three_hosts());
  const Joined joined = join_well();
  auto writer = SessionWriter::create(temp_ / "anew", joined.manifest, test::small_disk_options());
  ASSERT_TRUE(writer) << writer.error().message();
  auto session = SessionReader::open(out_);
  for (std::size_t c = 0; c < 5; ++c)
    for (std::size_t i = 0; i < 21; ++i) ASSERT_TRUE(writer->write(c, *session->read(c, i)));
  ASSERT_TRUE(writer->finish());
  expect_on_session(*SessionReader::open(temp_ / "anew"), 21);
}

v1::Event note(std::int64_t ns, const std::string& text) {
  v1::Event event;
  event.set_monotonic_ns(ns);
  event.set_note(text);
  return event;
}

v1::Event lock(std::int64_t ns, std::uint32_t round, const std::vector<double>& errors_s) {
  v1::Event event;
  event.set_monotonic_ns(ns);
  v1::DecisionEvent& decision = *event.mutable_decision();
  decision.set_round(round);
  decision.set_verdict(v1::DecisionEvent::ALIGNED);
  for (const double error : errors_s) {
    decision.add_cameras()->set_error_s(error);
    decision.mutable_cameras()->rbegin()->set_sigma_s(1e-5);
  }
  decision.set_worst_pair_s(*std::max_element(errors_s.begin(), errors_s.end()) -
                            *std::min_element(errors_s.begin(), errors_s.end()));
  return event;
}

TEST_F(Join, EventsAreInTheOrderOfTheSessionsClock) {
  std::vector<PartHost> hosts = test::three_hosts();
  const auto at = [](int seconds) { return instant_of(0) + std::int64_t{seconds} * 1'000'000'000; };
  hosts[0].events = {note(at(1), "1"), note(at(4), "4"), note(at(900), "900")};
  hosts[1].events = {note(hosts[1].shows(at(2)), "2"), note(hosts[1].shows(at(600)), "600")};
  v1::Event reset;
  reset.set_monotonic_ns(hosts[2].shows(at(3)));
  reset.mutable_reset()->set_camera_id("front");
  reset.mutable_reset()->set_at_ns(hosts[2].shows(at(5)));
  hosts[2].events = {reset};
  record(hosts);
  EXPECT_EQ(join_well().events_left_out, 0U);
  const auto session = SessionReader::open(out_);
  ASSERT_TRUE(session);
  std::vector<double> seconds;
  std::string notes;
  for (const v1::Event& event : session->events()) {
    seconds.push_back(static_cast<double>(event.monotonic_ns() - at(0)) * 1e-9);
    notes += event.note() + ' ';
  }
  EXPECT_EQ(notes, "1 2  4 600 900 ");
  using testing::DoubleNear;
  EXPECT_THAT(seconds, ElementsAre(DoubleNear(1, 1e-8), DoubleNear(2, 1e-8), DoubleNear(3, 1e-8),
                                   DoubleNear(4, 1e-8), DoubleNear(600, 1e-8), DoubleNear(900, 1e-8)));
  EXPECT_NEAR(static_cast<double>(session->events()[2].reset().at_ns() - at(5)), 0, 2);
}

TEST_F(Join, WhatAllTellOfOneLockIsOneDecision) {
  std::vector<PartHost> hosts = test::three_hosts();
  const std::int64_t at = instant_of(0);
  hosts[0].events = {lock(at, 7, {1e-4, -2e-4})};
  // In the others' parts a round that the leader knows nothing of comes first.
  hosts[1].events = {lock(hosts[1].shows(at) - 5, 6, {0, 0}), lock(hosts[1].shows(at), 7, {3e-4, 0})};
  hosts[2].events = {lock(hosts[2].shows(at), 7, {-5e-4})};
  record(hosts);
  EXPECT_EQ(join_well().events_left_out, 1U);
  const auto session = SessionReader::open(out_);
  ASSERT_TRUE(session);
  ASSERT_EQ(session->events().size(), 1U);
  EXPECT_EQ(session->events()[0].monotonic_ns(), at);
  const v1::DecisionEvent& told = session->events()[0].decision();
  std::vector<double> errors;
  for (const auto& camera : told.cameras()) errors.push_back(camera.error_s());
  EXPECT_THAT(errors, ElementsAre(1e-4, -2e-4, 3e-4, 0, -5e-4));
  EXPECT_DOUBLE_EQ(told.worst_pair_s(), 8e-4);
  EXPECT_EQ(told.cameras(4).sigma_s(), 1e-5);
}

/// The leader's cameras are the first, so its decisions are right as they are.
TEST_F(Join, ADecisionThatNotAllTellOfIsTheLeadersAlone) {
  std::vector<PartHost> hosts = test::three_hosts();
  hosts[0].events = {lock(instant_of(0), 7, {1e-4, -2e-4})};
  hosts[1].events = {lock(hosts[1].shows(instant_of(0)), 7, {3e-4, 0})};
  v1::Event settings;
  settings.set_monotonic_ns(hosts[2].shows(instant_of(0)));
  settings.mutable_settings()->set_seed(3);
  hosts[2].events = {settings};
  record(hosts);
  EXPECT_EQ(join_well().events_left_out, 2U);
  const auto session = SessionReader::open(out_);
  ASSERT_EQ(session->events().size(), 1U);
  EXPECT_EQ(session->events()[0].SerializeAsString(), hosts[0].events[0].SerializeAsString());
}

TEST_F(Join, ACameraWithoutAnErrorLeavesTheWorstPairUntold) {
  std::vector<PartHost> hosts = test::three_hosts();
  hosts[0].events = {lock(5, 7, {1e-4, -2e-4})};
  hosts[1].events = {lock(5, 7, {3e-4, 0})};
  hosts[2].events = {lock(5, 7, {0})};
  hosts[2].events[0].mutable_decision()->mutable_cameras(0)->clear_error_s();
  std::vector<PartEvents> parts;
  for (const PartHost& host : hosts)
    parts.push_back({host.events, {}, static_cast<int>(host.cameras.size())});
  const JoinedEvents joined = join_events(parts);
  ASSERT_EQ(joined.events.size(), 1U);
  EXPECT_EQ(joined.events[0].decision().cameras_size(), 5);
  EXPECT_FALSE(joined.events[0].decision().has_worst_pair_s());
}

TEST_F(Join, AMissingPartIsNamedOrLeftOutAndJoinedLater) {
  record(test::three_hosts());
  const std::vector<fs::path> all = parts_;
  parts_ = {all[2], all[0]};
  expect_refused(ErrorKind::bad_input,
                 "a part is missing of what its manifest names: \"take 1\" of lab-2:50051");
  parts_ = {all[0]};
  expect_refused(ErrorKind::bad_input, "\"take 1\" of lab-2:50051, \"take 1\" of lab-3:50051");
  parts_ = {all[2], all[0]};
  const Joined joined = join_well(Missing::is_left_out);
  ASSERT_EQ(joined.manifest.hosts_size(), 1);
  EXPECT_EQ(joined.manifest.hosts(0).host(), "lab-2:50051");
  EXPECT_THAT(camera_ids(), ElementsAre("left", "right", "front"));
  expect_on_session(*SessionReader::open(out_), 21);
  expect_whole();
  parts_ = {all[1], out_};
  out_ = temp_ / "later";
  join_well();
  EXPECT_THAT(camera_ids(), ElementsAre("left", "right", "front", "back", "above"));
  EXPECT_EQ(read_manifest(out_)->hosts_size(), 0);
  expect_on_session(*SessionReader::open(out_), 21);
}

TEST_F(Join, PartsOfOneSessionAloneMakeOne) {
  record(test::three_hosts());
  const std::vector<fs::path> all = parts_;
  parts_ = {all[0], all[1], all[2], all[1] / "."};
  expect_refused(ErrorKind::bad_input, "given twice");
  parts_ = {all[1], all[2]};
  expect_refused(ErrorKind::bad_input, "none of the parts names those of other hosts");
  parts_ = {};
  expect_refused(ErrorKind::bad_input, "none of the parts names those of other hosts");
  parts_ = {all[0], temp_ / "parts"};
  expect_refused(ErrorKind::bad_input, "not a session");
  parts_ = all;
  out_ = all[1] / "joined";
  const auto within = join();
  ASSERT_FALSE(within);
  EXPECT_THAT(within.error().message(), HasSubstr("lies in a folder that is read"));
}

/// What is wrong with a part whose manifest was changed, or the leader's.
TEST_F(Join, WhatDoesNotBelongTogetherIsRefused) {
  struct Case {
    std::size_t part;
    std::function<void(v1::Manifest&)> change;
    std::string why;
  };
  const std::vector<Case> cases{
      {1, [](v1::Manifest& m) { m.set_session_id("take 2"); }, "is of the session \"take 2\""},
      {1, [](v1::Manifest& m) { m.set_purpose("alignment"); }, "is a recording for \"alignment\""},
      {1, [](v1::Manifest& m) { m.clear_led_by(); }, "wasn't recorded for another host"},
      {1, [](v1::Manifest& m) { m.add_hosts()->set_host("lab-9"); }, "is a leading host's part, and so is"},
      {0, [](v1::Manifest& m) { m.mutable_hosts(0)->add_camera_ids("below"); },
       "has the cameras above, back, and lab-2:50051 recorded above, back, below"},
      {0, [](v1::Manifest& m) { m.mutable_hosts()->RemoveLast(); }, "names no part with its cameras"},
      {0, [](v1::Manifest& m) { m.mutable_hosts(1)->clear_clock(); }, "its clock was never read"},
      {0, [](v1::Manifest& m) { m.mutable_hosts(1)->mutable_clock(1)->set_at_ns(0); }, "isn't later"},
      {0, [](v1::Manifest& m) { m.mutable_hosts(1)->mutable_clock(1)->set_ahead_ns(0); }, "goes wrong by"},
  };
  record(test::three_hosts(), {.frames = 3});
  for (const Case& wrong : cases) {
    const std::string before = bytes_of(manifest_path(parts_[wrong.part]));
    change_manifest(parts_[wrong.part], wrong.change);
    expect_refused(ErrorKind::bad_input, wrong.why);
    test::put_bytes(manifest_path(parts_[wrong.part]), before);
  }
  join_well();
}

TEST_F(Join, ACameraOfTwoHostsIsRefused) {
  std::vector<PartHost> hosts = test::three_hosts();
  hosts[2].cameras = {"left"};
  record(hosts, {.frames = 3});
  expect_refused(ErrorKind::bad_input, "another part has the camera left too");
}

TEST_F(Join, AnEarlierSessionOrFolderIsNeverReplaced) {
  record(test::three_hosts(), {.frames = 3});
  join_well();
  const std::string before = bytes_of(manifest_path(out_));
  const auto again = join();
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(again.error().message(), HasSubstr("not an empty folder"));
  EXPECT_EQ(bytes_of(manifest_path(out_)), before);
  expect_whole();
}

TEST_F(Join, OfAPartWhoseRecorderWasKilledWhatWasSalvagedIsJoined) {
  std::vector<PartHost> hosts = test::three_hosts();
  record({hosts[0], hosts[1]});
  change_manifest(parts_[0],
                  [&](v1::Manifest& manifest) { *manifest.add_hosts() = test::told_of(hosts[2], {}); });
  parts_.push_back(temp_ / "parts/lab-3");
  {
    SessionWriter killed = test::begin_part(parts_.back(), hosts[2], {}, "lab-1");
    ASSERT_TRUE(killed.flush(0));
    ASSERT_TRUE(killed.sync());
    expect_refused(ErrorKind::refused, "another process writes it");
  }
  expect_refused(ErrorKind::refused, "sessions repair");
  ASSERT_TRUE(salvage(parts_.back()));
  const Joined joined = join_well();
  EXPECT_EQ(joined.manifest.state(), v1::Manifest::SALVAGED);
  EXPECT_GT(joined.manifest.cameras(4).counts().recorded(), 0U);
  expect_whole();
}

TEST_F(Join, EndedAnywhereItLeavesNothing) {
  record(test::three_hosts(), {.frames = 2});
  int calls = 0;
  ASSERT_TRUE(join(Missing::is_an_error, [&](double fraction, std::string_view) {
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    return ++calls > 0;
  }));
  fs::remove_all(out_);
  ASSERT_GT(calls, 10);
  for (int end = 1; end < calls; ++end) {
    int left = end;
    const auto ended = join(Missing::is_an_error, [&](double, std::string_view) { return --left > 0; });
    ASSERT_FALSE(ended) << end;
    EXPECT_EQ(ended.error().kind, ErrorKind::refused);
    expect_nothing_left();
  }
}

TEST_F(Join, ADamagedIndexIsRefused) {
  record(test::three_hosts(), {.frames = 3});
  const fs::path index = index_path(parts_[1], "back");
  test::put_bytes(index, bytes_of(index).substr(0, 100));
  expect_refused(ErrorKind::bad_input, "the index is damaged");
}

v1::ShutterTimes times_of(const std::vector<std::string>& cameras, double late) {
  v1::ShutterTimes times;
  for (const std::string& id : cameras) {
    v1::ShutterTimes::Camera& camera = *times.add_cameras();
    camera.set_camera_id(id);
    for (int i = 0; i < 3; ++i) camera.add_late_s(late + i);
  }
  return times;
}

TEST_F(Join, TimesOfAllPartsAreOnesAndOfSomeNone) {
  const std::vector<PartHost> hosts = test::three_hosts();
  record(hosts, {.frames = 3});
  for (std::size_t i = 0; i < 2; ++i)
    ASSERT_TRUE(write_shutter_times(parts_[i], times_of(hosts[i].cameras, 10.0 * static_cast<double>(i))));
  expect_refused(ErrorKind::bad_input, "has no times.json");
  ASSERT_TRUE(write_shutter_times(parts_[2], times_of(hosts[2].cameras, 20)));
  join_well();
  const auto session = SessionReader::open(out_);
  const auto times = read_shutter_times(*session);
  ASSERT_TRUE(times) << times.error().message();
  ASSERT_TRUE(times->has_value());
  EXPECT_EQ((*times)->cameras(0).late_s(2), 2);
  EXPECT_EQ((*times)->cameras(3).late_s(2), 12);
  EXPECT_EQ((*times)->cameras(4).late_s(0), 20);
}

/// It is of one part's files, and would call the others added.
TEST_F(Join, APartsCertificateIsNotTheSessions) {
  record(test::three_hosts(), {.frames = 3});
  ASSERT_TRUE(certify_session(parts_[0], "test", nullptr));
  join_well();
  EXPECT_FALSE(fs::exists(certificate_path(out_)));
  expect_whole();
}

/// Wherever a frame of a part was damaged since, the part is named and nothing is made.
TEST_F(Join, ADamagedPartIsRefused) {
  record(test::three_hosts());
  int damaged = 0;
  for (const fs::path& part : parts_)
    for (const auto& entry : fs::recursive_directory_iterator(part)) {
      const std::string extension = entry.path().extension();
      if (extension != ".nut" && extension != ".mkv") continue;
      const std::string bytes = bytes_of(entry.path());
      for (const double share : {0.3, 0.6, 0.9}) {
        std::string changed = bytes;
        changed.replace(static_cast<std::size_t>(share * static_cast<double>(bytes.size())), 8, "xxxxxxxx");
        test::put_bytes(entry.path(), changed);
        if (verify_session(part)->readable) continue;
        expect_refused(ErrorKind::refused, part.string());
        ++damaged;
      }
      test::put_bytes(entry.path(), bytes);
    }
  EXPECT_GE(damaged, 5);
  join_well();
}

}  // namespace
}  // namespace emberlock::session
