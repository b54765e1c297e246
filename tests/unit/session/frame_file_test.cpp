// SPDX-License-Identifier: Apache-2.0
#include "session/media/frame_file.h"

#include <array>
#include <string>
#include <vector>

#include <fitsio.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "session/media/frame_decoders.h"
#include "session/segment.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::noise_image;
using test::put_bytes;
using test::TempFolder;

cv::Mat to_mat(const Image& image) {
  const ImageLayout& l = image.layout();
  const int type = CV_MAKETYPE(bytes_per_sample(l.format) == 2 ? CV_16U : CV_8U, channels(l.format));
  cv::Mat mat(l.size.height, l.size.width, type, const_cast<std::byte*>(image.view().data));
  if (channels(l.format) == 1) return mat.clone();
  cv::Mat bgr(mat.size(), type);
  const int from_to[] = {0, 2, 1, 1, 2, 0};
  cv::mixChannels(&mat, 1, &bgr, 1, from_to, 3);
  return bgr;
}

std::string pgm(const std::string& header, std::size_t bytes) { return header + std::string(bytes, '\x01'); }

struct Lossless {
  const char* suffix;
  PixelFormat format;
  int bit_depth;
};

class LosslessImage : public testing::TestWithParam<Lossless> {};

TEST_P(LosslessImage, KeepsEverySampleWhateverItsNameSays) {
  const TempFolder temp;
  const auto& [suffix, format, bit_depth] = GetParam();
  const Image image = noise_image({{33, 17}, format, bit_depth}, 5);
  const std::string path = (temp / (std::string("x") + suffix)).string();
  ASSERT_TRUE(cv::imwrite(path, to_mat(image)));
  std::filesystem::rename(path, temp / "misnamed.mp4");
  const auto read = read_image(temp / "misnamed.mp4");
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(*read, image);
}

INSTANTIATE_TEST_SUITE_P(
    FrameFile, LosslessImage,
    testing::Values(Lossless{".png", PixelFormat::gray8, 8}, Lossless{".png", PixelFormat::gray16, 16},
                    Lossless{".png", PixelFormat::rgb8, 8}, Lossless{".png", PixelFormat::rgb16, 16},
                    Lossless{".tiff", PixelFormat::gray8, 8}, Lossless{".tiff", PixelFormat::gray16, 16},
                    Lossless{".tiff", PixelFormat::rgb8, 8}, Lossless{".tiff", PixelFormat::rgb16, 16},
                    Lossless{".pgm", PixelFormat::gray8, 8}, Lossless{".pgm", PixelFormat::gray16, 16},
                    Lossless{".ppm", PixelFormat::rgb8, 8}, Lossless{".ppm", PixelFormat::rgb16, 16}));

TEST(FrameFile, AnImageHasOneFrame) {
  const TempFolder temp;
  put_bytes(temp / "a.pgm", "P5 2 2 255\nabcd");
  auto file = FrameFile::open(temp / "a.pgm");
  ASSERT_TRUE(file);
  EXPECT_EQ((*file)->next()->view().sample(1, 1), 'd');
  EXPECT_EQ((*file)->next().error().kind, ErrorKind::out_of_data);
}

TEST(FrameFile, APgmsMaximumValueIsItsBitDepth) {
  const TempFolder temp;
  put_bytes(temp / "a.pgm",
            "P5\n# by a camera\n2 1 # width, height\n4095\n" + std::string("\x01\x02\x0f\xff", 4));
  const auto image = read_image(temp / "a.pgm");
  ASSERT_TRUE(image) << image.error().message();
  EXPECT_EQ(image->layout(), (ImageLayout{{2, 1}, PixelFormat::gray16, 12}));
  EXPECT_EQ(image->view().sample(0, 0), 0x102);
  EXPECT_EQ(image->view().sample(1, 0), 4095);
}

TEST(FrameFile, AJpegIsReadAsItLiesAtItsOwnSize) {
  const TempFolder temp;
  const cv::Mat gray(16, 32, CV_8U, cv::Scalar(100));
  ASSERT_TRUE(cv::imwrite((temp / "a.jpg").string(), gray));
  const auto image = read_image(temp / "a.jpg");
  ASSERT_TRUE(image) << image.error().message();
  EXPECT_EQ(image->layout(), (ImageLayout{{32, 16}, PixelFormat::gray8, 8}));
  EXPECT_NEAR(image->view().sample(9, 9), 100, 2);
}

TEST(FrameFile, CutAnywhereIsAnErrorThatNamesTheFile) {
  const TempFolder temp;
  for (const std::string suffix : {".png", ".jpg", ".tiff", ".pgm", ".ppm"}) {
    const Image image =
        noise_image({{40, 30}, suffix == ".pgm" ? PixelFormat::gray8 : PixelFormat::rgb8, 8}, 1);
    ASSERT_TRUE(cv::imwrite((temp / ("whole" + suffix)).string(), to_mat(image)));
    const std::string bytes = test::bytes_of(temp / ("whole" + suffix));
    for (const double part : {0.001, 0.01, 0.1, 0.5, 0.9}) {
      const auto path = temp / ("cut" + suffix);
      put_bytes(path, std::string_view(bytes).substr(
                          0, static_cast<std::size_t>(part * static_cast<double>(bytes.size()))));
      auto file = FrameFile::open(path);
      ASSERT_FALSE(file) << suffix << " " << part;
      EXPECT_EQ(file.error().kind, ErrorKind::bad_input);
      EXPECT_NE(file.error().message().find("cut" + suffix), std::string::npos);
      EXPECT_FALSE(file.error().remedy.empty());
    }
  }
}

