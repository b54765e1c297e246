// SPDX-License-Identifier: Apache-2.0
#pragma once

extern "C" {
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "base/image.h"
#include "session/av.h"

// What cameras' compressors make of 8-bit grey frames, by the libraries themselves, in memory; and the same
// frames in deeper files.
namespace emberlock::test {

/// What an 8-bit JPEG file of this quality brings back.
inline Image through_jpeg(const Image& image, int quality) {
  const ImageSize size = image.layout().size;
  cv::Mat pixels(size.height, size.width, CV_8U);
  std::memcpy(pixels.data, image.bytes().data(), image.bytes().size());
  std::vector<unsigned char> file;
  cv::imencode(".jpg", pixels, file, {cv::IMWRITE_JPEG_QUALITY, quality});
  const cv::Mat decoded = cv::imdecode(file, cv::IMREAD_GRAYSCALE);
  Image out(image.layout());
  std::memcpy(out.bytes().data(), decoded.data, out.bytes().size());
  return out;
}

namespace h264 {

inline void check(int code, const char* what) {
  if (code < 0) throw std::runtime_error(std::string("H.264: ") + what);
}

/// Encodes with x264 (motion, B-frames, deblocking) and decodes packet by packet.
class Codec {
 public:
  Codec(ImageSize size, int crf) : size_(size) {
    av_log_set_level(AV_LOG_ERROR);
    const AVCodec* encoder = avcodec_find_encoder_by_name("libx264");
    const AVCodec* decoder = avcodec_find_decoder(AV_CODEC_ID_H264);
    if (encoder == nullptr || decoder == nullptr) throw std::runtime_error("libavcodec has no H.264");
    encoder_.reset(avcodec_alloc_context3(encoder));
    encoder_->width = size.width;
    encoder_->height = size.height;
    encoder_->pix_fmt = AV_PIX_FMT_YUVJ420P;
    encoder_->color_range = AVCOL_RANGE_JPEG;
    encoder_->time_base = {1, 24};
    encoder_->thread_count = 1;
    av_opt_set(encoder_->priv_data, "preset", "veryfast", 0);
    av_opt_set(encoder_->priv_data, "crf", std::to_string(crf).c_str(), 0);
    // Its vector code for the macroblock tree reads memory that nobody wrote: other bits in every run.
    av_opt_set(encoder_->priv_data, "x264-params", "asm=0", 0);
    check(avcodec_open2(encoder_.get(), encoder, nullptr), "the encoder doesn't open");
    decoder_.reset(avcodec_alloc_context3(decoder));
    decoder_->thread_count = 1;
    check(avcodec_open2(decoder_.get(), decoder, nullptr), "the decoder doesn't open");
    frame_.reset(av_frame_alloc());
    packet_.reset(av_packet_alloc());
  }

  void feed(const Image& image) {
    session::AvPtr<AVFrame> f(av_frame_alloc());
    f->format = encoder_->pix_fmt;
    f->width = size_.width;
    f->height = size_.height;
    f->pts = fed_++;
    check(av_frame_get_buffer(f.get(), 0), "no memory");
    for (int y = 0; y < size_.height; ++y) {
      std::memcpy(f->data[0] + std::ptrdiff_t{y} * f->linesize[0], image.view().row(y),
                  image.layout().row_bytes());
    }
    for (const int plane : {1, 2}) {
      std::memset(f->data[plane], 128,
                  static_cast<std::size_t>(f->linesize[plane]) * static_cast<std::size_t>(size_.height / 2));
    }
    check(avcodec_send_frame(encoder_.get(), f.get()), "a frame isn't taken");
    drain();
  }
  std::vector<Image> finish() {
    check(avcodec_send_frame(encoder_.get(), nullptr), "the end isn't taken");
    drain();
    check(avcodec_send_packet(decoder_.get(), nullptr), "the decoder doesn't end");
    receive();
    return std::move(out_);
  }

 private:
  void drain() {
    while (avcodec_receive_packet(encoder_.get(), packet_.get()) == 0) {
      check(avcodec_send_packet(decoder_.get(), packet_.get()), "a packet isn't taken");
      av_packet_unref(packet_.get());
      receive();
    }
  }
  void receive() {
    while (avcodec_receive_frame(decoder_.get(), frame_.get()) == 0) {
      Image image(ImageLayout{size_, PixelFormat::gray8, 8});
      for (int y = 0; y < size_.height; ++y) {
        std::memcpy(image.row_as<std::byte>(y), frame_->data[0] + std::ptrdiff_t{y} * frame_->linesize[0],
                    image.layout().row_bytes());
      }
      out_.push_back(std::move(image));
    }
  }

  ImageSize size_;
  session::AvPtr<AVCodecContext> encoder_, decoder_;
  session::AvPtr<AVFrame> frame_;
  session::AvPtr<AVPacket> packet_;
  std::int64_t fed_ = 0;
  std::vector<Image> out_;
};

}  // namespace h264

/// The luma planes of an H.264 film of these frames. Width and height are even.
inline std::vector<Image> through_h264(const std::vector<Image>& film, int crf) {
  h264::Codec codec(film.front().layout().size, crf);
  for (const Image& image : film) codec.feed(image);
  return codec.finish();
}

/// The same signal in more bits, as a converter stores it: 0 and white stay 0 and white.
inline Image deepened(const Image& image, int bit_depth) {
  Image out(ImageLayout{image.layout().size, PixelFormat::gray16, bit_depth});
  const int white = out.layout().white();
  for (int y = 0; y < image.layout().size.height; ++y) {
    for (int x = 0; x < image.layout().size.width; ++x)
      out.row_as<std::uint16_t>(y)[x] =
          static_cast<std::uint16_t>((image.view().row_as<std::uint8_t>(y)[x] * white + 127) / 255);
  }
  return out;
}

/// What 10-bit ProRes brings back of an 8-bit frame, with 16 bits, as videos of limited range are read.
inline Image through_prores(const Image& image) {
  const ImageSize size = image.layout().size;
  const AVCodec* const codec = avcodec_find_encoder_by_name("prores_ks");
  if (codec == nullptr) throw std::runtime_error("libavcodec has no ProRes");
  session::AvPtr<AVCodecContext> encoder(avcodec_alloc_context3(codec));
  encoder->width = size.width;
  encoder->height = size.height;
  encoder->pix_fmt = AV_PIX_FMT_YUV422P10LE;
  encoder->time_base = {1, 24};
  encoder->thread_count = 1;
  h264::check(avcodec_open2(encoder.get(), codec, nullptr), "the encoder doesn't open");
  session::AvPtr<AVFrame> frame(av_frame_alloc());
  frame->format = encoder->pix_fmt;
  frame->width = size.width;
  frame->height = size.height;
  h264::check(av_frame_get_buffer(frame.get(), 0), "no memory");
  const auto row_of = [&](int plane, int y) {
    return reinterpret_cast<std::uint16_t*>(frame->data[plane] + std::ptrdiff_t{y} * frame->linesize[plane]);
  };
  constexpr int kBlack = 64;
  constexpr int kRange = 876;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x)
      row_of(0, y)[x] =
          static_cast<std::uint16_t>(kBlack + (image.view().row_as<std::uint8_t>(y)[x] * kRange + 127) / 255);
    for (const int plane : {1, 2}) std::fill_n(row_of(plane, y), size.width / 2, std::uint16_t{512});
  }
  session::AvPtr<AVPacket> packet(av_packet_alloc());
  h264::check(avcodec_send_frame(encoder.get(), frame.get()), "a frame isn't taken");
  h264::check(avcodec_receive_packet(encoder.get(), packet.get()), "a frame isn't coded");
  session::AvPtr<AVCodecContext> decoder(avcodec_alloc_context3(avcodec_find_decoder(AV_CODEC_ID_PRORES)));
  decoder->thread_count = 1;
  decoder->codec_tag = MKTAG('a', 'p', 'c', 'h');
  h264::check(avcodec_open2(decoder.get(), nullptr, nullptr), "the decoder doesn't open");
  h264::check(avcodec_send_packet(decoder.get(), packet.get()), "a packet isn't taken");
  h264::check(avcodec_receive_frame(decoder.get(), frame.get()), "no frame");
  Image out(ImageLayout{size, PixelFormat::gray16, 16});
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const int above = std::clamp(row_of(0, y)[x] - kBlack, 0, kRange);
      out.row_as<std::uint16_t>(y)[x] = static_cast<std::uint16_t>((above * 65535 + kRange / 2) / kRange);
    }
  }
  return out;
}

}  // namespace emberlock::test
