// SPDX-License-Identifier: Apache-2.0
#include "session/video_writer.h"

extern "C" {
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

#include "session/av.h"

namespace emberlock::session {
namespace {

constexpr int kMpeg4Quality = 3;
constexpr int kLargestRateTerm = 60'000;  // MPEG-4 stores times in 16 bits
constexpr int kEven = ~1;

struct FreeScaler {
  void operator()(SwsContext* c) const { sws_freeContext(c); }
};

AVPixelFormat scaled_from(PixelFormat format) {
  switch (format) {
    case PixelFormat::gray8:
      return AV_PIX_FMT_GRAY8;
    case PixelFormat::gray16:
      return AV_PIX_FMT_GRAY16LE;
    case PixelFormat::bayer_rggb8:
      return AV_PIX_FMT_BAYER_RGGB8;
    case PixelFormat::bayer_rggb16:
      return AV_PIX_FMT_BAYER_RGGB16LE;
    case PixelFormat::rgb8:
      return AV_PIX_FMT_RGB24;
    case PixelFormat::rgb16:
      return AV_PIX_FMT_RGB48LE;
  }
  return AV_PIX_FMT_NONE;
}

/// Stretches the samples to the full range of their type: 12 bits come right-aligned in 16.
Image stretched(const Image& image) {
  Image wide = image;
  const int shift = 16 - image.layout().bit_depth;
  const int samples = image.layout().size.width * channels(image.layout().format);
  for (int y = 0; y < image.layout().size.height; ++y) {
    auto* row = wide.row_as<std::uint16_t>(y);
    for (int i = 0; i < samples; ++i) row[i] = static_cast<std::uint16_t>(row[i] << shift);
  }
  return wide;
}

/// Black and white, slanted, over the picture's last rows: nothing that is filmed looks so.
void draw_hatched_bar(AVFrame& frame) {
  constexpr int kShare = 24;  // of the picture's height
  constexpr int kStripe = 8;
  constexpr std::uint8_t kBlack = 16;
  constexpr std::uint8_t kWhite = 235;
  constexpr std::uint8_t kColourless = 128;
  const int height = std::max(2, frame.height / kShare) & kEven;
  for (int y = frame.height - height; y < frame.height; ++y) {
    std::uint8_t* const row = frame.data[0] + static_cast<std::ptrdiff_t>(y) * frame.linesize[0];
    for (int x = 0; x < frame.width; ++x) row[x] = (x + y) / kStripe % 2 == 0 ? kBlack : kWhite;
  }
  for (int plane = 1; plane < 3; ++plane) {
    for (int y = (frame.height - height) / 2; y < frame.height / 2; ++y)
      std::memset(frame.data[plane] + static_cast<std::ptrdiff_t>(y) * frame.linesize[plane], kColourless,
                  static_cast<std::size_t>(frame.width / 2));
  }
}

}  // namespace

struct VideoWriter::Libav {
  std::unique_ptr<AvFile> file;
  std::unique_ptr<AVFormatContext, AvFreeOutput> format;
  AvPtr<AVCodecContext> encoder;
  AvPtr<AVFrame> frame{av_frame_alloc()};
  AvPtr<AVPacket> packet{av_packet_alloc()};
  std::unique_ptr<SwsContext, FreeScaler> scaler;

  [[nodiscard]] Error failure(int code, const char* action) const {
    return {ErrorKind::io, std::string(action) + ": " + av_message(code), file->path().string(),
            "Check the disk's space and health"};
  }
  Coding coding = Coding::for_players;
  VideoDisplay display;
  int open(const ImageLayout& layout, Hertz frame_rate, int key_interval);
  int open_encoder(const ImageLayout& layout, Hertz frame_rate, int key_interval);
};

int VideoWriter::Libav::open_encoder(const ImageLayout& layout, Hertz frame_rate, int key_interval) {
  const bool lossless = coding == Coding::lossless;
  const AVCodec* codec =
      lossless ? avcodec_find_encoder(AV_CODEC_ID_FFV1) : avcodec_find_encoder_by_name("libx264");
  const bool h264 = !lossless && codec != nullptr;
  if (codec == nullptr && !lossless) codec = avcodec_find_encoder(AV_CODEC_ID_MPEG4);
  if (codec == nullptr) return AVERROR_ENCODER_NOT_FOUND;
  encoder.reset(avcodec_alloc_context3(codec));
  AVCodecContext& c = *encoder;
  const int sides = lossless ? ~0 : kEven;
  c.width = layout.size.width & sides;
  c.height = layout.size.height & sides;
  c.pix_fmt = lossless ? AV_PIX_FMT_BGR0 : AV_PIX_FMT_YUV420P;
  if (!lossless) {  // as the scaler makes them of R, G and B
    c.colorspace = AVCOL_SPC_SMPTE170M;
    c.color_range = AVCOL_RANGE_MPEG;
  }
  if (!display.square()) c.sample_aspect_ratio = {display.pixel_width, display.pixel_height};
  c.framerate = av_d2q(frame_rate.value(), kLargestRateTerm);
  c.time_base = av_inv_q(c.framerate);
  c.flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  c.thread_count = 0;  // one per processor
  if (key_interval > 0) c.gop_size = key_interval;
  if (h264) {
    av_opt_set(c.priv_data, "preset", "veryfast", 0);
    av_opt_set_int(c.priv_data, "crf", 18, 0);
  } else if (lossless) {
    c.level = 3;  // slices with checksums
    av_opt_set_int(c.priv_data, "slicecrc", 1, 0);
  } else {
    c.flags |= AV_CODEC_FLAG_QSCALE;
    c.global_quality = FF_QP2LAMBDA * kMpeg4Quality;
  }
  return avcodec_open2(&c, codec, nullptr);
}

int VideoWriter::Libav::open(const ImageLayout& layout, Hertz frame_rate, int key_interval) {
  int code = open_encoder(layout, frame_rate, key_interval);
  if (code < 0) return code;
  const AVCodecContext& c = *encoder;
  frame->format = c.pix_fmt;
  frame->width = c.width;
  frame->height = c.height;
  code = av_frame_get_buffer(frame.get(), 0);
  if (code < 0) return code;
  scaler.reset(sws_getContext(c.width, c.height, scaled_from(layout.format), c.width, c.height, c.pix_fmt,
                              SWS_BILINEAR | SWS_ACCURATE_RND, nullptr, nullptr, nullptr));
  if (!scaler) return AVERROR(EINVAL);
  const int* matrix = sws_getCoefficients(SWS_CS_DEFAULT);
  sws_setColorspaceDetails(scaler.get(), matrix, 1, matrix, 0, 0, 1 << 16, 1 << 16);

  AVFormatContext* output = nullptr;
  code = avformat_alloc_output_context2(&output, nullptr, coding == Coding::lossless ? "matroska" : "mp4",
                                        nullptr);
  if (code < 0) return code;
  format.reset(output);
  output->pb = file->io();
  output->flags |= AVFMT_FLAG_CUSTOM_IO;
  AVStream* stream = avformat_new_stream(output, nullptr);
  stream->time_base = c.time_base;
  stream->avg_frame_rate = c.framerate;
  avcodec_parameters_from_context(stream->codecpar, &c);
  stream->sample_aspect_ratio = c.sample_aspect_ratio;
  if (display.matrix && holds_matrix(coding)) {
    std::uint8_t* const data =
        av_stream_new_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, sizeof *display.matrix);
    if (data == nullptr) return AVERROR(ENOMEM);
    std::memcpy(data, display.matrix->data(), sizeof *display.matrix);
  }
  return avformat_write_header(output, nullptr);
}

VideoWriter::VideoWriter(ImageLayout layout, std::unique_ptr<Libav> av)
    : layout_(layout), av_(std::move(av)) {}
VideoWriter::~VideoWriter() = default;

Result<std::unique_ptr<VideoWriter>> VideoWriter::create(const std::filesystem::path& path,
                                                         const ImageLayout& layout, Hertz frame_rate,
                                                         int key_interval, Coding coding,
                                                         const VideoDisplay& display) {
  quiet_libav();
  auto av = std::make_unique<Libav>();
  av->coding = coding;
  av->display = display;
  EMBERLOCK_ASSIGN_OR_RETURN(av->file, AvFile::open(path, AvFile::Mode::create));
  if (const int code = av->open(layout, frame_rate, key_interval); code < 0)
    return av->failure(code, "cannot write a video");
  return std::unique_ptr<VideoWriter>(new VideoWriter(layout, std::move(av)));
}

std::string VideoWriter::codec() const { return av_->encoder->codec->name; }

Status VideoWriter::show(const Image& image) {
  if (const int code = av_frame_make_writable(av_->frame.get()); code < 0)
    return av_->failure(code, "cannot encode");
  const bool narrow = bytes_per_sample(layout_.format) == 2 && layout_.bit_depth < 16;
  const Image wide = narrow ? stretched(image) : Image();
  const ImageView view = narrow ? wide.view() : image.view();
  const auto* rows = reinterpret_cast<const std::uint8_t*>(view.data);
  const int stride = static_cast<int>(view.stride);
  sws_scale(av_->scaler.get(), &rows, &stride, 0, av_->encoder->height, av_->frame->data,
            av_->frame->linesize);
  return send();
}

Status VideoWriter::repeat() {
  if (const int code = av_frame_make_writable(av_->frame.get()); code < 0)
    return av_->failure(code, "cannot encode");
  draw_hatched_bar(*av_->frame);
  return send();
}

Status VideoWriter::send() {
  av_->frame->pts = shown_++;
  if (const int code = avcodec_send_frame(av_->encoder.get(), av_->frame.get()); code < 0) {
    return av_->failure(code, "cannot encode");
  }
  return drain();
}

Status VideoWriter::drain() {
  for (;;) {
    AVPacket* packet = av_->packet.get();
    int code = avcodec_receive_packet(av_->encoder.get(), packet);
    if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) return {};
    if (code < 0) return av_->failure(code, "cannot encode");
    packet->stream_index = 0;
    packet->duration = 1;
    av_packet_rescale_ts(packet, av_->encoder->time_base, av_->format->streams[0]->time_base);
    code = av_interleaved_write_frame(av_->format.get(), packet);
    if (code >= 0) code = av_->file->io()->error;
    if (code < 0) return av_->failure(code, "cannot write");
  }
}

Status VideoWriter::close() {
  avcodec_send_frame(av_->encoder.get(), nullptr);
  EMBERLOCK_RETURN_IF_ERROR(drain());
  int code = av_write_trailer(av_->format.get());
  avio_flush(av_->file->io());
  if (code >= 0) code = av_->file->io()->error;
  if (code < 0) return av_->failure(code, "cannot finish the video");
  return {};
}

}  // namespace emberlock::session
