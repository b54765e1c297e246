// SPDX-License-Identifier: Apache-2.0
// A recorded session, reconstructed by the program itself as the daemon's child.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "daemon/reconstruction/child.h"
#include "recon/export/volume_file.h"
#include "recon/preprocess/radiance.h"
#include "recon/synthetic/flame.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;
using State = v1::ReconstructionStatus;

v1::Manifest manifest_of(const recon::Scene& scene) {
  v1::Manifest manifest = test::manifest_of(
      std::vector<ImageLayout>(scene.views.size(), {scene.views.front().image->size, PixelFormat::rgb8, 8}));
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const recon::CameraModel& camera = scene.views[i].camera;
    v1::Calibration& calibration = *manifest.mutable_cameras(static_cast<int>(i))->mutable_calibration();
    calibration.set_fx(camera.intrinsics.fx);
    calibration.set_fy(camera.intrinsics.fy);
    calibration.set_cx(camera.intrinsics.cx);
    calibration.set_cy(camera.intrinsics.cy);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        calibration.add_camera_from_world(camera.camera_from_world.rotation(row, column));
      calibration.add_camera_from_world(camera.camera_from_world.translation[row]);
    }
  }
  for (const double value : scene.box.center) manifest.mutable_box()->add_center(value);
  for (const double value : scene.box.size) manifest.mutable_box()->add_size(value);
  return manifest;
}

/// Three frames of the paper's eleven cameras, at 64 x 48.
void record_flame(const fs::path& folder) {
  recon::PaperSceneOptions options;
  options.image = {64, 48};
  options.truth_voxels = 32;
  const recon::Scene scene = recon::paper_scene(options);
  const auto check = [](const auto& result) {
    if (!result.ok()) throw std::runtime_error(result.error().message());
  };
  auto writer = session::SessionWriter::create(folder, manifest_of(scene), test::small_disk_options());
  check(writer);
  for (std::size_t camera = 0; camera < scene.views.size(); ++camera) {
    const auto image = std::make_shared<const Image>(recon::to_rgb8(*scene.views[camera].image));
    for (std::uint64_t i = 0; i < 3; ++i) {
      Frame frame;
      frame.stamp = test::noise_frame({{2, 2}, PixelFormat::gray8, 8}, i).stamp;
      frame.image = image;
      check(writer->write(camera, frame));
    }
  }
  check(writer->finish());
}

class DaemonReconstruction : public testing::Test {
 protected:
  DaemonReconstruction() {
    record_flame(folder_ / "sessions/candle");
    daemon::ReconstructionOptions options;
    options.program = EMBERLOCK_PROGRAM;
    options.sessions = folder_ / "sessions";
    options.results = folder_ / "results";
    options.unasked.set_device("cpu");
    options.unasked.set_voxels(24);
    options.unasked.add_hold_out(10);
    child_ = std::make_unique<daemon::ReconstructionChild>(options, board_, jobs_.emplace());
  }
  [[nodiscard]] bool running() const { return child_->status()->state() == State::RUNNING; }
  /// Waits while it runs and the condition doesn't hold.
  void wait_for(const std::function<bool()>& condition) {
    test::wait_until([&] { return !running() || condition(); }, std::chrono::minutes(10));
  }
  static v1::ReconstructRequest candle() {
    v1::ReconstructRequest request;
    request.set_session("candle");
    return request;
  }

  test::TempFolder folder_;
  daemon::Board board_;
  std::unique_ptr<daemon::ReconstructionChild> child_;
  std::optional<daemon::Jobs> jobs_;
};

TEST_F(DaemonReconstruction, ARecordedFlameBecomesAVolumeThatIsSeenGrowing) {
  ASSERT_TRUE(child_->start(candle()).ok());
  wait_for([] { return false; });
  const v1::ReconstructionStatus status = *child_->status();
  ASSERT_EQ(status.state(), State::DONE) << status.error();
  EXPECT_EQ(status.device(), "cpu");
  EXPECT_TRUE(fs::exists(fs::path(status.result()) / "volume.vdb"));
  EXPECT_FALSE(status.effects().empty());
  const auto shown = board_.iterations(0);
  ASSERT_EQ(static_cast<int>(shown.size()), status.iterations_size() + 1);
  EXPECT_LT(shown.back()->iteration().heldout_rmse(), shown.front()->iteration().heldout_rmse());
  EXPECT_EQ(shown.back()->camera_id(), "cam10");
  EXPECT_EQ(shown.back()->volume().voxels().size(), 25U * 25U * 25U);
  EXPECT_FALSE(shown.back()->rendered_jpeg().empty());
}

