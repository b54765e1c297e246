// SPDX-License-Identifier: Apache-2.0
// Real videos that change their size: H.264 of two sizes, joined by ffmpeg (package ffmpeg, which
// scripts/setup installs) without coding it again, and by cat.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>

#include "cli/commands.h"
#include "recon/export/volume_file.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"
#include "tests/support/small_scene.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

class SizeChangeTest : public testing::TestWithParam<const char*> {
 protected:
  /// Ten frames of 160 x 120 and ten of 96 x 64.
  void SetUp() override {
    const std::string in = "cd " + temp_.path().string() + " && ffmpeg -v error -y ";
    for (const auto& [name, size] : {std::pair("wide", "160x120"), std::pair("small", "96x64")}) {
      const std::string film = in + "-f lavfi -i testsrc=size=" + size + ":rate=25:duration=0.4 " +
                               "-c:v libx264 -pix_fmt yuv420p -g 5 " + name + ".mp4";
      ASSERT_EQ(shell(film).status, 0);
      ASSERT_EQ(shell(in + "-i " + name + ".mp4 -c copy " + name + ".ts").status, 0);
    }
    test::put_bytes(temp_ / "list", "file 'wide.mp4'\nfile 'small.mp4'\n");
    for (const char* end : {"mkv", "mp4", "ts"})
      ASSERT_EQ(shell(in + "-f concat -i list -c copy two." + end).status, 0);
    test::put_bytes(temp_ / "cat.ts", test::bytes_of(temp_ / "wide.ts") + test::bytes_of(temp_ / "small.ts"));
  }
  [[nodiscard]] test::VerbRun ar(const std::string& film) const {
    const recon::Volume volume =
        test::volume_of({{-0.1F, -0.1F, 0.1F}, 0.02F, 11, 11, 11}, [](int i, int, int) {
          return std::array<float, 4>{i == 5 ? 100.0F : 0, 0, 0, 0};
        });
    fs::create_directories(temp_ / "fire");
    EXPECT_TRUE(recon::write_volume(volume, temp_ / "fire/volume.vdb").ok());
    return test::run_verb(
        add_ar, {"ar", (temp_ / film).string(), (temp_ / "fire").string(), "--out", (temp_ / "out").string(),
                 "--marker", "aruco:4X4_50:7:80mm", "--focal", "200"});
  }
  void expect_nothing_written() const {
    for (const auto& entry : fs::directory_iterator(temp_.path()))
      EXPECT_THAT(entry.path().filename().string(), testing::Not(HasSubstr("out")));
  }

  test::TempFolder temp_;
};

TEST_P(SizeChangeTest, ArNamesTheFrameAndBothSizes) {
  const std::string film = std::string("two.") + GetParam();
  const auto refused = ar(film);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr(film + ": frame 10 has 96 x 64 pixels, and those before it 160 x 120"));
  expect_nothing_written();
}

TEST_P(SizeChangeTest, ImportNamesTheFrameAndBothSizes) {
  fs::create_directories(temp_ / "films");
  for (const char* camera : {"left", "right"})
    fs::copy_file(temp_ / (std::string("two.") + GetParam()),
                  temp_ / (std::string("films/") + camera + "." + GetParam()));
  const auto refused = test::run_verb(add_import, {"import", (temp_ / "films").string(), "--unsynchronised",
                                                   "--out", (temp_ / "session").string()});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("frame 10 has 96 x 64 pixels, and those before it 160 x 120"));
  EXPECT_FALSE(fs::exists(temp_ / "session"));
  EXPECT_FALSE(fs::exists(temp_ / "session.importing")) << "no camera of it is complete";
}

using SizeChangeJoined = SizeChangeTest;

INSTANTIATE_TEST_SUITE_P(Containers, SizeChangeTest, testing::Values("mkv", "mp4", "ts"));

/// The second stream counts its packets anew, which is all that a reader can tell from one that lost some.
TEST_F(SizeChangeJoined, StreamsJoinedByCatAreNoTruncatedFile) {
  const auto refused = ar("cat.ts");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("cat.ts, frame "));
  EXPECT_THAT(refused.err, HasSubstr("the video is damaged: data are missing, or another recording begins"));
  expect_nothing_written();
}

}  // namespace
}  // namespace emberlock::cli
