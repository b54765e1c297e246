// SPDX-License-Identifier: Apache-2.0
#include "session/shutter_times.h"

#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::TempFolder;
using testing::HasSubstr;

/// Two cameras of three and two frames.
SessionReader session_of_two(const TempFolder& temp) {
  const ImageLayout layout{{16, 16}, PixelFormat::gray8, 8};
  auto writer =
      SessionWriter::create(temp / "s", test::manifest_of({layout, layout}), test::small_disk_options())
          .value();
  for (std::uint64_t i = 0; i < 3; ++i) EXPECT_TRUE(writer.write(0, test::noise_frame(layout, i)).ok());
  for (std::uint64_t i = 0; i < 2; ++i) EXPECT_TRUE(writer.write(1, test::noise_frame(layout, i)).ok());
  EXPECT_TRUE(writer.finish().ok());
  return SessionReader::open(temp / "s").value();
}

v1::ShutterTimes times_of_two() {
  v1::ShutterTimes times;
  v1::ShutterTimes::Camera& second = *times.add_cameras();
  second.set_camera_id("cam1");
  second.set_sigma_s(2e-6);
  for (const double late : {-0.0031, 0.0001}) second.add_late_s(late);
  v1::ShutterTimes::Camera& first = *times.add_cameras();
  first.set_camera_id("cam0");
  for (const double late : {0.0, 1.0 / 3, -1e-9}) first.add_late_s(late);
  return times;
}

TEST(ShutterTimes, AbsentAreNoTimesAndNoError) {
  const TempFolder temp;
  const auto times = read_shutter_times(session_of_two(temp));
  ASSERT_TRUE(times.ok());
  EXPECT_FALSE(times->has_value());
}

TEST(ShutterTimes, ComeBackToTheLastBitInTheManifestsOrder) {
  const TempFolder temp;
  const SessionReader session = session_of_two(temp);
  ASSERT_TRUE(write_shutter_times(session.folder(), times_of_two()).ok());
  const auto times = read_shutter_times(session);
  ASSERT_TRUE(times.ok()) << times.error().message();
  ASSERT_TRUE(times->has_value());
  ASSERT_EQ((*times)->cameras_size(), 2);
  EXPECT_EQ((*times)->cameras(0).camera_id(), "cam0");
  EXPECT_EQ((*times)->cameras(0).late_s(1), 1.0 / 3);
  EXPECT_EQ((*times)->cameras(0).sigma_s(), 0);
  EXPECT_EQ((*times)->cameras(1).late_s(0), -0.0031);
  EXPECT_EQ((*times)->cameras(1).sigma_s(), 2e-6);
}

TEST(ShutterTimes, ThatDontFitTheSessionNameWhatDoesnt) {
  const TempFolder temp;
  const SessionReader session = session_of_two(temp);
  const auto refusal = [&](const auto& spoil) {
    v1::ShutterTimes times = times_of_two();
    spoil(times);
    EXPECT_TRUE(write_shutter_times(session.folder(), times).ok());
    const auto read = read_shutter_times(session);
    EXPECT_FALSE(read.ok());
    return read.ok() ? std::string() : read.error().message();
  };
  EXPECT_THAT(refusal([](auto& t) { t.mutable_cameras(1)->add_late_s(0); }),
              AllOf(HasSubstr("cam0"), HasSubstr("late_s"), HasSubstr("4 times"), HasSubstr("3 frames")));
  EXPECT_THAT(refusal([](auto& t) { t.mutable_cameras()->RemoveLast(); }), HasSubstr("camera cam0"));
  EXPECT_THAT(refusal([](auto& t) { *t.add_cameras() = t.cameras(0); }), HasSubstr("twice"));
  EXPECT_THAT(refusal([](auto& t) { t.add_cameras()->set_camera_id("cam2"); }), HasSubstr("no such camera"));
}

TEST(ShutterTimes, OfNoFiniteNumberAreNeitherWrittenNorRead) {
  const TempFolder temp;
  const SessionReader session = session_of_two(temp);
  v1::ShutterTimes times = times_of_two();
  times.mutable_cameras(0)->set_late_s(1, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(write_shutter_times(session.folder(), times).error().message(), HasSubstr("late_s"));
  times = times_of_two();
  times.mutable_cameras(0)->set_sigma_s(-1);
  EXPECT_THAT(write_shutter_times(session.folder(), times).error().message(), HasSubstr("sigma_s"));
  for (const char* json : {R"({"cameras":[{"camera_id":"cam0","late_s":["NaN"]}]})",
                           R"({"cameras":[{"camera_id":"cam0","sigma_s":"Infinity"}]})", "[]", "", "{"})
    EXPECT_FALSE(parse_shutter_times(json, "times.json").ok()) << json;
}

}  // namespace
}  // namespace emberlock::session