TEST_F(DaemonReconstruction, ASequenceBecomesAVolumeForEachFrameThatCanBeFetched) {
  v1::ReconstructRequest request = candle();
  request.set_frame(0);
  request.set_last_frame(2);
  request.set_every(2);
  request.set_voxels(12);
  ASSERT_TRUE(child_->start(request).ok());
  wait_for([] { return false; });
  const v1::ReconstructionStatus status = *child_->status();
  ASSERT_EQ(status.state(), State::DONE) << status.error();
  EXPECT_EQ(status.result(), folder_ / "results/candle");
  ASSERT_EQ(status.frames_size(), 2);
  for (const v1::SequenceFrame& frame : status.frames()) {
    EXPECT_EQ(frame.state(), State::DONE);
    EXPECT_GT(frame.input_rmse(), 0);
    EXPECT_TRUE(frame.has_heldout_rmse());
    EXPECT_TRUE(fs::exists(folder_ / fmt::format("results/candle/frame-{}/volume.vdb", frame.frame())));
    v1::FrameRequest wanted;
    wanted.set_reconstruction(status.id());
    wanted.set_frame(frame.frame());
    const auto kept = child_->frame(wanted);
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->volume().voxels().size(), 13U * 13U * 13U);
    EXPECT_EQ(kept->iteration().input_rmse(), frame.input_rmse());
  }
}

TEST_F(DaemonReconstruction, AFrameIsEditedWhileItGoesOnAndReplaysToTheSameBits) {
  v1::ReconstructRequest request = candle();
  request.set_frame(1);
  request.set_stylize(true);
  ASSERT_TRUE(child_->start(request).ok());
  wait_for([&] { return child_->status()->has_stylization(); });
  ASSERT_TRUE(running()) << child_->status()->error();
  const auto edit = [&](const std::string& operation) {
    v1::EditRequest step;
    step.set_operation(operation);
    return child_->edit(step);
  };
  const auto held_out = edit(
      R"({"op": "brush", "view": "cam10", "points": [[32, 24]], "radius": 5, "mode": "add", "strength": 90})");
  ASSERT_FALSE(held_out.ok());
  EXPECT_THAT(held_out.error().message(), HasSubstr("is held out"));
  const auto taken = edit(
      R"({"op": "brush", "view": "cam3", "points": [[32, 24]], "radius": 5, "mode": "add", "strength": 90})");
  ASSERT_TRUE(taken.ok()) << taken.error().message();
  EXPECT_EQ(taken->steps(), 1U);
  wait_for([&] { return child_->status()->stylization().pauses(); });
  const std::uint32_t passes = child_->status()->stylization().passes();
  EXPECT_GT(passes, 0U) << "it went on, and waits";
  EXPECT_TRUE(test::wait_until([&] { return board_.iterations(0).back()->stylization().passes() == passes; }))
      << "behind the status";
  ASSERT_TRUE(edit(R"({"op": "cut", "region": {"center": [0, 0, 0], "size": [0.1, 0.1, 0.02]}})").ok());
  ASSERT_TRUE(child_->finish().ok());
  wait_for([] { return false; });
  const v1::ReconstructionStatus status = *child_->status();
  ASSERT_EQ(status.state(), State::DONE) << status.error();
  EXPECT_EQ(status.result(), folder_ / "results/candle/frame-1-stylized");
  const Shell again = shell(
      fmt::format("{0} stylize {1} --frame 1 --hold-out 10 --device cpu --edits {2}/edits.json --out {3}",
                  EMBERLOCK_PROGRAM, (folder_ / "sessions/candle").string(), status.result(),
                  (folder_ / "again").string()));
  ASSERT_EQ(again.status, 0) << again.output;
  const auto first = recon::read_volume(fs::path(status.result()) / "volume.vdb");
  const auto replayed = recon::read_volume(folder_ / "again/volume.vdb");
  ASSERT_TRUE(first.ok() && replayed.ok());
  EXPECT_EQ(replayed->emission, first->emission);
}

