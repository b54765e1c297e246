// SPDX-License-Identifier: Apache-2.0
#pragma once

extern "C" {
#include <libavutil/imgutils.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include "base/image.h"
#include "base/quantity.h"
#include "session/av.h"

namespace emberlock::test {

/// How a camera writes its video. The container follows the file's name.
struct VideoFormat {
  AVCodecID codec = AV_CODEC_ID_H264;
  int crf = 23;                     ///< of H.264; MJPEG is given a quality of the like
  const char* preset = "veryfast";  ///< of x264
  AVRational rate{24000, 1001};     ///< what the file claims
  int gop = 0;                      ///< frames from one key to the next; the codec's own where 0
  int b_frames = -1;                ///< between two others; the codec's own number where -1
  bool tinted = false;              ///< what is bright is orange, as flames are; H.264
  int alpha = -1;                   ///< of all pixels, FFV1; none where -1
};

/// Writes gray8 images as the video that a consumer camera would make of them. Throws what goes wrong.
class VideoWriter {
 public:
  VideoWriter(const std::filesystem::path& path, ImageSize size, const VideoFormat& format) {
    session::quiet_libav();
    AVFormatContext* context = nullptr;
    expect(avformat_alloc_output_context2(&context, nullptr, nullptr, path.c_str()), "no container");
    output_.reset(context);
    const AVCodec* codec = avcodec_find_encoder(format.codec);
    if (codec == nullptr) throw std::runtime_error("no encoder");
    encoder_.reset(avcodec_alloc_context3(codec));
    AVCodecContext& c = *encoder_;
    c.width = size.width;
    c.height = size.height;
    c.time_base = av_inv_q(format.rate);
    c.framerate = format.rate;
    c.pix_fmt = format.alpha >= 0                   ? AV_PIX_FMT_YUVA420P
                : format.codec == AV_CODEC_ID_FFV1  ? AV_PIX_FMT_GRAY8
                : format.codec == AV_CODEC_ID_MJPEG ? AV_PIX_FMT_YUVJ420P
                                                    : AV_PIX_FMT_YUV420P;
    c.thread_count = 1;
    if (format.gop > 0) c.gop_size = format.gop;
    if (format.b_frames >= 0) c.max_b_frames = format.b_frames;
    tinted_ = format.tinted;
    alpha_ = format.alpha;
    if (format.codec == AV_CODEC_ID_H264) {
      av_opt_set_int(c.priv_data, "crf", format.crf, 0);
      av_opt_set(c.priv_data, "preset", format.preset, 0);
      av_opt_set(c.priv_data, "x264-params", "log-level=-1", 0);
    } else if (format.codec == AV_CODEC_ID_MJPEG) {
      c.flags |= AV_CODEC_FLAG_QSCALE;
      c.global_quality = FF_QP2LAMBDA * 4;
    }
    if ((context->oformat->flags & AVFMT_GLOBALHEADER) != 0) c.flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    expect(avcodec_open2(&c, codec, nullptr), "cannot encode");
    stream_ = avformat_new_stream(context, nullptr);
    stream_->time_base = c.time_base;
    stream_->avg_frame_rate = format.rate;
    expect(avcodec_parameters_from_context(stream_->codecpar, &c), "no parameters");
    expect(avio_open(&context->pb, path.c_str(), AVIO_FLAG_WRITE), "cannot create the file");
    expect(avformat_write_header(context, nullptr), "cannot write");
    frame_.reset(av_frame_alloc());
    frame_->format = c.pix_fmt;
    frame_->width = size.width;
    frame_->height = size.height;
    expect(av_frame_get_buffer(frame_.get(), 0), "no frame");
    packet_.reset(av_packet_alloc());
    scaler_ = sws_getContext(size.width, size.height, AV_PIX_FMT_GRAY8, size.width, size.height, c.pix_fmt,
                             SWS_BICUBIC, nullptr, nullptr, nullptr);
  }
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;
  ~VideoWriter() {
    avio_closep(&output_->pb);
    sws_freeContext(scaler_);
  }

  void write(const Image& image) {
    expect(av_frame_make_writable(frame_.get()), "no frame");
    const auto* data = reinterpret_cast<const std::uint8_t*>(image.bytes().data());
    const int stride = static_cast<int>(image.layout().row_bytes());
    if (encoder_->pix_fmt == AV_PIX_FMT_GRAY8) {
      av_image_copy_plane(frame_->data[0], frame_->linesize[0], data, stride, stride, frame_->height);
    } else {
      sws_scale(scaler_, &data, &stride, 0, frame_->height, frame_->data, frame_->linesize);
    }
    if (tinted_) tint();
    if (alpha_ >= 0)
      std::fill_n(frame_->data[3], std::ptrdiff_t{frame_->linesize[3]} * frame_->height,
                  static_cast<std::uint8_t>(alpha_));
    show(count_);
  }
  /// The last image again (or the first one, empty), with this time stamp: they are multiples of 1 / rate.
  void show(std::int64_t pts) {
    frame_->pts = pts;
    count_ = pts + 1;
    frame_->quality = encoder_->global_quality;
    encode(frame_.get());
  }
  /// The next image comes so many frame periods late.
  void skip(std::int64_t periods) { count_ += periods; }
  /// The file is whole after it.
  void close() {
    encode(nullptr);
    expect(av_write_trailer(output_.get()), "cannot write");
  }

 private:
  void tint() {
    for (int y = 0; y < frame_->height / 2; ++y) {
      const std::uint8_t* brightness = frame_->data[0] + std::ptrdiff_t{2} * y * frame_->linesize[0];
      for (int x = 0; x < frame_->width / 2; ++x) {
        const int above = std::max(0, brightness[2 * x] - 40);
        frame_->data[1][y * frame_->linesize[1] + x] = static_cast<std::uint8_t>(128 - above / 4);
        frame_->data[2][y * frame_->linesize[2] + x] = static_cast<std::uint8_t>(128 + above / 5);
      }
    }
  }
  static void expect(int code, const char* what) {
    if (code < 0) throw std::runtime_error(std::string(what) + ": " + session::av_message(code));
  }
  void encode(const AVFrame* frame) {
    expect(avcodec_send_frame(encoder_.get(), frame), "cannot encode");
    for (;;) {
      const int code = avcodec_receive_packet(encoder_.get(), packet_.get());
      if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) return;
      expect(code, "cannot encode");
      packet_->stream_index = 0;
      av_packet_rescale_ts(packet_.get(), encoder_->time_base, stream_->time_base);
      expect(av_interleaved_write_frame(output_.get(), packet_.get()), "cannot write");
    }
  }

  std::unique_ptr<AVFormatContext, session::AvFreeOutput> output_;
  session::AvPtr<AVCodecContext> encoder_;
  session::AvPtr<AVFrame> frame_;
  session::AvPtr<AVPacket> packet_;
  SwsContext* scaler_ = nullptr;
  AVStream* stream_ = nullptr;
  std::int64_t count_ = 0;
  bool tinted_ = false;
  int alpha_ = -1;
};

}  // namespace emberlock::test
