// SPDX-License-Identifier: Apache-2.0
// The camera whose frames are a live view, in virtual time.
#include "drivers/ptp/chdk_camera.h"

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.h"
#include "drivers/virtual/virtual_clock.h"
#include "tests/support/chdk_responder/fake_transport.h"
#include "tests/support/temp_folder.h"
#include "tests/support/wait.h"

namespace emberlock::drivers {
namespace {

using chdk_responder::Cable;
using chdk_responder::Device;
using chdk_responder::DeviceOptions;
using chdk_responder::FakeTransport;
using chdk_responder::Faults;
using testing::HasSubstr;

struct Studio {
  explicit Studio(DeviceOptions options = {})
      : clock(std::make_shared<VirtualClock>(TimePoint{1'000'000'000})),
        cable(std::make_shared<Cable>(Cable{clock, Device(std::move(options))})) {}
  Device& device() { return cable->device; }

  PtpConnect connect() {
    return [this]() -> Result<PtpConnection> {
      if (!cable->plugged) return Error{ErrorKind::device, "it isn't on the USB", "camera EMBER0001"};
      PtpConnection connection;
      connection.usb.vendor = device().options().usb_vendor;
      connection.session =
          std::make_unique<PtpSession>(std::make_unique<FakeTransport>(cable), "camera EMBER0001", clock);
      EMBERLOCK_RETURN_IF_ERROR(connection.session->open());
      EMBERLOCK_ASSIGN_OR_RETURN(connection.info, connection.session->device_info());
      connection.id = connection.info.serial;
      return connection;
    };
  }
  Result<std::unique_ptr<ChdkCamera>> open(const CameraRequest& request = {}) {
    return ChdkCamera::open(connect(), request, clock);
  }
  std::unique_ptr<ChdkCamera> filming(const CameraRequest& request = {}) {
    auto camera = open(request);
    EXPECT_TRUE(camera.ok()) << camera.error().message();
    EXPECT_TRUE((*camera)->start().ok());
    return std::move(*camera);
  }
  /// The frame that comes within `limit`, asked for in slices as a camera's thread does.
  Result<Frame> frame(Camera& camera, Seconds limit) {
    const TimePoint until = clock->now() + limit;
    auto result = camera.next_frame(milliseconds(20));
    while (!result.ok() && result.error().kind == ErrorKind::timed_out && clock->now() < until) {
      result = camera.next_frame(milliseconds(20));
    }
    return result;
  }
  void unplug() {
    cable->plugged = false;
    device().power_on();
  }

  std::shared_ptr<VirtualClock> clock;
  std::shared_ptr<Cable> cable;
};

int phase_shown(const Frame& frame) { return frame.image->view().sample(0, 0); }
const CameraRequest kGray{.format = PixelFormat::gray8};

TEST(ChdkCameraThreads, FilmsItsLiveViewAtTheRateAskedFor) {
  Studio studio;
  auto camera = studio.filming({.format = PixelFormat::gray8, .frame_rate = Hertz(20)});
  EXPECT_EQ(camera->info().id, "EMBER0001");
  EXPECT_EQ(camera->info().layout, (ImageLayout{{360, 240}, PixelFormat::gray8, 8}));
  EXPECT_EQ(camera->info().reset, ShutterReset::on_command);
  const TimePoint begin = studio.clock->now();
  for (std::uint64_t i = 0; i < 40; ++i) {
    const auto frame = studio.frame(*camera, Seconds(1));
    ASSERT_TRUE(frame.ok()) << frame.error().message();
    EXPECT_EQ(frame->stamp.frame_id, i);
    EXPECT_EQ(frame->image->layout(), camera->info().layout);
  }
  EXPECT_NEAR((studio.clock->now() - begin).value(), 39 / 20.0, 0.06);
  EXPECT_EQ(camera->counts().delivered, 40u);
  EXPECT_EQ(camera->counts().lost(), 0u);
}

TEST(ChdkCameraThreads, ColourIsTheDefaultAndBrightnessOnRequest) {
  Studio studio;
  EXPECT_EQ((*studio.open())->info().layout.format, PixelFormat::rgb8);
  EXPECT_EQ((*studio.open(kGray))->info().layout.format, PixelFormat::gray8);
}

TEST(ChdkCameraThreads, RequestsThatItCannotMeetSayWhatItCan) {
  Studio studio;
  const auto refusal = [&](CameraRequest request) {
    const auto camera = studio.open(request);
    EXPECT_FALSE(camera.ok());
    EXPECT_EQ(camera.error().kind, ErrorKind::bad_input);
    return camera.error().message();
  };
  EXPECT_THAT(refusal({.size = ImageSize{1920, 1080}}), HasSubstr("360 x 240"));
  EXPECT_THAT(refusal({.frame_rate = Hertz(60)}), HasSubstr("30 frames/s"));
  EXPECT_THAT(refusal({.exposure = Seconds(0.01)}), HasSubstr("exposure"));
  EXPECT_THAT(refusal({.controls = {{"gain", "3"}}}), HasSubstr("controls are reset and power_command"));
  EXPECT_THAT(refusal({.controls = {{"reset", "kick"}}}), HasSubstr("mode, movie or power"));
  EXPECT_THAT(refusal({.controls = {{"reset", "power"}}}), HasSubstr("power_command"));
}

TEST(ChdkCameraThreads, ACameraOfAnotherMakerIsNeverAskedForChdk) {
  Studio studio({.usb_vendor = 0x04b0});
  const auto camera = studio.open();
  ASSERT_FALSE(camera.ok());
  EXPECT_THAT(camera.error().message(), HasSubstr("doesn't run CHDK"));
  EXPECT_EQ(studio.device().transactions(), 3);  // open, device info, close
}

TEST(ChdkCameraThreads, ACanonWithoutChdkSaysSo) {
  Studio studio({.chdk = false});
  EXPECT_THAT(studio.open().error().message(), HasSubstr("doesn't run CHDK"));
}

TEST(ChdkCameraThreads, ACameraThatStaysInPlaybackIsRefusedInBoundedTime) {
  Studio studio({.mode_change = Seconds(60)});
  const TimePoint begin = studio.clock->now();
  EXPECT_FALSE(studio.open().ok());
  EXPECT_LE((studio.clock->now() - begin).value(), 5.0);
}

struct ResetCase {
  const char* control;
  int draws;  // of the phase, until frames come again
  double shortest, longest;
};
class ChdkCameraResetThreads : public testing::TestWithParam<ResetCase> {};
INSTANTIATE_TEST_SUITE_P(Actions, ChdkCameraResetThreads,
                         testing::Values(ResetCase{"mode", 1, 0.5, 0.8}, ResetCase{"movie", 1, 0.4, 0.6}),
                         [](const auto& shown) { return shown.param.control; });

TEST_P(ChdkCameraResetThreads, ShowsTheNewPhaseInTheNextFrameAndSaysHowLongItTook) {
  Studio studio;
  auto camera = studio.filming({.format = PixelFormat::gray8, .controls = {{"reset", GetParam().control}}});
  for (int i = 0; i < 10; ++i) {
    const auto before = studio.frame(*camera, Seconds(1));
    ASSERT_TRUE(before.ok()) << before.error().message();
    const TimePoint at = studio.clock->now();
    ASSERT_TRUE(camera->reset_shutter(at).ok());
    EXPECT_LE((studio.clock->now() - at).value(), 0.1) << "the order itself must not wait for the camera";
    const auto after = studio.frame(*camera, Seconds(5));
    ASSERT_TRUE(after.ok()) << after.error().message();
    EXPECT_EQ(phase_shown(*after), phase_shown(*before) + GetParam().draws);
    const auto reset = camera->last_reset();
    ASSERT_TRUE(reset && reset->first_frame);
    const Seconds latency = *reset->first_frame - reset->at;
    EXPECT_GE(latency.value(), GetParam().shortest);
    EXPECT_LE(latency.value(), GetParam().longest);
  }
  EXPECT_EQ(camera->counts().lost(), 0u);
}

TEST(ChdkCameraThreads, AResetAtAnInstantBeginsThenAndTheNextFrameShowsTheNewPhase) {
  Studio studio;
  auto camera = studio.filming(kGray);
  ASSERT_TRUE(studio.frame(*camera, Seconds(1)).ok());
  const int phase = studio.device().phase_draws();
  const TimePoint at = studio.clock->now() + milliseconds(333);
  ASSERT_TRUE(camera->reset_shutter(at).ok());
  EXPECT_NE(phase_shown(studio.frame(*camera, Seconds(5)).value()), phase);
  EXPECT_NEAR((camera->last_reset()->at - at).value(), 0, 1e-3);
}

TEST(ChdkCameraThreads, AResetDuringAMovieLeavesAMovieRunning) {
  Studio studio;
  auto camera = studio.filming({.format = PixelFormat::gray8, .controls = {{"reset", "movie"}}});
  Chdk chdk(*camera->session());
  ASSERT_TRUE(chdk.press_movie_button().ok());
  studio.clock->sleep_until(studio.clock->now() + Seconds(1));
  ASSERT_EQ(chdk.movie().value(), ChdkMovie::recording);
  ASSERT_TRUE(camera->reset_shutter(studio.clock->now()).ok());
  ASSERT_TRUE(studio.frame(*camera, Seconds(5)).ok());
  EXPECT_EQ(chdk.movie().value(), ChdkMovie::recording);
  EXPECT_EQ(studio.device().objects().size(), 1u);
}

TEST(ChdkCameraThreads, APowerCycleByTheUsersCommandIsSeenThrough) {
  Studio studio;
  const test::TempFolder folder;
  const auto note = folder / "note";
  auto camera = studio.filming(
      {.format = PixelFormat::gray8,
       .controls = {{"reset", "power"}, {"power_command", "echo $EMBERLOCK_CAMERA >" + note.string()}}});
  ASSERT_TRUE(studio.frame(*camera, Seconds(1)).ok());
  ASSERT_TRUE(camera->reset_shutter(studio.clock->now()).ok());
  // The command's process takes real time, which doesn't pass on the clock of the camera.
  EXPECT_TRUE(test::wait_until([&] {
    const auto named = read_file(note);
    return named.ok() && *named == "EMBER0001\n";
  }));
  studio.unplug();
  // The camera drops the dead connection as soon as the process has ended.
  EXPECT_TRUE(test::wait_until([&] {
    EXPECT_EQ(camera->next_frame(Seconds(0)).error().kind, ErrorKind::timed_out);
    return studio.cable->transports == 0;
  }));
  EXPECT_EQ(camera->next_frame(milliseconds(20)).error().kind, ErrorKind::timed_out);
  studio.cable->plugged = true;
  const auto frame = studio.frame(*camera, Seconds(5));
  ASSERT_TRUE(frame.ok()) << frame.error().message();
  EXPECT_EQ(phase_shown(*frame), studio.device().phase_draws());
}

TEST(ChdkCameraThreads, APowerCommandThatFailsIsAnError) {
  Studio studio;
  auto camera = studio.filming({.controls = {{"reset", "power"}, {"power_command", "exit 3"}}});
  Status said = camera->reset_shutter(studio.clock->now());
  ASSERT_TRUE(test::wait_until([&] {
    if (!said.ok()) return true;
    const auto frame = camera->next_frame(Seconds(0));
    if (!frame.ok() && frame.error().kind == ErrorKind::device) said = frame.error();
    return false;
  }));
  EXPECT_THAT(said.error().message(), HasSubstr("power command failed"));
}

TEST(ChdkCameraThreads, UnpluggedItSaysSoOnceAndStartFindsItAgain) {
  Studio studio;
  auto camera = studio.filming(kGray);
  ASSERT_TRUE(studio.frame(*camera, Seconds(1)).ok());
  studio.unplug();
  const TimePoint begin = studio.clock->now();
  const auto gone = studio.frame(*camera, Seconds(2));
  ASSERT_FALSE(gone.ok());
  EXPECT_EQ(gone.error().kind, ErrorKind::device);
  EXPECT_LE((studio.clock->now() - begin).value(), 1.0);
  EXPECT_EQ(studio.cable->transports, 0);
  EXPECT_EQ(camera->start().error().kind, ErrorKind::device);
  studio.cable->plugged = true;
  ASSERT_TRUE(camera->start().ok());
  EXPECT_TRUE(studio.frame(*camera, Seconds(3)).ok());
}

TEST(ChdkCameraThreads, UnpluggedInTheMiddleOfAResetItSaysSoToo) {
  Studio studio;
  auto camera = studio.filming(kGray);
  ASSERT_TRUE(studio.frame(*camera, Seconds(1)).ok());
  ASSERT_TRUE(camera->reset_shutter(studio.clock->now()).ok());
  studio.unplug();
  EXPECT_EQ(studio.frame(*camera, Seconds(2)).error().kind, ErrorKind::device);
  studio.cable->plugged = true;
  ASSERT_TRUE(camera->start().ok());
  EXPECT_TRUE(studio.frame(*camera, Seconds(3)).ok());
}

TEST(ChdkCameraThreads, ACameraThatHangsIsGivenUpAndNoCallOutlastsItsDeadlineByTwoSeconds) {
  Studio studio;
  auto camera = studio.filming(kGray);
  ASSERT_TRUE(studio.frame(*camera, Seconds(1)).ok());
  studio.device().faults.hang = -1;
  const TimePoint begin = studio.clock->now();
  Result<Frame> frame = Error{ErrorKind::timed_out, ""};
  while (!frame.ok() && frame.error().kind == ErrorKind::timed_out) {
    const TimePoint call = studio.clock->now();
    ASSERT_LE((call - begin).value(), 10.0);
    frame = camera->next_frame(milliseconds(20));
    EXPECT_LE((studio.clock->now() - call).value(), 2.0);
  }
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().kind, ErrorKind::device);
  EXPECT_LE((studio.clock->now() - begin).value(), 4.0);
}

TEST(ChdkCameraThreads, ALateLiveViewFilmsSlowerAndLosesNothing) {
  Studio studio;
  auto camera = studio.filming(kGray);
  studio.device().faults.latency = milliseconds(110);
  for (std::uint64_t i = 0; i < 20; ++i) {
    const auto frame = studio.frame(*camera, Seconds(1));
    ASSERT_TRUE(frame.ok()) << frame.error().message();
    EXPECT_EQ(frame->stamp.frame_id, i);
  }
  EXPECT_EQ(camera->counts().lost(), 0u);
}

struct Malformed {
  const char* name;
  int Faults::*fault;
};
class ChdkCameraMalformedThreads : public testing::TestWithParam<Malformed> {};
INSTANTIATE_TEST_SUITE_P(Answers, ChdkCameraMalformedThreads,
                         testing::Values(Malformed{"WrongTransaction", &Faults::wrong_transaction},
                                         Malformed{"LongLength", &Faults::long_length},
                                         Malformed{"ShortLength", &Faults::short_length},
                                         Malformed{"Garbage", &Faults::garbage},
                                         Malformed{"Stall", &Faults::stall},
                                         Malformed{"BadLiveView", &Faults::bad_live_view}),
                         [](const auto& shown) { return shown.param.name; });

TEST_P(ChdkCameraMalformedThreads, CostsOneFrameWhichIsCountedAndNeverHandedOn) {
  Studio studio;
  auto camera = studio.filming(kGray);
  std::uint64_t next = 0;
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(studio.frame(*camera, Seconds(1)).ok());
    studio.device().faults.*GetParam().fault = 1;
    const auto frame = studio.frame(*camera, Seconds(3));
    ASSERT_TRUE(frame.ok()) << frame.error().message();
    next = frame->stamp.frame_id + 1;
    EXPECT_EQ(frame->image->layout(), camera->info().layout);
  }
  EXPECT_EQ(camera->counts().transport, 3u);
  EXPECT_EQ(camera->counts().delivered + camera->counts().lost(), next);
}

TEST_P(ChdkCameraMalformedThreads, ForEverIsALostCamera) {
  Studio studio;
  auto camera = studio.filming(kGray);
  studio.device().faults.*GetParam().fault = -1;
  const TimePoint begin = studio.clock->now();
  Result<Frame> frame = Error{ErrorKind::timed_out, ""};
  while (!frame.ok() && frame.error().kind == ErrorKind::timed_out &&
         (studio.clock->now() - begin).value() < 10) {
    frame = camera->next_frame(milliseconds(20));
  }
  ASSERT_FALSE(frame.ok());
  EXPECT_EQ(frame.error().kind, ErrorKind::device);
}

TEST(ChdkCameraThreads, StoppedItDropsWhatIsUnderWayAndFilmsAgain) {
  Studio studio;
  auto camera = studio.filming(kGray);
  studio.device().faults.latency = milliseconds(60);
  ASSERT_TRUE(studio.frame(*camera, Seconds(1)).ok());
  EXPECT_FALSE(camera->next_frame(milliseconds(40)).ok());
  camera->stop();
  camera->stop();
  EXPECT_EQ(camera->next_frame(milliseconds(20)).error().kind, ErrorKind::device);
  ASSERT_TRUE(camera->start().ok());
  const auto frame = studio.frame(*camera, Seconds(1));
  ASSERT_TRUE(frame.ok());
  EXPECT_EQ(frame->stamp.frame_id, 2u);
  EXPECT_EQ(camera->counts().passed_over, 1u);
  EXPECT_EQ(camera->counts().lost(), 0u);
}

}  // namespace
}  // namespace emberlock::drivers
