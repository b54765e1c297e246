// SPDX-License-Identifier: Apache-2.0
#include "apply/front_files.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "recon/export/exr_file.h"
#include "tests/support/recording.h"

namespace emberlock::apply {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr ImageSize kTwo{2, 1};

class FrontFilesTest : public testing::Test {
 protected:
  void put(const std::string& name, int first, int second, int type = CV_16U) const {
    cv::Mat pixels(1, 2, type);
    if (type == CV_16U) {
      pixels.at<std::uint16_t>(0, 0) = static_cast<std::uint16_t>(first);
      pixels.at<std::uint16_t>(0, 1) = static_cast<std::uint16_t>(second);
    } else {
      pixels.at<std::uint8_t>(0, 0) = static_cast<std::uint8_t>(first);
      pixels.at<std::uint8_t>(0, 1) = static_cast<std::uint8_t>(second);
    }
    std::filesystem::create_directories((temp_ / name).parent_path());
    ASSERT_TRUE(cv::imwrite((temp_ / name).string(), pixels));
  }
  [[nodiscard]] Result<FrontFiles> open(const char* mask, const char* depth, std::int64_t frames = 3) const {
    FrontFiles::Sources sources;
    if (mask != nullptr) sources.mask = temp_ / mask;
    if (depth != nullptr) sources.depth = temp_ / depth;
    return FrontFiles::open(sources, kTwo, frames);
  }
  test::TempFolder temp_;
};

TEST_F(FrontFilesTest, PicturesComeInNaturalOrder) {
  for (const int i : {2, 9, 10}) put("d/" + std::to_string(i) + ".png", 100 * i, 0);
  put("mask.png", 0, 255, CV_8U);
  FrontFiles files = open("mask.png", "d").value();
  ASSERT_TRUE(files.check().ok());
  for (const float metres : {0.2F, 0.9F, 1.0F}) {
    const InFront front = files.next().value();
    EXPECT_THAT(front.mask, ElementsAre(0, 255));
    EXPECT_NEAR(front.depth[0], metres, 1e-6);
    EXPECT_EQ(front.depth[1], 0) << "not known";
  }
}

TEST_F(FrontFilesTest, OpenExrIsInMetres) {
  for (const std::vector<float>& values :
       {std::vector<float>{1.25F, 3}, {std::nanf(""), INFINITY}, {-1, -INFINITY}}) {
    ASSERT_TRUE(recon::write_exr(kTwo, {{"A", {9, 9}}, {"Z", values}}, temp_ / "z.exr").ok());
    const InFront front = open(nullptr, "z.exr")->next().value();
    EXPECT_EQ(front.depth, values[1] == 3 ? values : std::vector<float>(2, 0));
  }
  ASSERT_TRUE(recon::write_exr(kTwo, {{"A", {9, 9}}}, temp_ / "a.exr").ok());
  EXPECT_THAT(open(nullptr, "a.exr")->next().error().what, HasSubstr("none of the channels Z, Y, R"));
}

TEST_F(FrontFilesTest, SaysWhatIsWrong) {
  EXPECT_THAT(open("absent", nullptr).error().what, HasSubstr("isn't there"));
  put("d/1.png", 1, 1);
  EXPECT_THAT(open(nullptr, "d").error().what, HasSubstr("holds 1 pictures"));
  put("eight.png", 1, 1, CV_8U);
  EXPECT_THAT(open(nullptr, "eight.png")->check().error().what, HasSubstr("isn't grey of 16 bits"));
  for (const char* name : {"bad.exr", "bad.png"}) {
    std::ofstream(temp_ / name) << "v/1\1 nothing";
    const auto files = open(nullptr, name);
    const Error error = files ? FrontFiles(*files).check().error() : files.error();
    EXPECT_EQ(error.kind, ErrorKind::bad_input);
    EXPECT_THAT(error.where, HasSubstr(name));
  }
}

}  // namespace
}  // namespace emberlock::apply
