// SPDX-License-Identifier: Apache-2.0
// From frames to the pictures that consoles show: every format, the newest of each camera, and none that
// nobody wants.
#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "base/clock.h"
#include "daemon/server/pictures.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

/// Of one level everywhere; a mosaic and RGB of (r, g, b) levels.
Frame flat_frame(PixelFormat format, int bit_depth, ImageSize size, int r, int g, int b) {
  auto image = std::make_shared<Image>(ImageLayout{size, format, bit_depth});
  for (int y = 0; y < size.height; ++y) {
    for (int i = 0; i < size.width * channels(format); ++i) {
      int level = r;
      if (channels(format) == 3) level = i % 3 == 0 ? r : i % 3 == 1 ? g : b;
      if (is_bayer(format)) level = y % 2 == 0 ? (i % 2 == 0 ? r : g) : (i % 2 == 0 ? g : b);
      if (bytes_per_sample(format) == 2)
        image->row_as<std::uint16_t>(y)[i] = static_cast<std::uint16_t>(level);
      else
        image->row_as<std::uint8_t>(y)[i] = static_cast<std::uint8_t>(level);
    }
  }
  Frame frame{.stamp = {}, .image = image};
  frame.stamp.frame_id = 7;
  frame.stamp.monotonic_time = {123};
  return frame;
}

cv::Mat decoded(const v1::Picture& picture) {
  const std::vector<char> bytes(picture.jpeg().begin(), picture.jpeg().end());
  return cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
}

TEST(MakePicture, EveryFormatShowsItsLevelsInEightBits) {
  const struct {
    PixelFormat format;
    int bit_depth;
    int scale;
  } cases[] = {{PixelFormat::gray8, 8, 1},         {PixelFormat::gray16, 12, 16},
               {PixelFormat::gray16, 16, 257},     {PixelFormat::bayer_rggb8, 8, 1},
               {PixelFormat::bayer_rggb16, 10, 4}, {PixelFormat::rgb8, 8, 1},
               {PixelFormat::rgb16, 12, 16}};
  for (const auto& c : cases) {
    const Frame frame =
        flat_frame(c.format, c.bit_depth, {64, 48}, 200 * c.scale, 100 * c.scale, 50 * c.scale);
    const auto picture = make_picture("a", frame, {.width = 32, .quality = 95});
    ASSERT_TRUE(picture.ok());
    const cv::Mat image = decoded(*picture);
    EXPECT_EQ(image.size(), cv::Size(32, 24)) << name(c.format);
    const cv::Scalar mean = cv::mean(image);  // blue, green, red
    if (image.channels() == 1) {
      EXPECT_NEAR(mean[0], 200, 2) << name(c.format);
    } else {
      EXPECT_NEAR(mean[2], 200, 4) << name(c.format);
      EXPECT_NEAR(mean[1], 100, 4) << name(c.format);
      EXPECT_NEAR(mean[0], 50, 4) << name(c.format);
    }
  }
}

TEST(MakePicture, KeepsTheShapeAndEnlargesNothing) {
  const auto wide =
      make_picture("a", flat_frame(PixelFormat::gray8, 8, {1280, 720}, 9, 9, 9), {.width = 480});
  ASSERT_TRUE(wide.ok());
  EXPECT_EQ(wide->width(), 480U);
  EXPECT_EQ(wide->height(), 270U);
  EXPECT_EQ(wide->frame_id(), 7U);
  EXPECT_EQ(wide->monotonic_ns(), 123);
  const auto small = make_picture("a", flat_frame(PixelFormat::gray8, 8, {100, 60}, 9, 9, 9), {.width = 480});
  EXPECT_EQ(small->width(), 100U);
}

TEST(MakePicture, AFrameWithoutPixelsIsAnError) {
  EXPECT_FALSE(make_picture("a", {.stamp = {}, .image = std::make_shared<Image>()}, {}).ok());
}

TEST(PicturesThreads, NobodyWantsThemNoneAreMade) {
  Board board;
  Pictures pictures(board, {});
  pictures.offer("a", flat_frame(PixelFormat::gray8, 8, {64, 48}, 1, 1, 1));
  const Subscription wanted = board.want_pictures();
  pictures.offer("b", flat_frame(PixelFormat::gray8, 8, {64, 48}, 1, 1, 1));
  ASSERT_TRUE(test::wait_until([&] { return !board.pictures().empty(); }));
  EXPECT_EQ(board.pictures().begin()->first, "b");
}

TEST(PicturesThreads, ACameraThatFilmsFastIsShownAtTheRateAskedFor) {
  Board board;
  Pictures pictures(board, {.rate = Hertz(10)});
  const Subscription wanted = board.want_pictures();
  std::atomic<int> shown = 0;
  const Subscription counting = board.subscribe([&](Board::Topic topic) {
    if (topic == Board::Topic::pictures) ++shown;
  });
  Frame frame = flat_frame(PixelFormat::gray8, 8, {64, 48}, 1, 1, 1);
  const TimePoint begun = SteadyClock().now();
  while (SteadyClock().now() < begun + Seconds(0.5)) {
    ++frame.stamp.frame_id;
    pictures.offer("a", frame);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const Seconds elapsed = SteadyClock().now() - begun;
  EXPECT_GE(shown, 1);
  EXPECT_LE(shown, 2 + Hertz(10) * elapsed);  // one at once, one early; a busy machine makes fewer
}

}  // namespace
}  // namespace emberlock::daemon
