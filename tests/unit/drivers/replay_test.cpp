// SPDX-License-Identifier: Apache-2.0
#include "drivers/replay/replay.h"

#include <limits>

#include <gtest/gtest.h>

#include "drivers/replay/record.h"
#include "tests/support/recording.h"

namespace emberlock::drivers {
namespace {

using test::noise_frame;
using test::TempFolder;

const ImageLayout kLayout{{32, 24}, PixelFormat::gray16, 12};

CameraInfo info_of(const std::string& id) {
  return {id,
          "a model",
          kLayout,
          Hertz(23.976),
          ShutterReset::on_command,
          FrameRateTrim{PartsPerMillion(100), PartsPerMillion(0.5), milliseconds(80)},
          id == "left" ? SensorKind::rolling_shutter : SensorKind::global_shutter};
}

StrobeSettings flashing(double phase_ms) {
  StrobeSettings s;
  s.output = StrobeOutput::flashing;
  s.phase = milliseconds(phase_ms);
  s.code = {true, false, true};
  return s;
}

/// Strobe, two frames of each of two cameras, resets of both, the strobe again, two more frames.
void record_run(const std::filesystem::path& folder) {
  v1::Manifest manifest;
  for (const char* id : {"left", "right"}) *manifest.add_cameras() = to_proto(info_of(id));
  auto writer = session::SessionWriter::create(folder, manifest, test::small_disk_options());
  ASSERT_TRUE(writer) << writer.error().message();
  ASSERT_TRUE(writer->append(strobe_event({1'000'000'001}, flashing(1))));
  const auto film = [&](std::uint64_t from) {
    for (std::uint64_t i = from; i < from + 2; ++i) {
      for (std::size_t c = 0; c < 2; ++c) ASSERT_TRUE(writer->write(c, noise_frame(kLayout, i, c + 1)));
    }
  };
  film(0);
  v1::Event decision;
  decision.mutable_decision()->set_json("{}");
  ASSERT_TRUE(writer->append(decision));
  ASSERT_TRUE(writer->append(reset_event({1'015'000'007}, "right", {1'020'000'000})));
  ASSERT_TRUE(writer->append(reset_event({1'015'000'900}, "left", {1'021'000'000})));
  ASSERT_TRUE(writer->append(trim_event({1'015'500'000}, "left", PartsPerMillion(-12.5))));
  ASSERT_TRUE(writer->append(strobe_event({1'016'000'000}, flashing(2))));
  film(2);
  ASSERT_TRUE(writer->finish());
}

class ReplayThreads : public testing::Test {
 protected:
  void SetUp() override {
    record_run(temp_ / "s");
    auto rig = ReplayRig::open(temp_ / "s");
    ASSERT_TRUE(rig) << rig.error().message();
    rig_ = std::move(rig).value();
    for (auto& camera : rig_.cameras) ASSERT_TRUE(camera->start());
  }
  void film(std::uint64_t from) {
    for (std::uint64_t i = from; i < from + 2; ++i) {
      for (std::size_t c = 0; c < 2; ++c) {
        const auto frame = rig_.cameras[c]->next_frame(Seconds(1));
        ASSERT_TRUE(frame) << frame.error().message();
        EXPECT_EQ(frame->stamp, noise_frame(kLayout, i, c + 1).stamp);
        EXPECT_EQ(*frame->image, *noise_frame(kLayout, i, c + 1).image);
      }
    }
  }

  TempFolder temp_;
  ReplayRig rig_;
};

TEST_F(ReplayThreads, CamerasAreDescribedAsTheyWereRecorded) {
  const CameraInfo& info = rig_.cameras.at(1)->info();
  EXPECT_EQ(info.id, "right");
  EXPECT_EQ(info.model, "a model");
  EXPECT_EQ(info.layout, kLayout);
  EXPECT_EQ(info.frame_rate, Hertz(23.976));
  EXPECT_EQ(info.reset, ShutterReset::on_command);
  EXPECT_EQ(info.sensor, SensorKind::global_shutter);
  EXPECT_EQ(rig_.cameras.at(0)->info().sensor, SensorKind::rolling_shutter);
  ASSERT_TRUE(info.trim);
  EXPECT_EQ(info.trim->step, PartsPerMillion(0.5));
}

TEST_F(ReplayThreads, TheRecordedCourseComesBackWithTheInstantsThatTheLiveRunSaw) {
  ASSERT_TRUE(rig_.strobe->apply(flashing(1)));
  const auto state = rig_.strobe->read_back();
  ASSERT_TRUE(state);
  EXPECT_EQ(*state, flashing(1));
  EXPECT_EQ(rig_.clock->now().ns, 1'000'000'001);
  film(0);
  EXPECT_EQ(rig_.clock->now().ns, 1'015'000'007);
  ASSERT_TRUE(rig_.cameras[1]->reset_shutter({1'020'000'000}));
  EXPECT_EQ(rig_.clock->now().ns, 1'015'000'900);
  ASSERT_TRUE(rig_.cameras[0]->reset_shutter({1'021'000'000}));
  EXPECT_EQ(rig_.clock->now().ns, 1'015'500'000);
  ASSERT_TRUE(rig_.cameras[0]->trim_rate(PartsPerMillion(-12.5)));
  ASSERT_TRUE(rig_.strobe->apply(flashing(2)));
  EXPECT_EQ(rig_.strobe->read_back()->phase, milliseconds(2));
  EXPECT_EQ(rig_.clock->now().ns, 1'016'000'000);
  film(2);
  EXPECT_EQ(rig_.clock->now().ns, noise_frame(kLayout, 3).stamp.monotonic_time.ns);
  const auto end = rig_.cameras[0]->next_frame(Seconds(1));
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().kind, ErrorKind::out_of_data);
}

TEST_F(ReplayThreads, AResetThatWasNotRecordedIsADeviceError) {
  ASSERT_TRUE(rig_.cameras[0]->reset_shutter({1'021'000'000}));
  const Status again = rig_.cameras[0]->reset_shutter({1'021'000'000});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, ErrorKind::device);
}

TEST_F(ReplayThreads, AResetForAnotherInstantIsADeviceErrorThatSaysBoth) {
  const Status status = rig_.cameras[0]->reset_shutter({1'021'000'001});
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::device);
  EXPECT_NE(status.error().message().find("1021000000"), std::string::npos);
  EXPECT_NE(status.error().message().find("1021000001"), std::string::npos);
}

TEST_F(ReplayThreads, ATrimThatWasRecordedOtherwiseIsADeviceError) {
  EXPECT_EQ(rig_.cameras[0]->trim_rate(PartsPerMillion(-12.5)).error().kind,
            ErrorKind::device);  // a reset is due
  ASSERT_TRUE(rig_.cameras[0]->reset_shutter({1'021'000'000}));
  const Status other = rig_.cameras[0]->trim_rate(PartsPerMillion(12.5));
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().message().find("-12.5"), std::string::npos);
  EXPECT_TRUE(rig_.cameras[0]->trim_rate(PartsPerMillion(-12.5)));
  EXPECT_FALSE(rig_.cameras[0]->trim_rate(PartsPerMillion(-12.5)));
}

TEST_F(ReplayThreads, AStrobeSwitchedOtherwiseOrTooOftenIsADeviceError) {
  StrobeSettings steady;
  steady.output = StrobeOutput::steady;
  ASSERT_FALSE(rig_.strobe->apply(steady));
  ASSERT_TRUE(rig_.strobe->read_back());
  ASSERT_TRUE(rig_.strobe->read_back());
  const auto third = rig_.strobe->read_back();
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().kind, ErrorKind::device);
}

TEST_F(ReplayThreads, ACameraThatIsNotStartedGivesNoFrames) {
  rig_.cameras[0]->stop();
  EXPECT_EQ(rig_.cameras[0]->next_frame(Seconds(1)).error().kind, ErrorKind::device);
  ASSERT_TRUE(rig_.cameras[0]->start());
  EXPECT_EQ(rig_.cameras[0]->next_frame(Seconds(1))->stamp.frame_id, 0U);
}

TEST_F(ReplayThreads, SleepingTakesNoTimeAndDoesNotMoveRecordedInstants) {
  rig_.clock->sleep_until({3'000'000'000'000});
  EXPECT_EQ(rig_.clock->now().ns, 1'000'000'001);
}

TEST(ReplayRigThreads, OfAFolderWithoutASessionIsAnErrorThatNamesIt) {
  const auto rig = ReplayRig::open("/nonexistent/session");
  ASSERT_FALSE(rig);
  EXPECT_NE(rig.error().message().find("/nonexistent/session"), std::string::npos);
}

TEST(ReplayRecord, AStrobeStateWithNumbersThatAreNotFiniteIsRefused) {
  v1::StrobeState state;
  EXPECT_FALSE(strobe_settings(state));
  state.set_output(v1::StrobeState::FLASHING);
  EXPECT_TRUE(strobe_settings(state));
  state.set_rate_hz(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(strobe_settings(state));
}

}  // namespace
}  // namespace emberlock::drivers