TEST_F(DaemonReconstruction, WithoutTheDaemonTheProgramReconstructsASequenceToo) {
  const std::string command =
      fmt::format("{} reconstruct {} --device cpu --voxels 12 --frame 0 --out {}", EMBERLOCK_PROGRAM,
                  (folder_ / "sessions/candle").string(), (folder_ / "out").string());
  const Shell run = shell(command + " --last-frame 2 --every 2");
  EXPECT_EQ(run.status, 0) << run.output;
  EXPECT_THAT(run.output, HasSubstr("frame 2 (2 of 2)"));
  for (const char* frame : {"frame-0", "frame-2"})
    EXPECT_TRUE(fs::exists(folder_ / fmt::format("out/{}/volume.vdb", frame))) << frame;
  EXPECT_FALSE(fs::exists(folder_ / "out/frame-1"));
  const Shell beyond = shell(command + " --last-frame 3");
  EXPECT_EQ(beyond.status, 2);
  EXPECT_THAT(beyond.output,
              HasSubstr("--last-frame: there is no frame 3: the session has 3. Choose among 0 to 2"));
  const Shell hopeless = shell(command + "-hopeless --last-frame 2 --hold-out 30");
  EXPECT_EQ(hopeless.status, 1);
  EXPECT_THAT(hopeless.output, HasSubstr("of 3 frames 3 failed and 0 were not tried"));
}

/// Frames in turn, by the program alone.
class FramesInTurn : public DaemonReconstruction {
 protected:
  [[nodiscard]] Shell run(const char* frames, const char* out, const char* more = "--hold-out 10") const {
    return shell(fmt::format("{} reconstruct {} --device cpu --voxels 12 --frames {} --out {} {}",
                             EMBERLOCK_PROGRAM, (folder_ / "sessions/candle").string(), frames,
                             (folder_ / out).string(), more));
  }
  /// What frames.json tells, but for the time it took.
  [[nodiscard]] std::string told(const char* out) const {
    auto read = nlohmann::json::parse(*read_file(folder_ / out / "sequence/frames.json"));
    for (auto& frame : read.at("frames")) frame.erase("seconds");
    return read.dump();
  }
  void expect_same(const char* out, const char* expected) const {
    EXPECT_EQ(told(out), told(expected));
    for (const char* frame : {"frame-0", "frame-1", "frame-2"}) {
      const auto want = recon::read_volume(folder_ / expected / frame / "volume.vdb");
      const auto got = recon::read_volume(folder_ / out / frame / "volume.vdb");
      ASSERT_TRUE(want.ok() && got.ok()) << frame;
      EXPECT_EQ(got->emission, want->emission) << frame;
      EXPECT_EQ(got->extinction, want->extinction) << frame;
    }
  }
};

using FramesInTurnSlow = FramesInTurn;

TEST_F(FramesInTurnSlow, ASequenceThatWasInterruptedEndsAsIfItHadNotBeen) {
  const Shell whole = run("0:2", "whole");
  EXPECT_EQ(whole.status, 0) << whole.output;
  EXPECT_THAT(whole.output, HasSubstr("3 of 3 frames became volumes of 12 voxels"));
  EXPECT_EQ(run("0:1", "cut").status, 0);
  const Shell rest = run("0:2", "cut");
  EXPECT_EQ(rest.status, 0) << rest.output;
  EXPECT_THAT(rest.output, HasSubstr("2 of 3 frames are done: going on behind frame 1"));
  expect_same("cut", "whole");
  EXPECT_TRUE(recon::read_volume(folder_ / "cut/volume_0002.vdb").ok());
  EXPECT_THAT(run("0:2", "cut").output, Not(HasSubstr("going on")));  // all is done

  EXPECT_EQ(run("0:1", "other").status, 0);
  const Shell others = run("0:2", "other", "--hold-out 10 --effects extinction=30");
  EXPECT_EQ(others.status, 2);
  EXPECT_THAT(others.output, HasSubstr(R"(--effects was not given, and is "extinction=30")"));
  EXPECT_THAT(run("1:2", "other").output, HasSubstr("holds a sequence of other frames"));
}

TEST_F(FramesInTurnSlow, AFrameThatFailedIsTriedAgainAndThoseBehindItAreDoneAgainOnlyOnceItIsAVolume) {
  EXPECT_EQ(run("0:2", "whole").status, 0);
  const fs::path mine = folder_ / "cut/frame-1/mine.txt";  // not to be replaced: the frame fails
  fs::create_directories(mine.parent_path());
  ASSERT_TRUE(write_file_atomically(mine, "mine").ok());
  const Shell cut = run("0:2", "cut");
  EXPECT_EQ(cut.status, 1);
  EXPECT_THAT(cut.output, HasSubstr("of 3 frames 1 failed and 0 were not tried"));
  const std::string first_told = told("cut");
  const auto first_done = fs::last_write_time(folder_ / "cut/frame-2/volume.vdb");

  const Shell again = run("0:2", "cut");
  EXPECT_EQ(again.status, 1);
  EXPECT_THAT(again.output, HasSubstr("2 of 3 frames are done: going on behind frame 0"));
  EXPECT_THAT(again.output, HasSubstr("frame 1 (2 of 3), which failed before"));
  EXPECT_THAT(again.output, HasSubstr("of 3 frames 1 failed and 0 were not tried"));
  EXPECT_EQ(told("cut"), first_told);
  EXPECT_EQ(fs::last_write_time(folder_ / "cut/frame-2/volume.vdb"), first_done);

  fs::remove(mine);
  const Shell cured = run("0:2", "cut");
  EXPECT_EQ(cured.status, 0) << cured.output;
  expect_same("cut", "whole");
}

