// SPDX-License-Identifier: Apache-2.0
// The frames and stamps of foreign films: what the packets state and what the decoder gives are one film.
#include "session/media/video_scan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/media/clip.h"
#include "session/media/frame_file.h"
#include "session/video_writer.h"
#include "tests/support/recording.h"
#include "tests/support/video_writer.h"

namespace emberlock::session {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr ImageSize kSize{64, 48};
constexpr int kFilmFrames = 40;

/// A bar that moves a pixel with each frame: B-frames are worth their bits.
Image moving_bar(int frame) {
  Image image(ImageLayout{kSize, PixelFormat::gray8, 8});
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x)
      image.row_as<std::uint8_t>(y)[x] =
          static_cast<std::uint8_t>(x >= frame && x < frame + 8 ? 200 : 30 + y);
  }
  return image;
}

/// The column at which the bar begins.
int bar_of(const Image& image) {
  int brightest = 0;
  long most = -1;
  for (int x = 0; x + 8 <= kSize.width; ++x) {
    long sum = 0;
    for (int y = 0; y < kSize.height; ++y) {
      for (int i = 0; i < 8; ++i) sum += image.view().row_as<std::uint8_t>(y)[x + i];
    }
    if (sum > most) {
      most = sum;
      brightest = x;
    }
  }
  return brightest;
}

void write_film(const std::filesystem::path& path, const test::VideoFormat& format, int hidden = 0) {
  test::VideoWriter writer(path, kSize, format);
  writer.skip(-hidden);
  for (int i = 0; i < kFilmFrames; ++i) writer.write(moving_bar(i));
  writer.close();
}

struct Kind {
  const char* ending;
  AVCodecID codec;
  int b_frames;

  friend std::ostream& operator<<(std::ostream& out, const Kind& k) {
    return out << avcodec_get_name(k.codec) << " in " << k.ending << " with " << k.b_frames << " B-frames";
  }
};

class EveryContainer : public testing::TestWithParam<Kind> {};

TEST_P(EveryContainer, GivesEachFrameItsStampAndItsPlace) {
  const test::TempFolder temp;
  const auto& [ending, codec, b_frames] = GetParam();
  const std::filesystem::path path = temp / (std::string("film.") + ending);
  write_film(path, {.codec = codec, .rate = {25, 1}, .gop = 12, .b_frames = b_frames});
  const Result<VideoScan> scan = scan_video(path);
  ASSERT_TRUE(scan.ok()) << scan.error().message();
  ASSERT_EQ(scan->frames(), kFilmFrames);
  EXPECT_FALSE(scan->irregular) << scan->irregularity;
  EXPECT_FALSE(scan->truncated());
  EXPECT_NEAR(scan->frame_rate->value(), 25, 1e-3);
  ClipReader reader({{path, *scan, 0}}, Colours::brightness);
  for (const int place : {0, 1, 2, 17, 18, 31, 5, 39, 12}) {
    ASSERT_TRUE(reader.seek(place).ok());
    const Result<Image> image = reader.next();
    ASSERT_TRUE(image.ok()) << image.error().message();
    EXPECT_EQ(bar_of(*image), place);
  }
  EXPECT_EQ(reader.next().ok(), true);
}

INSTANTIATE_TEST_SUITE_P(
    Film, EveryContainer,
    testing::Values(Kind{"mp4", AV_CODEC_ID_H264, 0}, Kind{"mp4", AV_CODEC_ID_H264, 2},
                    Kind{"mov", AV_CODEC_ID_H264, 3}, Kind{"mkv", AV_CODEC_ID_H264, 2},
                    Kind{"ts", AV_CODEC_ID_H264, 2}, Kind{"avi", AV_CODEC_ID_H264, 0},
                    Kind{"avi", AV_CODEC_ID_H264, 1}, Kind{"avi", AV_CODEC_ID_H264, 3},
                    Kind{"mpg", AV_CODEC_ID_MPEG2VIDEO, 0}, Kind{"mpg", AV_CODEC_ID_MPEG2VIDEO, 1},
                    Kind{"mpg", AV_CODEC_ID_MPEG2VIDEO, 2}, Kind{"vob", AV_CODEC_ID_MPEG2VIDEO, 2},
                    Kind{"mpg", AV_CODEC_ID_MPEG1VIDEO, 2}, Kind{"ts", AV_CODEC_ID_MPEG2VIDEO, 2},
                    Kind{"avi", AV_CODEC_ID_MPEG4, 0}, Kind{"avi", AV_CODEC_ID_MPEG4, 2},
                    Kind{"mp4", AV_CODEC_ID_MPEG4, 2}, Kind{"mkv", AV_CODEC_ID_FFV1, 0},
                    Kind{"avi", AV_CODEC_ID_MJPEG, 0}, Kind{"mov", AV_CODEC_ID_MJPEG, 0}));

