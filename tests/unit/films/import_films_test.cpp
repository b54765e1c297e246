// SPDX-License-Identifier: Apache-2.0
// What the files of a camera make: one film, or none.
#include "films/import_films.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temp_folder.h"
#include "tests/support/video_writer.h"

namespace emberlock::films {
namespace {

using testing::HasSubstr;

constexpr ImageSize kSize{32, 32};

void put_film(const std::filesystem::path& path) {
  test::VideoWriter writer(path, kSize, {.codec = AV_CODEC_ID_MJPEG, .rate = {25, 1}});
  for (int i = 0; i < 6; ++i) writer.write(Image(ImageLayout{kSize, PixelFormat::gray8, 8}));
  writer.close();
}

TEST(ImportFilms, JoinsOnlyWhatItsNamesDoNotContradict) {
  struct Row {
    std::vector<std::string> files;
    std::string refusal;  // empty: one film
  };
  for (const Row& row :
       std::vector<Row>{{{"MVI_0001", "MVI_0002"}, ""},
                        {{"GH010123", "GH020123", "GH030123"}, ""},
                        {{"GOPR0042", "GP010042"}, ""},
                        {{"GH010123", "GH010124"}, "is of recording 0124, GH010123.mov is of recording 0123"},
                        {{"GOPR0001", "GOPR0002"}, "recording 0002"},
                        {{"GP010001", "GOPR0002"}, "recording 0002"},
                        {{"GX010123", "GX030123"}, "a chapter between them is missing"},
                        {{"GOPR0042", "GP020042"}, "a chapter between them is missing"}}) {
    const test::TempFolder temp;
    session::CameraFiles files{"cam", "cam", session::CameraFiles::Kind::video, {}, {}};
    for (const std::string& name : row.files) {
      files.files.push_back(temp / (name + ".mov"));
      put_film(files.files.back());
    }
    const ProbedFilm probed = probe_film(files, {.continuity = Continuity::as_told});
    ASSERT_EQ(probed.problem.has_value(), !row.refusal.empty()) << row.files.back();
    if (probed.problem) {
      EXPECT_THAT(probed.problem->error.message(), HasSubstr(row.refusal));
    } else {
      EXPECT_EQ(probed.film->frames, static_cast<std::int64_t>(6 * row.files.size()));
    }
  }
}

}  // namespace
}  // namespace emberlock::films
