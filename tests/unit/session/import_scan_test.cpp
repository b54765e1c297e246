// SPDX-License-Identifier: Apache-2.0
#include "session/media/import_scan.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/media/video_scan.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

void touch(const std::filesystem::path& path) {
  std::filesystem::create_directories(path.parent_path());
  test::put_bytes(path, "x");
}

TEST(ImportScan, OrdersNumbersByTheirValue) {
  EXPECT_TRUE(natural_less("MVI_9.MOV", "MVI_10.MOV"));
  EXPECT_FALSE(natural_less("MVI_10.MOV", "MVI_9.MOV"));
  EXPECT_TRUE(natural_less("cam2/1", "cam10/0"));
  EXPECT_TRUE(natural_less("a", "b"));
  EXPECT_TRUE(natural_less("a", "a1"));
  EXPECT_FALSE(natural_less("a007", "a007"));
  EXPECT_NE(natural_less("a07", "a7"), natural_less("a7", "a07"));
}

TEST(ImportScan, TellsWhichFileIsWhoseAndWhatIsNone) {
  const test::TempFolder temp;
  for (const char* file :
       {"in/cam10.mp4", "in/cam2.MOV", "in/notes.txt", "in/.hidden.mp4", "in/left/DCIM/100/MVI_10.AVI",
        "in/left/DCIM/100/MVI_9.AVI", "in/left/DCIM/100/MVI_9.THM", "in/right/b_0012.png",
        "in/right/b_0003.png", "in/empty/readme.md"})
    touch(temp / file);
  const auto scan = scan_folder(temp / "in", {{{"left", "cam1"}}, {}});
  ASSERT_TRUE(scan.ok()) << scan.error().message();
  std::vector<std::string> ids;
  for (const CameraFiles& camera : scan->cameras) ids.push_back(camera.id);
  EXPECT_THAT(ids, ElementsAre("cam1", "cam2", "cam10", "right"));
  EXPECT_EQ(scan->cameras[0].files.at(0).filename(), "MVI_9.AVI");
  EXPECT_EQ(scan->cameras[0].files.at(1).filename(), "MVI_10.AVI");
  EXPECT_EQ(scan->cameras[3].kind, CameraFiles::Kind::pictures);
  EXPECT_THAT(scan->cameras[3].numbers, ElementsAre(3, 12));
  EXPECT_EQ(scan->passed_over.size(), 3U);
}

TEST(ImportScan, KeepsTheChaptersOfAGoProRecordingTogether) {
  struct Row {
    const char* name;
    const char* recording;  // nullptr: of another camera
    const char* chapter = "";
  };
  for (const auto& [name, recording, chapter] : std::vector<Row>{{"GH010123.MP4", "0123", "01"},
                                                                 {"GX120007.mp4", "0007", "12"},
                                                                 {"GOPR0042.MP4", "0042"},
                                                                 {"GP030042.MP4", "0042", "03"},
                                                                 {"gh020123.mp4", "0123", "02"},
                                                                 {"GHAB0123.MP4", "0123", "AB"},
                                                                 {"MVI_0123.MOV", nullptr},
                                                                 {"GH0123.MP4", nullptr},
                                                                 {"GH010123x.MP4", nullptr}}) {
    const auto found = gopro_chapter(name);
    ASSERT_EQ(found.has_value(), recording != nullptr) << name;
    if (!found) continue;
    EXPECT_EQ(found->recording, recording);
    EXPECT_EQ(found->chapter, chapter);
  }
  const test::TempFolder temp;
  for (const char* file : {"GH010123", "GH010124", "GH020123", "GH020124", "GH110123", "GH100123"})
    touch(temp / "in/left" / (std::string(file) + ".MP4"));
  for (const char* file : {"GOPR0001", "GOPR0002", "GP010001", "GP010002"})
    touch(temp / "in/old" / (std::string(file) + ".MP4"));
  const auto scan = scan_folder(temp / "in");
  ASSERT_TRUE(scan.ok()) << scan.error().message();
  std::vector<std::string> names;
  for (const CameraFiles& camera : scan->cameras) {
    for (const auto& file : camera.files) names.push_back(file.stem());
  }
  EXPECT_THAT(names, ElementsAre("GH010123", "GH020123", "GH100123", "GH110123", "GH010124", "GH020124",
                                 "GOPR0001", "GP010001", "GOPR0002", "GP010002"));
}

TEST(ImportScan, NamesWhatCannotBeTold) {
  const test::TempFolder temp;
  touch(temp / "a/cam.mp4");
  touch(temp / "a/cam.mov");
  EXPECT_THAT(scan_folder(temp / "a").error().message(), HasSubstr("two cameras would be called 'cam'"));
  touch(temp / "b/x/dark.png");
  EXPECT_THAT(scan_folder(temp / "b").error().message(), HasSubstr("no number"));
  touch(temp / "c/x/p1.png");
  touch(temp / "c/x/q1.png");
  EXPECT_THAT(scan_folder(temp / "c").error().message(), HasSubstr("same number"));
  touch(temp / "d/readme.txt");
  EXPECT_THAT(scan_folder(temp / "d").error().message(), HasSubstr("no video files"));
  touch(temp / "e/caméra.mp4");
  EXPECT_THAT(scan_folder(temp / "e").error().message(), HasSubstr("--camera"));
  touch(temp / "f/a.mp4");
  EXPECT_THAT(scan_folder(temp / "f", {{{"b.mp4", "b"}}, {}}).error().message(), HasSubstr("b.mp4"));
  EXPECT_FALSE(scan_folder(temp / "nowhere").ok());
}

TEST(VideoScan, FindsWhereFramesStopFollowingEvenly) {
  std::vector<std::int64_t> even;
  std::vector<std::int64_t> rounded;  // 23.976 a second in milliseconds
  for (std::int64_t i = 0; i < 500; ++i) {
    even.push_back(1001 * i);
    rounded.push_back((i * 1001 * 1000 + 12000) / 24000);
  }
  EXPECT_FALSE(first_irregular(even));
  EXPECT_FALSE(first_irregular(rounded));
  std::vector<std::int64_t> gap = even;
  for (std::size_t i = 321; i < gap.size(); ++i) gap[i] += 1001;
  EXPECT_EQ(first_irregular(gap), 321);
  std::vector<std::int64_t> twice = even;
  twice[77] = twice[76];
  EXPECT_EQ(first_irregular(twice), 77);
  std::vector<std::int64_t> slows = even;
  for (std::size_t i = 0; i < slows.size(); ++i) slows[i] += static_cast<std::int64_t>(i * i / 100);
  EXPECT_TRUE(first_irregular(slows));
}

}  // namespace
}  // namespace emberlock::session
