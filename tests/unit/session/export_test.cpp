// SPDX-License-Identifier: Apache-2.0
#include "session/export.h"

#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "session/files.h"
#include "session/media/frame_file.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::manifest_of;
using test::noise_frame;
using test::record;
using test::small_disk_options;
using test::TempFolder;

class ExportLayouts : public testing::TestWithParam<ImageLayout> {};

TEST_P(ExportLayouts, ToPngKeepsEverySample) {
  const TempFolder temp;
  record(temp / "s", GetParam(), 4, small_disk_options());
  const auto report = export_session(temp / "s", temp / "out", ExportFormat::png);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->cameras.at(0).frames, 4U);
  for (std::uint64_t i = 0; i < 4; ++i) {
    const auto image = read_image(temp / ("out/cam0/00000" + std::to_string(i) + ".png"));
    ASSERT_TRUE(image) << image.error().message();
    EXPECT_EQ(image->bytes(), noise_frame(GetParam(), i).image->bytes());
    EXPECT_EQ(image->layout().size, GetParam().size);
  }
}

TEST_P(ExportLayouts, ToVideoShowsEveryFrame) {
  const TempFolder temp;
  record(temp / "s", GetParam(), 7, small_disk_options());
  const auto report = export_session(temp / "s", temp / "out", ExportFormat::video);
  ASSERT_TRUE(report) << report.error().message();
  const auto video = FrameFile::open(temp / "out/cam0.mp4");
  ASSERT_TRUE(video) << video.error().message();
  EXPECT_NEAR((*video)->claims().frame_rate->value(), 100, 1e-6);
  int frames = 0;
  for (auto image = (*video)->next(); image.ok(); image = (*video)->next()) {
    EXPECT_EQ(image->layout().size.width, GetParam().size.width & ~1);
    ++frames;
  }
  EXPECT_EQ(frames, 7);
}

INSTANTIATE_TEST_SUITE_P(Export, ExportLayouts,
                         testing::Values(ImageLayout{{33, 17}, PixelFormat::gray8, 8},
                                         ImageLayout{{64, 48}, PixelFormat::gray16, 12},
                                         ImageLayout{{64, 48}, PixelFormat::bayer_rggb8, 8},
                                         ImageLayout{{64, 48}, PixelFormat::bayer_rggb16, 10},
                                         ImageLayout{{64, 48}, PixelFormat::rgb8, 8},
                                         ImageLayout{{64, 48}, PixelFormat::rgb16, 16}));

/// A camera whose picture is as bright as `level` of 0..1 all over.
Frame flat_frame(const ImageLayout& layout, std::uint64_t id, double level) {
  Frame frame = noise_frame(layout, id);
  Image image(layout);
  for (std::byte& b : image.bytes()) b = static_cast<std::byte>(std::lround(level * 255));
  frame.image = std::make_shared<const Image>(std::move(image));
  return frame;
}

TEST(Export, AVideosTimeRunsOnThroughGapsAndWhatWasFilledIsSaid) {
  const TempFolder temp;
  const ImageLayout layout{{64, 48}, PixelFormat::gray8, 8};
  auto writer = SessionWriter::create(temp / "s", manifest_of({layout}), small_disk_options());
  ASSERT_TRUE(writer);
  for (const std::uint64_t id : {0, 1, 2, 7, 8})
    ASSERT_TRUE(writer->write(0, flat_frame(layout, id, id < 5 ? .2 : .8)));
  ASSERT_TRUE(writer->finish());
  const auto report = export_session(temp / "s", temp / "out", ExportFormat::video);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->cameras.at(0).gaps, 1U);
  EXPECT_EQ(report->cameras.at(0).repeated, 4U);
  EXPECT_NEAR(report->cameras.at(0).frame_rate.value(), 100, 1e-6);
  const auto video = FrameFile::open(temp / "out/cam0.mp4", Colours::brightness);
  ASSERT_TRUE(video);
  for (std::uint64_t i = 0; i < 9; ++i) {
    const auto image = (*video)->next();
    ASSERT_TRUE(image) << i;
    EXPECT_NEAR(image->view().sample(30, 20) / 255.0, i < 7 ? .2 : .8, .02) << i;
  }
  EXPECT_FALSE((*video)->next());
}

/// The difference of the brightest and the darkest pixel of a picture's last rows.
double contrast_below(const Image& image) {
  double low = 255;
  double high = 0;
  for (int x = 0; x < image.layout().size.width; ++x) {
    low = std::min<double>(low, image.view().sample(x, image.layout().size.height - 1));
    high = std::max<double>(high, image.view().sample(x, image.layout().size.height - 1));
  }
  return high - low;
}

