// SPDX-License-Identifier: Apache-2.0
// Metrics, read back by the grammar of Prometheus' text format 0.0.4 and compared with what they speak of.
#include <ctime>
#include <limits>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>

#include "daemon/server/metrics.h"
#include "tests/support/recording.h"

namespace emberlock::daemon {
namespace {

using testing::Contains;
using testing::Key;
using testing::Not;
using testing::Pair;

/// Samples by name and labels as they were written; what breaks the grammar fails the test.
std::map<std::string, double> parse(const std::string& text) {
  static const std::regex help(R"(# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) ([^\\]|\\\\|\\n)+)");
  static const std::regex type(R"(# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (counter|gauge))");
  static const std::regex sample(
      R"(([a-zA-Z_:][a-zA-Z0-9_:]*)(\{([a-zA-Z_][a-zA-Z0-9_]*="([^"\\]|\\\\|\\"|\\n)*"(,|(?=\})))+\})? (\S+))");
  EXPECT_TRUE(text.ends_with('\n'));
  std::map<std::string, double> samples;
  std::set<std::string> families;
  std::string helped, family, kind;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, help)) {
      helped = match[1];
    } else if (std::regex_match(line, match, type)) {
      family = match[1];
      kind = match[2];
      EXPECT_EQ(family, helped) << "has no words";
      EXPECT_TRUE(families.insert(family).second) << family << " is begun twice";
      EXPECT_EQ(kind == "counter", family.ends_with("_total")) << family;
    } else if (std::regex_match(line, match, sample)) {
      EXPECT_EQ(match[1], family) << "is outside its family";
      std::size_t used = 0;
      const std::string number = match[6];
      const double value = std::stod(number, &used);
      EXPECT_EQ(used, number.size()) << line;
      EXPECT_TRUE(samples.emplace(match[1].str() + match[2].str(), value).second) << line << " comes twice";
    } else {
      ADD_FAILURE() << "breaks the grammar: " << line;
    }
  }
  return samples;
}

v1::DaemonStatus busy() {
  v1::DaemonStatus status;
  status.set_version("1.2");
  status.set_phase(v1::CAPTURING);
  status.set_light(v1::AMBER);
  for (const bool over : {false, false, true}) {
    v1::Fault& fault = *status.add_faults();
    fault.set_kind(v1::Fault::CAMERA_LOST);
    fault.set_over(over);
  }
  status.mutable_alignment()->set_round(7);
  status.mutable_alignment()->set_tolerance_s(0.0054);
  status.mutable_alignment()->set_worst_pair_s(0.001);
  for (const char* id : {"a", "b"}) {
    v1::CameraStatus& camera = *status.add_cameras();
    camera.set_id(id);
    camera.set_state(v1::CameraStatus::FILMING);
    camera.mutable_counts()->set_delivered(18'446'744'073'709'551'000U);
    camera.mutable_counts()->set_transport(3);
    camera.set_measured_rate_hz(23.976);
    camera.set_resets(2);
  }
  status.mutable_cameras(0)->set_error_s(-1.5e-5);
  status.mutable_recording()->set_state(v1::RecordingStatus::RECORDING);
  status.mutable_recording()->set_frames(480);
  status.mutable_recording()->mutable_lost()->set_queue(4);
  status.mutable_storage()->set_minutes_left(2.5);
  status.mutable_reconstruction()->add_iterations();
  v1::HostStatus& host = *status.add_hosts();
  host.set_host("lab-2:7143");
  host.set_connected(true);
  host.set_round_trip_s(0.0005);
  host.set_parts_wanting(2);
  return status;
}

TEST(ServerMetrics, EverySampleIsTheStatusValue) {
  const auto samples =
      parse(metrics_text(busy(), {.cpu_s = 1.5, .resident_bytes = 1000, .open_files = 9, .start_s = 1.7e9},
                         {.viewers = 3, .other_watchers = 2, .refused = {{"http", {0, 7, 0, 0, 0, 1}}}}));
  const std::map<std::string, double> expected{
      {R"(emberlock_build_info{version="1.2"})", 1},
      {R"(emberlock_phase{state="capturing"})", 1},
      {R"(emberlock_phase{state="idle"})", 0},
      {R"(emberlock_light{state="amber"})", 1},
      {R"(emberlock_light{state="red"})", 0},
      {R"(emberlock_faults{kind="camera_lost"})", 2},
      {R"(emberlock_faults{kind="disk_low"})", 0},
      {"emberlock_alignment_round", 7},
      {"emberlock_alignment_tolerance_seconds", 0.0054},
      {"emberlock_alignment_worst_pair_seconds", 0.001},
      {R"(emberlock_camera_state{camera="a",state="filming"})", 1},
      {R"(emberlock_camera_state{camera="b",state="lost"})", 0},
      {R"(emberlock_camera_frames_total{camera="a",fate="delivered"})", 18'446'744'073'709'551'000.0},
      {R"(emberlock_camera_frames_total{camera="b",fate="transport"})", 3},
      {R"(emberlock_camera_frame_rate_hertz{camera="a"})", 23.976},
      {R"(emberlock_camera_error_seconds{camera="a"})", -1.5e-5},
      {R"(emberlock_camera_resets_total{camera="b"})", 2},
      {R"(emberlock_recording_state{state="recording"})", 1},
      {"emberlock_recording_frames", 480},
      {R"(emberlock_recording_counts{fate="queue"})", 4},
      {"emberlock_storage_time_left_seconds", 150},
      {"emberlock_reconstruction_iterations", 1},
      {R"(emberlock_host_connected{host="lab-2:7143"})", 1},
      {R"(emberlock_host_round_trip_seconds{host="lab-2:7143"})", 0.0005},
      {R"(emberlock_host_parts_wanting{host="lab-2:7143"})", 2},
      {R"(emberlock_watchers{by="console"})", 3},
      {R"(emberlock_watchers{by="grpc"})", 2},
      {R"(emberlock_refused_total{by="http",reason="wrong_token"})", 7},
      {R"(emberlock_refused_total{by="http",reason="foreign_origin"})", 1},
      {R"(emberlock_refused_total{by="http",reason="wrong_link"})", 0},
      {"process_cpu_seconds_total", 1.5},
      {"process_resident_memory_bytes", 1000},
      {"process_open_fds", 9},
      {"process_start_time_seconds", 1.7e9},
  };
  for (const auto& [name, value] : expected) EXPECT_THAT(samples, Contains(Pair(name, value)));
  // What isn't known is no sample, rather than 0.
  EXPECT_THAT(samples, Not(Contains(Key(R"(emberlock_camera_error_seconds{camera="b"})"))));
  EXPECT_THAT(samples, Not(Contains(Key("emberlock_alignment_time_left_seconds"))));
}