TEST(FrameFile, WhatIsNoFileOfFramesIsSaid) {
  const TempFolder temp;
  put_bytes(temp / "empty", "");
  put_bytes(temp / "text", "dear diary, today the flame went out early\n");
  put_bytes(temp / "playlist", "#EXTM3U\n#EXTINF:1,\nhttp://example.org/a.ts\n");
  const std::pair<std::filesystem::path, std::string> cases[] = {
      {temp / "absent", "No such file"}, {temp / "empty", "empty"},           {temp.path(), "regular file"},
      {temp / "text", "not an image"},   {temp / "playlist", "not an image"}, {"/dev/null", "regular file"},
  };
  for (const auto& [path, words] : cases) {
    const auto file = FrameFile::open(path);
    ASSERT_FALSE(file) << path;
    EXPECT_EQ(file.error().kind, ErrorKind::bad_input);
    EXPECT_NE(file.error().message().find(words), std::string::npos) << file.error().message();
  }
}

TEST(FrameFile, HugeOrSenselessSizesAreRefusedBeforeMemoryIsAsked) {
  const TempFolder temp;
  for (const std::string& bytes :
       {pgm("P5 1000000 1000000 255\n", 64), pgm("P5 0 5 255\n", 64), pgm("P5 5 5 0\n", 64),
        pgm("P5 5 5 70000\n", 64), pgm("P5 99999999999999999999 5 255\n", 64), pgm("P5 #", 0)}) {
    put_bytes(temp / "a.pgm", bytes);
    const auto image = read_image(temp / "a.pgm");
    ASSERT_FALSE(image) << bytes;
    EXPECT_EQ(image.error().kind, ErrorKind::bad_input);
  }
  ASSERT_TRUE(cv::imwrite((temp / "a.png").string(), cv::Mat::zeros(4, 4, CV_8U)));
  std::string png = test::bytes_of(temp / "a.png");
  png[16] = 0x7f;  // the width's highest byte
  put_bytes(temp / "a.png", png);
  EXPECT_NE(read_image(temp / "a.png").error().message().find("16384"), std::string::npos);
}

TEST(FrameFile, APicturesSizeIsKnownBeforeItIsDecoded) {
  const TempFolder temp;
  for (const char* name : {"a.png", "a.jpg"}) {
    ASSERT_TRUE(cv::imwrite((temp / name).string(), cv::Mat::zeros(5, 7, CV_8U)));
    const std::string bytes = test::bytes_of(temp / name);
    const auto size = picture_size(bytes, name);
    ASSERT_TRUE(size) << size.error().message();
    EXPECT_EQ(*size, (ImageSize{7, 5}));
    EXPECT_FALSE(picture_size(bytes.substr(0, bytes.size() / 2), name));
  }
  EXPECT_FALSE(picture_size(pgm("P5 4 4 255\n", 16), "a.pgm")) << "neither";
  EXPECT_FALSE(picture_size("", "empty"));
}

/// A FITS file of 3 x 2 pixels by cfitsio itself; `values` in file order.
void write_fits(const std::filesystem::path& path, int bitpix, const std::vector<double>& values,
                double scale = 1, double zero = 0) {
  fitsfile* file = nullptr;
  int status = 0;
  fits_create_file(&file, ("!" + path.string()).c_str(), &status);
  std::array<long, 2> size{3, 2};
  fits_create_img(file, bitpix, 2, size.data(), &status);
  if (scale != 1 || zero != 0) {
    fits_update_key(file, TDOUBLE, "BSCALE", &scale, nullptr, &status);
    fits_update_key(file, TDOUBLE, "BZERO", &zero, nullptr, &status);
    fits_set_bscale(file, scale, zero, &status);
  }
  std::vector<double> copy = values;
  fits_write_img(file, TDOUBLE, 1, static_cast<LONGLONG>(copy.size()), copy.data(), &status);
  fits_close_file(file, &status);
  ASSERT_EQ(status, 0);
}

TEST(FrameFile, FitsOfEveryKindKeepsPhysicalValuesAndTheOrderOfTheFile) {
  const TempFolder temp;
  const std::vector<double> values{0, 1, 2, 100, 200, 250};
  for (const int bitpix : {BYTE_IMG, SHORT_IMG, LONG_IMG, FLOAT_IMG, DOUBLE_IMG}) {
    write_fits(temp / "a.fits", bitpix, values);
    const auto image = read_image(temp / "a.fits");
    ASSERT_TRUE(image) << image.error().message();
    EXPECT_EQ(image->layout().format, bitpix == BYTE_IMG ? PixelFormat::gray8 : PixelFormat::gray16);
    for (int i = 0; i < 6; ++i)
      EXPECT_EQ(image->view().sample(i % 3, i / 3), values[static_cast<std::size_t>(i)]);
  }
  write_fits(temp / "u.fits", SHORT_IMG, {0, 1, 32768, 65535, 40000, 7}, 1, 32768);
  const auto image = read_image(temp / "u.fits");
  ASSERT_TRUE(image) << image.error().message();
  EXPECT_EQ(image->view().sample(2, 0), 32768);
  EXPECT_EQ(image->view().sample(0, 1), 65535);
}