TEST(VideoScan, AnEditListThatHidesFramesIsNoTruncation) {
  for (int hidden = 0; hidden < 20; ++hidden) {
    const test::TempFolder temp;
    write_film(temp / "film.mp4", {.rate = {25, 1}, .gop = 12, .b_frames = 2}, hidden);
    const Result<VideoScan> scan = scan_video(temp / "film.mp4");
    ASSERT_TRUE(scan.ok()) << scan.error().message();
    EXPECT_EQ(scan->frames(), kFilmFrames - hidden);
    EXPECT_FALSE(scan->truncated()) << hidden;
    EXPECT_FALSE(scan->irregular) << scan->irregularity;
    ClipReader reader({{temp / "film.mp4", *scan, 0}}, Colours::brightness);
    EXPECT_EQ(bar_of(reader.next().value()), hidden);
  }
}

TEST(VideoScan, AFilmWithoutItsEndIsTruncated) {
  const test::TempFolder temp;
  write_film(temp / "film.avi", {.codec = AV_CODEC_ID_MJPEG, .rate = {25, 1}});
  std::filesystem::resize_file(temp / "film.avi", std::filesystem::file_size(temp / "film.avi") / 2);
  const Result<VideoScan> scan = scan_video(temp / "film.avi");
  ASSERT_TRUE(scan.ok()) << scan.error().message();
  EXPECT_TRUE(scan->truncated());
}

TEST(VideoScan, AFilmThatIsNotOpaqueIsRefused) {
  for (const int alpha : {255, 254, 0}) {
    const test::TempFolder temp;
    write_film(temp / "film.mkv", {.codec = AV_CODEC_ID_FFV1, .rate = {25, 1}, .alpha = alpha});
    const Result<VideoScan> scan = scan_video(temp / "film.mkv");
    EXPECT_EQ(scan.ok(), alpha == 255) << alpha;
    const auto film = FrameFile::open(temp / "film.mkv");
    ASSERT_TRUE(film.ok()) << film.error().message();
    const Result<Image> image = (*film)->next();
    if (alpha == 255) {
      EXPECT_EQ(bar_of(image.value()), 0);
    } else {
      EXPECT_THAT(image.error().message(), HasSubstr("film.mkv, frame 1: is transparent"));
    }
  }
}

TEST(VideoScan, ReportsADisplayMatrixAndPixelsThatAreNotSquare) {
  constexpr std::int32_t k1 = 1 << 16;
  constexpr std::int32_t kLast = 1 << 30;
  struct Row {
    std::array<std::int32_t, 4> turn;  // of the matrix
    int pixel_width, pixel_height;
    std::vector<std::string> fields;
  };
  const std::vector<Row> rows{
      {{k1, 0, 0, k1}, 1, 1, {}},
      {{0, k1, -k1, 0}, 1, 1, {"turned by 90"}},
      {{-k1, 0, 0, -k1}, 1, 1, {"turned by 180"}},
      {{0, -k1, k1, 0}, 1, 1, {"turned by 270"}},
      {{-k1, 0, 0, k1}, 1, 1, {"mirrored"}},
      {{k1, 0, 0, k1}, 4, 3, {"4:3"}},
      {{0, k1, -k1, 0}, 16, 15, {"turned by 90", "16:15"}},
  };
  for (const Row& row : rows) {
    const test::TempFolder temp;
    const auto& t = row.turn;
    const VideoDisplay display{
        {{t[0], t[1], 0, t[2], t[3], 0, 0, 0, kLast}}, row.pixel_width, row.pixel_height};
    auto writer = VideoWriter::create(temp / "film.mp4", {kSize, PixelFormat::gray8, 8}, Hertz(25), 0,
                                      VideoWriter::Coding::for_players, display);
    ASSERT_TRUE(writer.ok());
    for (int i = 0; i < 5; ++i) ASSERT_TRUE((*writer)->show(moving_bar(i)).ok());
    ASSERT_TRUE((*writer)->close().ok());
    const Result<VideoScan> scan = scan_video(temp / "film.mp4");
    ASSERT_TRUE(scan.ok()) << scan.error().message();
    ASSERT_EQ(scan->unapplied.size(), row.fields.size());
    for (std::size_t i = 0; i < row.fields.size(); ++i)
      EXPECT_THAT(scan->unapplied[i], HasSubstr(row.fields[i]));
    EXPECT_EQ(scan->size.width, kSize.width) << "frames stay as they are stored";
  }
}

}  // namespace
}  // namespace emberlock::session
