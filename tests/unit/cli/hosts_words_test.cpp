// SPDX-License-Identifier: Apache-2.0
// What the command line shows of a rig whose cameras are several hosts', against a real server and a daemon
// without devices.
#include "cli/hosts_words.h"

#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "session/writer.h"
#include "tests/support/grpc_server.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

v1::HostStatus host(const std::string& name, bool connected, const std::string& reason) {
  v1::HostStatus host;
  host.set_host(name);
  host.set_connected(connected);
  host.set_light(connected ? v1::GREEN : v1::RED);
  host.set_reason(reason);
  host.set_cameras(3);
  return host;
}

v1::HostPart part(const std::string& name, v1::HostPart::State state, std::uint64_t frames,
                  const std::string& why = "") {
  v1::HostPart part;
  part.set_host(name);
  part.set_state(state);
  part.set_why(why);
  part.set_frames(frames);
  for (const char* camera : {"left", "right"}) part.add_camera_ids(camera);
  return part;
}

TEST(HostsWords, AClockIsAheadOrBehindAndOnlyKnownSoWell) {
  EXPECT_EQ(clock_in_words(5, 80e-6), "5.000 s ahead ± 80 us");
  EXPECT_EQ(clock_in_words(-0.0321, 0.0015), "32.1 ms behind ± 1.5 ms");
  EXPECT_EQ(clock_in_words(0, 42e-6), "0 us ahead ± 42 us");
  EXPECT_EQ(clock_in_words(-120e-6, 42e-6), "120 us behind ± 42 us");
}

TEST(HostsWords, AHostSaysWhetherItAnswersAndWhyNot) {
  v1::HostStatus there = host("lab-2:7143", true, "answers");
  there.set_clock_ahead_s(5);
  there.set_clock_sigma_s(80e-6);
  there.set_round_trip_s(160e-6);
  EXPECT_EQ(host_line(there),
            "lab-2:7143: green, connected, 3 cameras, clock 5.000 s ahead ± 80 us, round trip 160 us");
  v1::HostStatus gone = host("lab-3:7143", false, "it doesn't answer");
  gone.set_cameras(1);
  gone.set_parts_wanting(2);
  gone.set_round_trip_s(160e-6);
  EXPECT_EQ(host_line(gone), "lab-3:7143: red, not connected, 1 camera, 2 parts wanting: it doesn't answer")
      << "its round trip was an earlier one's";
}

TEST(HostsWords, APartSaysHowFarItIsOrWhyItIsNotThere) {
  v1::HostPart whole = part("lab-2:7143", v1::HostPart::WHOLE, 240);
  EXPECT_EQ(part_line(whole), "lab-2:7143: whole, 2 cameras, 240 frames, none lost");
  whole.set_lost(2);
  EXPECT_EQ(part_line(whole), "lab-2:7143: whole, 2 cameras, 240 frames, 2 lost");
  EXPECT_EQ(part_line(part("lab-3:7143", v1::HostPart::RECORDING, 0)), "lab-3:7143: recording, 2 cameras");
  EXPECT_EQ(part_line(part("lab-3:7143", v1::HostPart::MISSING, 0, "it doesn't answer")),
            "lab-3:7143: missing, 2 cameras: it doesn't answer");
  EXPECT_EQ(
      part_line(
          part("lab-3:7143", v1::HostPart::SHORT, 72, "its frames end 3.0 s before the recording does")),
      "lab-3:7143: short, 2 cameras, 72 frames, none lost: its frames end 3.0 s before the recording does");
}

TEST(HostsWords, PartsAreCountedByWhatIsKnownOfThem) {
  v1::RecordingStatus recording;
  EXPECT_EQ(parts_in_words(recording), "");
  *recording.add_hosts() = part("a:1", v1::HostPart::MISSING, 0);
  EXPECT_EQ(parts_in_words(recording), "1 other host: 1 missing");
  *recording.add_hosts() = part("b:1", v1::HostPart::RECORDING, 0);
  *recording.add_hosts() = part("c:1", v1::HostPart::RECORDING, 0);
  EXPECT_EQ(parts_in_words(recording), "3 other hosts: 2 recording, 1 missing");
}

