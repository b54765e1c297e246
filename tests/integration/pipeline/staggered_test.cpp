// SPDX-License-Identifier: Apache-2.0
// Staggered cameras from the film to volumes between the frames.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "base/file.h"
#include "cli/commands.h"
#include "report/sequence_report.h"
#include "rig/simulate/simulate_flame.h"
#include "session/reader.h"
#include "session/shutter_times.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Staggered : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    fs::remove_all(folder());
    fs::create_directories(folder() / "film");
    rig::SimulateOptions o;
    o.frames = 4;
    o.cameras = 5;
    o.image = {64, 64};
    o.cells = 8;
    o.stagger = true;
    const auto filmed = rig::simulate_flame(o, folder() / "film");
    ASSERT_TRUE(filmed.ok()) << filmed.error().message();
  }
  static void TearDownTestSuite() { fs::remove_all(folder()); }
  Staggered() { fs::remove_all(out()); }

  static fs::path folder() {
    return fs::path(testing::TempDir()) / ("staggered-" + std::to_string(::getpid()));
  }
  static fs::path session() { return folder() / "film" / "session"; }
  [[nodiscard]] test::VerbRun reconstruct(const fs::path& input, const std::string& frames,
                                          const std::vector<std::string>& more) const {
    std::vector<std::string> words = {"reconstruct",  input.string(), "--frames", frames,     "--out",
                                      out().string(), "--voxels",     "16",       "--device", "cpu"};
    words.insert(words.end(), more.begin(), more.end());
    return test::run_verb(add_reconstruct, words);
  }
  [[nodiscard]] static fs::path out() { return folder() / "out"; }
  [[nodiscard]] report::SequenceTold told() const {
    const fs::path path = out() / "sequence" / "frames.json";
    return report::parse_sequence(read_file(path).value(), path.string()).value();
  }
};

TEST_F(Staggered, VolumesBetweenTheFramesAreNumberedAndTimed) {
  const test::VerbRun run = reconstruct(session(), "1:2", {"--instants", "3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const report::SequenceTold sequence = told();
  EXPECT_EQ(sequence.instants, 3);
  ASSERT_EQ(sequence.frames.size(), 4U) << "of frame 1, two between, of frame 2";
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(sequence.frames[i].frame, 3 + i);
    EXPECT_NEAR(sequence.frames[i].time->value(), (1 + static_cast<double>(i) / 3) / 24, 1e-6);
    EXPECT_TRUE(fs::exists(out() / ("volume_000" + std::to_string(3 + i) + ".vdb")));
  }
  const test::VerbRun other = reconstruct(session(), "1:2", {"--instants", "2"});
  EXPECT_THAT(other.err, HasSubstr("holds a sequence of 3 instants a frame period"));
  EXPECT_EQ(reconstruct(session(), "1:2", {"--instants", "3"}).exit_code, 0) << "all are done";
}

TEST_F(Staggered, TheSameInstantsEachAsIfItWereAlone) {
  const test::VerbRun run = reconstruct(session(), "1:2", {"--instants", "2", "--every", "2", "--cold"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(fs::exists(out() / "frame-2" / "volume.vdb"));
  EXPECT_TRUE(fs::exists(out() / "frame-4" / "volume.vdb"));
  EXPECT_FALSE(fs::exists(out() / "frame-3"));
}

TEST_F(Staggered, CamerasAtOneInstantSeeNothingBetweenTheirFrames) {
  const fs::path at_once = folder() / "at-once";
  fs::copy(session(), at_once, fs::copy_options::recursive);
  v1::ShutterTimes times =
      session::read_shutter_times(session::SessionReader::open(at_once).value()).value().value();
  for (v1::ShutterTimes::Camera& camera : *times.mutable_cameras())
    for (double& late : *camera.mutable_late_s()) late = 0.001;
  ASSERT_TRUE(session::write_shutter_times(at_once, times).ok());
  const test::VerbRun run = reconstruct(at_once, "1:2", {"--instants", "3"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("no camera films in 100 % of the frame period"));
}

TEST_F(Staggered, TheFirstFrameLacksPicturesFromBefore) {
  const test::VerbRun run = reconstruct(session(), "0:0", {"--instants", "3"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("has no complete frame within half a frame period"));
  const test::VerbRun single =
      test::run_verb(add_reconstruct, {"reconstruct", "session", "--out", out().string(), "--instants", "3"});
  EXPECT_EQ(single.exit_code, 2);
  EXPECT_THAT(single.err, HasSubstr("--instants requires --frames or --last-frame"));
}

}  // namespace
}  // namespace emberlock::cli
