// SPDX-License-Identifier: Apache-2.0
// The matrix by which a film's brightness and colour differences become red, green and blue.
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

extern "C" {
#include <libavutil/pixdesc.h>
}

#include "session/av.h"
#include "session/media/frame_file.h"
#include "tests/support/temp_folder.h"

namespace emberlock::session {
namespace {

constexpr std::array<double, 3> kOrange{200, 90, 30};  // of 255

void expect_av(int code) {
  if (code < 0) throw std::runtime_error(av_message(code));
}

/// A film of one orange frame in limited range, by the matrix with these shares of red and blue in
/// brightness.
void write_orange(const std::filesystem::path& path, ImageSize size, AVPixelFormat format, AVColorSpace tag,
                  double red, double blue) {
  quiet_libav();
  AVFormatContext* context = nullptr;
  expect_av(avformat_alloc_output_context2(&context, nullptr, "matroska", path.c_str()));
  const std::unique_ptr<AVFormatContext, AvFreeOutput> output(context);
  const AVCodec* const codec = avcodec_find_encoder(AV_CODEC_ID_FFV1);
  const AvPtr<AVCodecContext> encoder(avcodec_alloc_context3(codec));
  encoder->width = size.width;
  encoder->height = size.height;
  encoder->pix_fmt = format;
  encoder->colorspace = tag;
  encoder->color_range = AVCOL_RANGE_MPEG;
  encoder->time_base = {1, 25};
  encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  expect_av(avcodec_open2(encoder.get(), codec, nullptr));
  AVStream* const stream = avformat_new_stream(context, nullptr);
  stream->time_base = encoder->time_base;
  expect_av(avcodec_parameters_from_context(stream->codecpar, encoder.get()));
  expect_av(avio_open(&context->pb, path.c_str(), AVIO_FLAG_WRITE));
  expect_av(avformat_write_header(context, nullptr));
  const AvPtr<AVFrame> frame(av_frame_alloc());
  frame->format = format;
  frame->width = size.width;
  frame->height = size.height;
  expect_av(av_frame_get_buffer(frame.get(), 0));
  const auto& [r, g, b] = kOrange;
  const double y = red * r + (1 - red - blue) * g + blue * b;
  const bool wide = format == AV_PIX_FMT_YUV444P10LE;
  const double unit = wide ? 4 : 1;
  const std::array<double, 3> planes{16 + y * 219 / 255, 128 + (b - y) / (2 * (1 - blue)) * 224 / 255,
                                     128 + (r - y) / (2 * (1 - red)) * 224 / 255};
  for (std::size_t p = 0; p < 3; ++p) {
    const long value = std::lround(unit * planes[p]);
    for (int row = 0; row < size.height; ++row) {
      std::uint8_t* const at = frame->data[p] + std::ptrdiff_t{row} * frame->linesize[p];
      if (wide) {
        std::fill_n(reinterpret_cast<std::uint16_t*>(at), size.width, static_cast<std::uint16_t>(value));
      } else {
        std::fill_n(at, size.width, static_cast<std::uint8_t>(value));
      }
    }
  }
  frame->pts = 0;
  expect_av(avcodec_send_frame(encoder.get(), frame.get()));
  expect_av(avcodec_send_frame(encoder.get(), nullptr));
  const AvPtr<AVPacket> packet(av_packet_alloc());
  while (avcodec_receive_packet(encoder.get(), packet.get()) == 0) {
    packet->stream_index = 0;
    expect_av(av_interleaved_write_frame(context, packet.get()));
  }
  expect_av(av_write_trailer(context));
  avio_closep(&context->pb);
}

TEST(VideoColours, AreDecodedByTheTagsMatrixOrByTheSize) {
  constexpr ImageSize kSmall{64, 48};
  constexpr ImageSize kHd{1280, 720};
  struct Row {
    AVColorSpace tag;
    ImageSize size;
    double red, blue;
  };
  for (const auto& [tag, size, red, blue] :
       {Row{AVCOL_SPC_BT709, kSmall, 0.2126, 0.0722}, Row{AVCOL_SPC_SMPTE170M, kSmall, 0.299, 0.114},
        Row{AVCOL_SPC_BT470BG, kHd, 0.299, 0.114}, Row{AVCOL_SPC_BT2020_NCL, kSmall, 0.2627, 0.0593},
        Row{AVCOL_SPC_BT2020_NCL, kHd, 0.2627, 0.0593}, Row{AVCOL_SPC_SMPTE240M, kSmall, 0.212, 0.087},
        Row{AVCOL_SPC_FCC, kSmall, 0.30, 0.11}, Row{AVCOL_SPC_UNSPECIFIED, kSmall, 0.299, 0.114},
        Row{AVCOL_SPC_UNSPECIFIED, {720, 576}, 0.299, 0.114}, Row{AVCOL_SPC_UNSPECIFIED, kHd, 0.2126, 0.0722},
        Row{AVCOL_SPC_UNSPECIFIED, {720, 1280}, 0.2126, 0.0722}}) {
    for (const AVPixelFormat format : {AV_PIX_FMT_YUV444P, AV_PIX_FMT_YUV444P10LE}) {
      SCOPED_TRACE(std::string(av_color_space_name(tag)) + " of " + std::to_string(size.height) + " rows");
      const test::TempFolder temp;
      write_orange(temp / "film.mkv", size, format, tag, red, blue);
      const Result<Image> image = FrameFile::open(temp / "film.mkv").value()->next();
      ASSERT_TRUE(image.ok()) << image.error().message();
      for (std::size_t c = 0; c < 3; ++c) {
        const double level = format == AV_PIX_FMT_YUV444P ? image->view().row_as<std::uint8_t>(9)[c]
                                                          : image->view().row_as<std::uint16_t>(9)[c] / 257.0;
        EXPECT_NEAR(level, kOrange[c], 1.6) << c;
      }
    }
  }
}

TEST(VideoColours, OfNoMatrixAreRefusedAndTheirBrightnessIsRead) {
  for (const AVColorSpace tag : {AVCOL_SPC_YCGCO, AVCOL_SPC_BT2020_CL, AVCOL_SPC_ICTCP}) {
    const test::TempFolder temp;
    write_orange(temp / "film.mkv", {64, 48}, AV_PIX_FMT_YUV444P, tag, 0.3, 0.1);
    const Result<Image> image = FrameFile::open(temp / "film.mkv").value()->next();
    ASSERT_FALSE(image.ok()) << av_color_space_name(tag);
    EXPECT_THAT(image.error().message(), testing::HasSubstr(av_color_space_name(tag)));
    EXPECT_TRUE(FrameFile::open(temp / "film.mkv", Colours::brightness).value()->next().ok());
  }
}

}  // namespace
}  // namespace emberlock::session