TEST(HostsWords, WhatIsNeitherWholeNorStillRecordedIsWanting) {
  EXPECT_FALSE(is_wanting(part("a:1", v1::HostPart::WHOLE, 1)));
  EXPECT_FALSE(is_wanting(part("a:1", v1::HostPart::RECORDING, 1)));
  EXPECT_TRUE(is_wanting(part("a:1", v1::HostPart::MISSING, 1)));
  EXPECT_TRUE(is_wanting(part("a:1", v1::HostPart::SHORT, 1)));
}

TEST(HostsWords, AListedSessionSaysWhereItsPartsAreAndWhoLedIt) {
  v1::ListSessionsResponse::Entry session;
  EXPECT_EQ(hosts_in_words(session), "");
  session.set_hosts(1);
  EXPECT_EQ(hosts_in_words(session), "parts on 1 other host");
  session.set_hosts(2);
  session.set_hosts_wanting(1);
  EXPECT_EQ(hosts_in_words(session), "parts on 2 other hosts, 1 wanting");
  session.Clear();
  session.set_led_by("dome at lab-1");
  EXPECT_EQ(hosts_in_words(session), "led by dome at lab-1");
}

class HostsVerbs : public test::GrpcServerTest {
 protected:
  HostsVerbs() { serve(); }
  test::VerbRun run(test::AddVerb add, std::vector<std::string> words) const {
    words.insert(words.end(), {"--daemon", "unix:" + socket.string()});
    return test::run_verb(add, std::move(words));
  }
};

TEST_F(HostsVerbs, StatusHasALineForEachHostPartAndCameraElsewhere) {
  v1::DaemonStatus status;
  status.set_rig("dome");
  v1::HostStatus& second = *status.add_hosts() = host("lab-2:7143", true, "answers");
  second.set_clock_ahead_s(-5);
  second.set_clock_sigma_s(80e-6);
  *status.add_hosts() = host("lab-3:7143", false, "it doesn't answer");
  v1::CameraStatus& own = *status.add_cameras();
  own.set_id("near");
  v1::CameraStatus& far = *status.add_cameras();
  far.set_id("far");
  far.set_host("lab-2:7143");
  far.set_reason("Films.");
  v1::RecordingStatus& recording = *status.mutable_recording();
  recording.set_session("candle");
  *recording.add_hosts() = part("lab-2:7143", v1::HostPart::WHOLE, 240);
  *recording.add_hosts() = part("lab-3:7143", v1::HostPart::MISSING, 0, "it doesn't answer");
  api.board().show(status);
  const test::VerbRun screen = run(add_status, {"status"});
  EXPECT_EQ(screen.exit_code, 0) << screen.err;
  EXPECT_THAT(
      screen.out,
      AllOf(HasSubstr("\nhosts\n  lab-2:7143: green, connected, 3 cameras, clock 5.000 s behind ± 80 us\n"
                      "  lab-3:7143: red, not connected, 3 cameras: it doesn't answer\ncameras\n"),
            HasSubstr("  on lab-2:7143  Films.\n"),
            HasSubstr("           lab-2:7143: whole, 2 cameras, 240 frames, none lost\n"
                      "           lab-3:7143: missing, 2 cameras: it doesn't answer\n"),
            Not(HasSubstr("lent"))));
  EXPECT_EQ(json::parse(run(add_status, {"status", "--json"}).out)["recording"]["hosts"][1]["state"],
            "MISSING");
}

TEST_F(HostsVerbs, StatusOfALendingHostSaysWhoHasItsCameras) {
  v1::DaemonStatus status;
  status.set_lent_to("dome at lab-1");
  api.board().show(status);
  EXPECT_THAT(
      run(add_status, {"status"}).out,
      AllOf(HasSubstr("lent to    dome at lab-1: align and record there\n"), Not(HasSubstr("hosts\n"))));
}