TEST(FrameFile, FitsValuesBeyondSixteenBitsAreClampedAndBlanksAreZero) {
  const TempFolder temp;
  write_fits(temp / "a.fits", FLOAT_IMG, {-5, 1e9, 2.4, 2.6, std::nan(""), 3});
  const auto image = read_image(temp / "a.fits");
  ASSERT_TRUE(image) << image.error().message();
  const std::array<int, 6> expected{0, 65535, 2, 3, 0, 3};
  for (int i = 0; i < 6; ++i)
    EXPECT_EQ(image->view().sample(i % 3, i / 3), expected[static_cast<std::size_t>(i)]);
}

TEST(FrameFile, FitsCutShortIsAnError) {
  const TempFolder temp;
  write_fits(temp / "a.fits", SHORT_IMG, {0, 1, 2, 3, 4, 5});
  for (const std::uintmax_t size : {20U, 2000U, 2880U, 2884U}) {
    const std::string whole = test::bytes_of(temp / "a.fits");
    put_bytes(temp / "cut.fits", std::string_view(whole).substr(0, size));
    const auto image = read_image(temp / "cut.fits");
    ASSERT_FALSE(image) << size;
    EXPECT_EQ(image.error().kind, ErrorKind::bad_input);
  }
}

IndexRecord record_at(std::uint32_t milliseconds) {
  IndexRecord record;
  record.segment_ms = milliseconds;
  return record;
}

class Video : public testing::TestWithParam<ImageLayout> {};

TEST_P(Video, OfFfv1ComesBackFrameForFrame) {
  const TempFolder temp;
  const ImageLayout layout = GetParam();
  auto writer = SegmentWriter::create(temp / "v.mkv", layout, Encoding::ffv1, Hertz(25));
  ASSERT_TRUE(writer);
  for (std::uint32_t i = 0; i < 5; ++i)
    ASSERT_TRUE((*writer)->write(noise_image(layout, i), record_at(i * 40)));
  ASSERT_TRUE((*writer)->close());
  auto file = FrameFile::open(temp / "v.mkv");
  ASSERT_TRUE(file) << file.error().message();
  for (std::uint32_t i = 0; i < 5; ++i) {
    const auto image = (*file)->next();
    ASSERT_TRUE(image) << image.error().message();
    EXPECT_EQ(*image, noise_image(layout, i)) << i;
  }
  EXPECT_EQ((*file)->next().error().kind, ErrorKind::out_of_data);
}

INSTANTIATE_TEST_SUITE_P(FrameFile, Video,
                         testing::Values(ImageLayout{{33, 17}, PixelFormat::gray8, 8},
                                         ImageLayout{{33, 17}, PixelFormat::gray16, 16},
                                         ImageLayout{{33, 17}, PixelFormat::rgb8, 8},
                                         ImageLayout{{33, 17}, PixelFormat::rgb16, 16}));

TEST(FrameFile, AVideoCutShortGivesItsFramesAndThenAnError) {
  const TempFolder temp;
  const ImageLayout layout{{64, 48}, PixelFormat::gray8, 8};
  auto writer = SegmentWriter::create(temp / "v.mkv", layout, Encoding::ffv1, Hertz(25));
  ASSERT_TRUE(writer);
  for (std::uint32_t i = 0; i < 60; ++i)
    ASSERT_TRUE((*writer)->write(noise_image(layout, i), record_at(i * 40)));
  ASSERT_TRUE((*writer)->close());
  std::filesystem::resize_file(temp / "v.mkv", std::filesystem::file_size(temp / "v.mkv") / 2);
  auto file = FrameFile::open(temp / "v.mkv");
  ASSERT_TRUE(file) << file.error().message();
  std::uint32_t frames = 0;
  for (;; ++frames) {
    const auto image = (*file)->next();
    if (!image) {
      EXPECT_EQ(image.error().kind, ErrorKind::bad_input) << image.error().message();
      break;
    }
    EXPECT_EQ(*image, noise_image(layout, frames));
  }
  EXPECT_GT(frames, 20U);
  EXPECT_LT(frames, 31U);
}

TEST(FrameFile, AVideoWithoutFramesIsAnError) {
  const TempFolder temp;
  auto writer =
      SegmentWriter::create(temp / "v.mkv", {{64, 48}, PixelFormat::gray8, 8}, Encoding::ffv1, Hertz(25));
  ASSERT_TRUE(writer);
  ASSERT_TRUE((*writer)->close());
  auto file = FrameFile::open(temp / "v.mkv");
  const Error error = file ? (*file)->next().error() : file.error();
  EXPECT_EQ(error.kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::session