TEST_F(FramesInTurn, ARangeThatLeavesTheRecordingIsNamedAsItWasTyped) {
  for (const auto& [range, why] :
       {std::pair("0:3", "there is no frame 3: the session has 3. Choose among 0 to 2"),
        {"7:9", "there is no frame 9: the session has 3. Choose among 0 to 2"},
        {"2:1", "1 lies before the first frame, 2. Give the first frame, or a later one"}}) {
    const Shell beyond = run(range, "beyond");
    EXPECT_EQ(beyond.status, 2);
    EXPECT_THAT(beyond.output, HasSubstr(fmt::format("--frames {}: {}", range, why)));
  }
}

TEST_F(FramesInTurn, ASequenceWhoseFirstFramesFailedBeginsAnew) {
  EXPECT_EQ(run("0:2", "out", "--hold-out 30").status, 1);
  const Shell again = run("0:2", "out");
  EXPECT_EQ(again.status, 0) << again.output;
  EXPECT_THAT(again.output, HasSubstr("3 of 3 frames became volumes"));
}

using DaemonReconstructionSlow = DaemonReconstruction;

TEST_F(DaemonReconstructionSlow, FramesThatAreAtWorkAtOnceBecomeWhatTheyBecomeAlone) {
  const auto run = [&](const char* at_once, const char* out) {
    return shell(fmt::format(
        "{} reconstruct {} --device cpu --voxels 12 --frame 0 --last-frame 2 {} --out {}", EMBERLOCK_PROGRAM,
        (folder_ / "sessions/candle").string(), at_once, (folder_ / out).string()));
  };
  const Shell alone = run("--cold", "alone");
  EXPECT_EQ(alone.status, 0) << alone.output;
  const Shell together = run("--at-once 2 --threads 3", "together");
  EXPECT_EQ(together.status, 0) << together.output;
  EXPECT_THAT(together.output, HasSubstr("3 frames in "));
  for (const char* frame : {"frame-0", "frame-1", "frame-2"}) {
    EXPECT_THAT(together.output, HasSubstr(fmt::format("together/{}", frame)));
    for (const char* view : {"0000.png", "0010.png"}) {
      const fs::path picture = fs::path(frame) / "views" / view;
      const auto expected = read_file(folder_ / "alone" / picture);
      const auto got = read_file(folder_ / "together" / picture);
      ASSERT_TRUE(expected.ok() && got.ok()) << picture;
      EXPECT_EQ(*got, *expected) << picture;
    }
  }
  const Shell hopeless = run("--at-once 2 --hold-out 30", "hopeless");
  EXPECT_EQ(hopeless.status, 1);
  EXPECT_FALSE(fs::exists(folder_ / "hopeless")) << "nothing was put in it";
  EXPECT_THAT(hopeless.output, HasSubstr("of 3 frames 3 failed and 0 were not tried"));
}

TEST_F(DaemonReconstruction, OneThatIsCancelledLeavesNoHalfResult) {
  v1::ReconstructRequest request = candle();
  request.set_voxels(200);
  ASSERT_TRUE(child_->start(request).ok());
  wait_for([&] { return child_->status()->doing() != "starting"; });
  ASSERT_TRUE(child_->cancel().ok());
  wait_for([] { return false; });
  EXPECT_EQ(child_->status()->state(), State::CANCELLED) << child_->status()->error();
  EXPECT_FALSE(fs::exists(folder_ / "results/candle/middle-frame"));
}

TEST_F(DaemonReconstruction, WhatItRefusesIsToldInItsOwnWords) {
  v1::ReconstructRequest request = candle();
  request.add_hold_out(30);
  ASSERT_TRUE(child_->start(request).ok());
  wait_for([] { return false; });
  EXPECT_EQ(child_->status()->state(), State::FAILED);
  EXPECT_THAT(child_->status()->error(), HasSubstr("0 to 10"));
}

}  // namespace
}  // namespace emberlock