v1::DaemonStatus recorded(v1::RecordingStatus::State state, v1::HostPart::State second) {
  v1::DaemonStatus status;
  v1::RecordingStatus& recording = *status.mutable_recording();
  recording.set_session("candle");
  recording.set_state(state);
  recording.set_verdict("Every frame is accounted for.");
  *recording.add_hosts() = part("lab-2:7143", second, 240, second == v1::HostPart::MISSING ? "gone" : "");
  return status;
}

TEST_F(HostsVerbs, RecordEndsWithTheOtherHostsPartsAndFailsWhereOneIsWanting) {
  for (const auto& [state, code, words] : std::vector<std::tuple<v1::HostPart::State, int, std::string>>{
           {v1::HostPart::WHOLE, 0, "lab-2:7143: whole, 2 cameras, 240 frames, none lost\n"},
           {v1::HostPart::RECORDING, 0, "lab-2:7143: recording, 2 cameras, 240 frames, none lost\n"},
           {v1::HostPart::MISSING, 1, "lab-2:7143: missing, 2 cameras, 240 frames, none lost: gone\n"}}) {
    const v1::RecordingStatus last = recorded(v1::RecordingStatus::COMPLETE, state).recording();
    api.on_stop_recording = [last] { return Result<v1::RecordingStatus>(last); };
    const test::VerbRun stopped = run(add_record, {"record", "--stop"});
    EXPECT_EQ(stopped.exit_code, code) << words;
    EXPECT_THAT(stopped.out, testing::EndsWith("Every frame is accounted for.\n" + words));
    EXPECT_EQ(run(add_record, {"record", "--stop", "--json"}).exit_code, code);
  }
}

TEST_F(HostsVerbs, RecordTellsOfTheOtherHostsAsItGoesOn) {
  const v1::DaemonStatus alone = recorded(v1::RecordingStatus::RECORDING, v1::HostPart::MISSING);
  std::thread later;
  api.on_record = [&](const v1::RecordRequest&) {
    api.board().show(alone);
    later = std::thread([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      api.board().show(recorded(v1::RecordingStatus::COMPLETE, v1::HostPart::WHOLE));
    });
    return Result<v1::RecordingStatus>(alone.recording());
  };
  const test::VerbRun result = run(add_record, {"record", "candle"});
  later.join();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("queue 0 %; 1 other host: 1 missing\n"));
  EXPECT_THAT(result.out, testing::EndsWith("lab-2:7143: whole, 2 cameras, 240 frames, none lost\n"));
}

TEST_F(HostsVerbs, SessionsListMarksWhatHasPartsElsewhere) {
  api.on_list_sessions = [] {
    v1::ListSessionsResponse response;
    v1::ListSessionsResponse::Entry& led = *response.add_sessions();
    led.set_session("led");
    led.set_calibrated(true);
    led.set_hosts(2);
    led.set_hosts_wanting(1);
    response.add_sessions()->set_led_by("dome at lab-1");
    return Result<v1::ListSessionsResponse>(response);
  };
  const std::string listed = run(add_sessions, {"sessions", "list"}).out;
  EXPECT_THAT(listed, HasSubstr("  calibrated  parts on 2 other hosts, 1 wanting\n"));
  EXPECT_THAT(listed, HasSubstr("MB  led by dome at lab-1\n"));
}

TEST(SessionsOfHosts, AFolderOfSessionsIsListedLikewise) {
  const test::TempFolder temp;
  const ImageLayout layout{{64, 48}, PixelFormat::gray8, 8};
  v1::Manifest manifest = test::manifest_of({layout});
  *manifest.add_hosts() = part("lab-2:7143", v1::HostPart::SHORT, 12, "It was started again.");
  ASSERT_TRUE(session::SessionWriter::create(temp / "led", manifest, test::small_disk_options())->finish());
  test::record(temp / "alone", layout, 1, test::small_disk_options());
  const std::string listed = test::run_verb(add_sessions, {"sessions", "list", temp.path().string()}).out;
  EXPECT_THAT(listed, HasSubstr("parts on 1 other host, 1 wanting\n"));
  const std::string alone = listed.substr(listed.find("alone"));
  EXPECT_THAT(alone.substr(0, alone.find('\n')), Not(HasSubstr("host")));
}

}  // namespace
}  // namespace emberlock::cli