// A machine that lags stamps frames late; the camera's own clock, and its numbers, know better.
TEST(Export, AVideoHasTheCamerasOwnRateAndMarksWhatItRepeats) {
  const TempFolder temp;
  const ImageLayout layout{{96, 64}, PixelFormat::gray8, 8};
  v1::Manifest manifest = manifest_of({layout});
  manifest.mutable_cameras(0)->set_frame_rate_hz(23.976);
  auto writer = SessionWriter::create(temp / "s", manifest, small_disk_options());
  ASSERT_TRUE(writer);
  for (const std::int64_t id : {0, 1, 2, 5, 6, 7}) {
    Frame frame = flat_frame(layout, static_cast<std::uint64_t>(id), .4);
    frame.stamp.device_time.ns = 77 + id * 41'708'000;        // 23.9762 Hz
    frame.stamp.monotonic_time.ns = 1'000 + id * 48'300'000;  // 20.7 Hz
    ASSERT_TRUE(writer->write(0, frame));
  }
  ASSERT_TRUE(writer->finish());
  const auto report = export_session(temp / "s", temp / "out", ExportFormat::video);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_NEAR(report->cameras.at(0).frame_rate.value(), 23.976, 1e-9);
  EXPECT_EQ(report->cameras.at(0).repeated, 2U);
  const auto video = FrameFile::open(temp / "out/cam0.mp4", Colours::brightness);
  ASSERT_TRUE(video);
  EXPECT_NEAR((*video)->claims().frame_rate->value(), 23.976, 1e-3);
  for (std::uint64_t i = 0; i < 8; ++i) {
    const auto image = (*video)->next();
    ASSERT_TRUE(image) << i;
    EXPECT_EQ(contrast_below(*image) > 100, i == 3 || i == 4) << i;
    EXPECT_NEAR(image->view().sample(30, 20) / 255.0, .4, .02) << i;
  }
}

TEST(Export, ACameraThatClaimsAnotherRateThanItHasIsShownAtItsOwn) {
  const TempFolder temp;
  const ImageLayout layout{{64, 48}, PixelFormat::gray8, 8};
  v1::Manifest manifest = manifest_of({layout});
  manifest.mutable_cameras(0)->set_frame_rate_hz(30);
  auto writer = SessionWriter::create(temp / "s", manifest, small_disk_options());
  ASSERT_TRUE(writer);
  for (std::uint64_t id = 0; id < 4; ++id) ASSERT_TRUE(writer->write(0, flat_frame(layout, id, .4)));
  ASSERT_TRUE(writer->finish());
  const auto report = export_session(temp / "s", temp / "out", ExportFormat::video);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_NEAR(report->cameras.at(0).frame_rate.value(), 100, 1e-6);
}

TEST(Export, WhatCannotBeReadIsLeftOutAndCounted) {
  const TempFolder temp;
  const ImageLayout layout{{64, 48}, PixelFormat::gray8, 8};
  record(temp / "s", layout, 6, small_disk_options());
  const auto path = find_segment(temp / "s", "cam0", 0);
  std::string bytes = test::bytes_of(path);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  test::put_bytes(path, bytes);
  const auto report = export_session(temp / "s", temp / "out", ExportFormat::png);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->cameras.at(0).frames, 5U);
  EXPECT_EQ(report->cameras.at(0).unreadable, 1U);
  EXPECT_EQ(report->cameras.at(0).gaps, 1U);
  std::ifstream stamps(temp / "out/cam0/frames.csv");
  std::string line;
  int lines = 0;
  while (std::getline(stamps, line)) ++lines;
  EXPECT_EQ(lines, 6);
}

TEST(Export, EndedOrInTheWayOfOtherFilesItLeavesNothingBehind) {
  const TempFolder temp;
  const ImageLayout layout{{64, 48}, PixelFormat::gray8, 8};
  record(temp / "s", layout, 6, small_disk_options());
  int asked = 0;
  const auto ended = export_session(temp / "s", temp / "out", ExportFormat::png,
                                    [&](double, std::string_view) { return ++asked < 4; });
  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().kind, ErrorKind::refused);
  EXPECT_FALSE(std::filesystem::exists(temp / "out"));
  EXPECT_EQ(export_session(temp / "s", temp / "s", ExportFormat::png).error().kind, ErrorKind::bad_input);
  EXPECT_TRUE(SessionReader::open(temp / "s"));
}

}  // namespace
}  // namespace emberlock::session
