// SPDX-License-Identifier: Apache-2.0
// The demonstration with a small rig: strobe, alignment, recording, reconstruction and report, through the
// code that ships.
#include "rig/demo.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>

#include "base/file.h"
#include "recon/adjust/picture_error.h"
#include "recon/views/flame_mask.h"
#include "report/demo_report.h"
#include "rig/align/record.h"
#include "session/reader.h"
#include "tests/support/temp_folder.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class DemoTestSlow : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TempFolder;
    rig::DemoOptions options;
    options.cameras = 6;
    options.image = {320, 240};
    options.flame_frames = 3;
    options.voxels = 40;
    options.truth_voxels = 40;
    result_ = new Result<rig::DemoResult>(
        rig::run_demo(options, *folder_, [](const std::string&) { return Progress{}; }));
  }
  static void TearDownTestSuite() {
    delete result_;
    delete folder_;
  }
  void SetUp() override { ASSERT_TRUE(result_->ok()) << result_->error().message(); }
  static const rig::DemoResult& result() { return **result_; }

  static test::TempFolder* folder_;
  static Result<rig::DemoResult>* result_;
};
test::TempFolder* DemoTestSlow::folder_;
Result<rig::DemoResult>* DemoTestSlow::result_ = nullptr;

TEST_F(DemoTestSlow, EveryCameraEndsWithinTheToleranceInTruth) {
  for (const rig::AlignStage& stage : result().stages) {
    for (const auto& error : stage.errors.back()) {
      ASSERT_TRUE(error.has_value());
      EXPECT_LE(std::abs(error->value()), stage.tolerance.value()) << stage.title;
    }
  }
  // Ten rows to either side of the reference, and a row for what measuring leaves open.
  EXPECT_LE(result().true_worst_pair, Rows(21) * result().true_row_times[0]);
}

TEST_F(DemoTestSlow, RowTimesAreMeasuredNotAssumed) {
  ASSERT_EQ(result().row_clocks.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    const smear::RowClock& clock = result().row_clocks[i];
    // So few rows hold few dots; what is stated must cover what is true.
    EXPECT_LE(abs(clock.row_time - result().true_row_times[i]), 3 * clock.sigma) << i;
    EXPECT_LE(clock.sigma / clock.row_time, 0.005) << i;
  }
}

TEST_F(DemoTestSlow, TheRecordedAlignmentReplaysToTheSameEnd) {
  const auto replayed = rig::replay_align(*folder_ / "alignment");
  ASSERT_TRUE(replayed.ok()) << replayed.error().message();
  EXPECT_EQ(replayed->resets, result().stages.back().result.resets);
  EXPECT_EQ(replayed->last.worst_pair, result().stages.back().result.last.worst_pair);
}

TEST_F(DemoTestSlow, EveryFrameOfTheFlameIsRecordedAndReadable) {
  auto session = session::SessionReader::open(*folder_ / "flame");
  ASSERT_TRUE(session.ok()) << session.error().message();
  ASSERT_EQ(session->camera_count(), 6U);
  for (std::size_t camera = 0; camera < 6; ++camera) {
    ASSERT_EQ(session->stamps(camera).size(), 3U);
    EXPECT_TRUE(session->read(camera, 2).ok());
  }
}

TEST_F(DemoTestSlow, TheUnseenViewIsPredictedBetterThanByThePapersSolver) {
  const auto held_out = result().outcome.report.heldout_rmse;
  ASSERT_TRUE(held_out.has_value());
  EXPECT_LT(recon::all_channels(*held_out), recon::all_channels(*result().paper.report.heldout_rmse));
  const recon::View& view = result().scene.views[static_cast<std::size_t>(result().held_out)];
  const recon::PixelBox box = recon::noise_mask(*view.image).box;
  EXPECT_LT(recon::all_channels(*held_out),
            0.5 * recon::all_channels(recon::rmse(*view.image, recon::RadianceImage(view.image->size), box)))
      << "less than half the error of a black picture";
}

TEST_F(DemoTestSlow, TheReportStandsAlone) {
  ASSERT_TRUE(report::write_demo_report(result(), *folder_).ok());
  std::string page = read_file(*folder_ / "report.html").value();
  for (std::size_t at = 0; (at = page.find("base64,", at)) != std::string::npos; ++at) {
    page.erase(at, page.find('"', at) - at);  // a picture's letters may spell anything
  }
  EXPECT_THAT(page, HasSubstr("held out"));
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  EXPECT_TRUE(fs::exists(*folder_ / "summary.png"));
  EXPECT_TRUE(fs::exists(*folder_ / "reconstruction" / "volume.vdb"));
}

TEST(Demo, OptionsOutOfRangeAreNamed) {
  rig::DemoOptions options;
  options.cameras = 2;
  const auto r = rig::run_demo(options, "/nonexistent/never", {});
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(r.error().message(), HasSubstr("--cameras"));
}

TEST(DemoStopped, KeepsTheStepsThatAreDoneAndNamesThem) {
  const test::TempFolder folder;
  rig::DemoOptions options;
  options.cameras = 4;
  options.image = {320, 240};
  options.voxels = options.truth_voxels = 40;
  // Stopped as soon as the flame is filmed: what is filmed by then is a session.
  bool filming = false;
  const auto result = rig::run_demo(
      options, folder,
      [&](const std::string& title) {
        filming = filming || title == "record the flame";
        return Progress{};
      },
      [&] { return filming; });
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_FALSE(result->whole);
  ASSERT_EQ(result->kept.size(), 2U);
  EXPECT_THAT(result->kept[0], HasSubstr("alignment/: "));
  EXPECT_THAT(result->kept[1], HasSubstr("flame/: 0 frames of 4 cameras"));
  EXPECT_TRUE(rig::replay_align(folder / "alignment").ok());
  EXPECT_TRUE(session::SessionReader::open(folder / "flame").ok());
}

TEST(DemoStopped, BeforeTheFirstStepIsDoneThereIsNothing) {
  const test::TempFolder folder;
  rig::DemoOptions options;
  options.cameras = 3;
  options.image = {320, 240};
  const auto result = rig::run_demo(
      options, folder, [](const std::string&) { return Progress{}; }, [] { return true; });
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_FALSE(result->whole);
  EXPECT_TRUE(result->kept.empty());
}

}  // namespace
}  // namespace emberlock::cli