TEST(ServerMetrics, OneStateOfEachThingHoldsAndEveryFateIsTold) {
  const v1::DaemonStatus status = busy();
  std::map<std::string, double> sums;
  int fates = 0;
  for (const auto& [name, value] : parse(metrics_text(status, {}, {}))) {
    if (const std::size_t at = name.find("state="); at != std::string::npos)
      sums[name.substr(0, at)] += value;
    if (name.starts_with(R"(emberlock_camera_frames_total{camera="a")")) ++fates;
  }
  for (const auto& [name, sum] : sums)
    EXPECT_EQ(sum, name.starts_with("emberlock_reconstruction") ? 0 : 1) << name;
  EXPECT_EQ(sums.size(), 6U);  // phase, light, recording, reconstruction, two cameras
  EXPECT_EQ(fates, v1::CameraCounts::descriptor()->field_count());
}

TEST(ServerMetrics, BeforeAnythingIsKnownTheGrammarHolds) {
  EXPECT_THAT(parse(metrics_text({}, {}, {})), Contains(Pair(R"(emberlock_phase{state="idle"})", 0)));
}

TEST(ServerMetrics, WhateverACameraIsCalledTheGrammarHolds) {
  v1::DaemonStatus status;
  status.add_cameras()->set_id("say \"x\"\nor \\n} 1");
  EXPECT_THAT(parse(metrics_text(status, {}, {})),
              Contains(Pair(R"(emberlock_camera_resets_total{camera="say \"x\"\nor \\n} 1"})", 0)));
}

TEST(ServerMetrics, NumbersThatAreNoneAreWrittenAsPrometheusReadsThem) {
  v1::DaemonStatus status;
  status.mutable_alignment()->set_worst_pair_s(std::numeric_limits<double>::infinity());
  status.mutable_alignment()->set_time_left_s(std::numeric_limits<double>::quiet_NaN());
  const std::string text = metrics_text(status, {}, {});
  EXPECT_THAT(text, testing::HasSubstr("\nemberlock_alignment_worst_pair_seconds +Inf\n"));
  EXPECT_THAT(text, testing::HasSubstr("\nemberlock_alignment_time_left_seconds NaN\n"));
}

TEST(ServerMetrics, OfThisProcessTheSystemsCountsAreTold) {
  const ProcessUsage usage = process_usage();
  EXPECT_GT(usage.resident_bytes, 1U << 20);
  EXPECT_GE(usage.open_files, 3U);
  const double now = static_cast<double>(std::time(nullptr));
  EXPECT_GT(usage.start_s, now - 86400);
  EXPECT_LE(usage.start_s, now + 1);
  EXPECT_GE(process_usage().cpu_s, usage.cpu_s);
}

// What the dashboard and the alerts ask for is what there is: a metric, with a value of its label where they
// name one.
TEST(ServerMetrics, DashboardAndAlertsAskForWhatThereIs) {
  v1::DaemonStatus status = busy();
  status.mutable_alignment()->set_time_left_s(60);
  for (v1::CameraStatus& camera : *status.mutable_cameras()) {
    camera.set_error_s(0);
    camera.set_drift_ppm(1);
  }
  const std::map<std::string, double> samples =
      parse(metrics_text(status, process_usage(), {.refused = {{"http", {}}}}));
  std::set<std::string> families;
  std::set<std::string> labels;
  for (const auto& [sample, value] : samples) {
    families.insert(sample.substr(0, sample.find('{')));
    static const std::regex label(R"re((\w+)="([^"]*)")re");
    for (std::sregex_iterator at(sample.begin(), sample.end(), label), end; at != end; ++at)
      labels.insert((*at)[1].str() + "=" + (*at)[2].str());
  }
  for (const char* file : {"grafana.json", "alerts.yaml"}) {
    const std::string text = test::bytes_of(std::string(EMBERLOCK_SOURCE_DIR "/daemon/system/") + file);
    static const std::regex metric(R"(\b(emberlock_|process_)\w+)");
    std::size_t asked = 0;
    for (std::sregex_iterator at(text.begin(), text.end(), metric), end; at != end; ++at, ++asked)
      EXPECT_TRUE(families.contains(at->str())) << file << " asks for " << at->str();
    EXPECT_GT(asked, 5U) << file;
    static const std::regex chosen(R"re((fate|state)\W*=~?\\?"([\w|]+))re");
    for (std::sregex_iterator at(text.begin(), text.end(), chosen), end; at != end; ++at) {
      std::istringstream values((*at)[2].str());
      for (std::string value; std::getline(values, value, '|');)
        EXPECT_TRUE(labels.contains((*at)[1].str() + "=" + value)) << file << " asks for " << at->str();
    }
  }
}

}  // namespace
}  // namespace emberlock::daemon
