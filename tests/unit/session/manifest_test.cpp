// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gtest/gtest.h>

#include "session/events.h"
#include "session/files.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::TempFolder;

const ImageLayout kDescribedLayout{{640, 480}, PixelFormat::rgb16, 12};

std::string manifest_with(const std::string& camera_fields, const std::string& more = "") {
  return R"({"format_version": 1, "state": "COMPLETE", "cameras": [{"camera_id": "cam0", "format": "GRAY8",
            "width": 64, "height": 48, "bit_depth": 8)" +
         camera_fields + "}]" + more + "}";
}

TEST(Manifest, ComesBackAsItWasWritten) {
  const TempFolder temp;
  v1::Manifest manifest = test::manifest_of({kDescribedLayout});
  manifest.set_format_version(kSessionFormatVersion);
  manifest.mutable_cameras(0)->set_frame_rate_hz(0.1 + 0.2);
  for (int i = 0; i < 12; ++i)
    manifest.mutable_cameras(0)->mutable_calibration()->add_camera_from_world(i / 3.0);
  ASSERT_TRUE(write_manifest(temp.path(), manifest));
  const auto read = read_manifest(temp.path());
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(read->SerializeAsString(), manifest.SerializeAsString());
  EXPECT_EQ(*layout_of(read->cameras(0)), kDescribedLayout);
}

TEST(Manifest, AnErrorNamesFileAndField) {
  struct Case {
    std::string json;
    std::string names;
  };
  const Case cases[] = {
      {"", "manifest.json"},
      {"[]", "manifest.json"},
      {"{\"format_version\": 1, \"cameras\": [", "manifest.json"},
      {R"({"format_version": 2, "cameras": []})", "format_version"},
      {R"({"format_version": 1})", "cameras"},
      {manifest_with("", R"(, "shutter": 3)"), "shutter"},
      {manifest_with(R"(, "frame_rate_hz": "NaN")"), "frame_rate_hz"},
      {manifest_with(R"(, "frame_rate_hz": -1)"), "frame_rate_hz"},
      {manifest_with(R"(, "late_s": "NaN")"), "late_s"},
      {manifest_with(R"(, "late_s": -0.001)"), "late_s"},
      {manifest_with(R"(, "frame_rate_hz": 24, "late_s": 0.05)"), "late_s"},
      {manifest_with(R"(, "late_sigma_s": "Infinity")"), "late_sigma_s"},
      {manifest_with(R"(, "clock": [{"at_ns": 1}, {"at_ns": 1}])"), "clock"},
      {manifest_with(R"(, "calibration": {"camera_from_world": [1, 2, 3]})"), "calibration"},
      {manifest_with(R"(, "calibration": {"fx": "Infinity"})"), "calibration"},
      {manifest_with("", R"(, "box": {"center": [0, 0, 0], "size": [1, 0, 1]})"), "box"},
      {R"({"format_version": 1, "cameras": [{"camera_id": "../x", "format": "GRAY8", "width": 64, "height": 48,
          "bit_depth": 8}]})",
       "../x"},
      {R"({"format_version": 1, "cameras": [{"camera_id": "a", "format": "GRAY8", "width": 100000, "height": 48,
          "bit_depth": 8}]})",
       "width"},
      {R"({"format_version": 1, "cameras": [{"camera_id": "a", "format": "GRAY8", "width": 64, "height": 48,
          "bit_depth": 12}]})",
       "bit_depth"},
      {R"({"format_version": 1, "cameras": [{"camera_id": "a", "width": 64, "height": 48, "bit_depth": 8}]})",
       "format"},
  };
  for (const Case& c : cases) {
    const auto parsed = parse_manifest(c.json, "manifest.json");
    ASSERT_FALSE(parsed) << c.json;
    EXPECT_EQ(parsed.error().kind, ErrorKind::bad_input);
    EXPECT_NE(parsed.error().message().find(c.names), std::string::npos) << parsed.error().message();
    EXPECT_NE(parsed.error().message().find("manifest.json"), std::string::npos) << parsed.error().message();
  }
  EXPECT_TRUE(parse_manifest(manifest_with(""), "manifest.json"));
}

/// Earlier writers took such words.
TEST(Manifest, WordsThatNoWriterTakesAnyMoreAreRead) {
  const auto parsed = parse_manifest(manifest_with("", R"(, "purpose": "two\nlines")"), "manifest.json");
  ASSERT_TRUE(parsed) << parsed.error().message();
  EXPECT_FALSE(check_texts(*parsed, "manifest.json"));
}

TEST(Manifest, DeeplyNestedJsonIsRefusedWithoutACrash) {
  std::string json = R"({"cameras": )";
  for (int i = 0; i < 100'000; ++i) json += '[';
  EXPECT_FALSE(parse_manifest(json, "manifest.json"));
}

TEST(Manifest, OfAFolderWithoutOneIsNoSession) {
  const TempFolder temp;
  const auto read = read_manifest(temp.path());
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message().find(temp.path().string()), std::string::npos);
}

TEST(EventsThreads, TornAtEveryByteKeepTheEventsBefore) {
  std::string whole;
  std::vector<std::size_t> ends{0};
  for (int i = 0; i < 4; ++i) {
    v1::Event event;
    event.set_monotonic_ns(i);
    event.set_note(std::string(static_cast<std::size_t>(i) * 70, 'n'));  // lengths of one and of two bytes
    whole += encode(event);
    ends.push_back(whole.size());
  }
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    const ParsedEvents parsed = parse_events(std::string_view(whole).substr(0, cut));
    const auto kept =
        static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), cut) - ends.begin()) - 1;
    ASSERT_EQ(parsed.events.size(), kept) << cut;
    ASSERT_EQ(parsed.valid_bytes, ends[kept]) << cut;
  }
}

TEST(EventsThreads, ALengthBeyondTheFileIsATornEnd) {
  EXPECT_TRUE(parse_events(std::string_view("\xff\xff\xff\xff\x0f", 5)).events.empty());
  EXPECT_TRUE(
      parse_events(std::string_view("\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff", 11)).events.empty());
}

}  // namespace
}  // namespace emberlock::session
