// SPDX-License-Identifier: Apache-2.0
extern "C" {
#include <libavutil/display.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "session/av.h"
#include "session/media/frame_decoders.h"

namespace emberlock::session {
namespace {

static_assert(std::endian::native == std::endian::little,
              "16-bit samples are copied as libav's little-endian formats");

struct SwsFree {
  void operator()(SwsContext* c) const { sws_freeContext(c); }
};

enum class Transfer {
  rows,     ///< the decoder's rows are the image's rows
  samples,  ///< the same values in another order or byte order
  scaler,   ///< libswscale converts; samples above 8 bits become 16 bits
};

/// The image format that a decoded frame is converted to, and the way of conversion.
struct Target {
  ImageLayout layout;
  Transfer transfer = Transfer::scaler;
};

Target target_of(const AVFrame& frame, Colours colours) {
  const auto source = static_cast<AVPixelFormat>(frame.format);
  const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(source);
  const std::uint64_t flags = d->flags;
  const bool rgb = (flags & AV_PIX_FMT_FLAG_RGB) != 0;
  const bool without_colour = d->nb_components <= 2 || colours == Colours::brightness;
  const bool gray = without_colour && !rgb && (flags & AV_PIX_FMT_FLAG_PAL) == 0;
  const int depth = d->comp[0].depth;
  const bool wide = depth > 8;
  constexpr std::uint64_t kIndirect =
      AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_FLOAT | AV_PIX_FMT_FLAG_BAYER | AV_PIX_FMT_FLAG_HWACCEL;
  const bool limited = d->nb_components > 2 && !rgb;  // brightness may be limited to 16..235
  const bool direct = (gray || rgb) && !limited && (flags & kIndirect) == 0 && depth >= 8 && depth <= 16;

  Target t;
  t.layout.size = {frame.width, frame.height};
  t.layout.format = gray ? (wide ? PixelFormat::gray16 : PixelFormat::gray8)
                         : (wide ? PixelFormat::rgb16 : PixelFormat::rgb8);
  t.layout.bit_depth = !wide ? 8 : direct ? depth : 16;
  const bool little = (flags & AV_PIX_FMT_FLAG_BE) == 0;
  const bool packed_gray = gray && d->nb_components == 1 && d->comp[0].shift == 0 && (!wide || little);
  if (direct) t.transfer = packed_gray ? Transfer::rows : Transfer::samples;
  return t;
}

void copy_rows(const AVFrame& frame, Image& image) {
  for (int y = 0; y < frame.height; ++y) {
    std::memcpy(image.row_as<std::byte>(y), frame.data[0] + std::ptrdiff_t{y} * frame.linesize[0],
                image.layout().row_bytes());
  }
}

void copy_samples(const AVFrame& frame, Image& image) {
  const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format));
  const int count = channels(image.layout().format);
  std::vector<std::uint16_t> line(static_cast<std::size_t>(frame.width));
  std::array<const std::uint8_t*, 4> planes{};
  std::copy_n(frame.data, planes.size(), planes.begin());
  for (int y = 0; y < frame.height; ++y) {
    for (int c = 0; c < count; ++c) {
      av_read_image_line(line.data(), planes.data(), frame.linesize, d, 0, y, c, frame.width, 0);
      for (int x = 0; x < frame.width; ++x) {
        const int at = x * count + c;
        if (bytes_per_sample(image.layout().format) == 2) {
          image.row_as<std::uint16_t>(y)[at] = line[static_cast<std::size_t>(x)];
        } else {
          image.row_as<std::uint8_t>(y)[at] = static_cast<std::uint8_t>(line[static_cast<std::size_t>(x)]);
        }
      }
    }
  }
}

/// The libav format to which libswscale converts: planar 8-bit RGB, which takes a quarter of the time of
/// interleaved RGB.
AVPixelFormat scaled_format(PixelFormat format) {
  const bool wide = bytes_per_sample(format) == 2;
  if (channels(format) == 3) return wide ? AV_PIX_FMT_RGB48LE : AV_PIX_FMT_GBRP;
  return wide ? AV_PIX_FMT_GRAY16LE : AV_PIX_FMT_GRAY8;
}

/// The coefficients by which brightness and colour differences are decoded; nullopt for codings that no
/// matrix describes. Untagged video is BT.601 in standard definition and BT.709 above, as players take it.
std::optional<int> matrix_of(const AVFrame& frame) {
  switch (frame.colorspace) {
    case AVCOL_SPC_RGB:  // no matrix is applied
    case AVCOL_SPC_BT470BG:
    case AVCOL_SPC_SMPTE170M:
      return SWS_CS_ITU601;
    case AVCOL_SPC_BT709:
      return SWS_CS_ITU709;
    case AVCOL_SPC_FCC:
      return SWS_CS_FCC;
    case AVCOL_SPC_SMPTE240M:
      return SWS_CS_SMPTE240M;
    case AVCOL_SPC_BT2020_NCL:
      return SWS_CS_BT2020;
    case AVCOL_SPC_UNSPECIFIED:
    case AVCOL_SPC_RESERVED:
      return frame.height >= 720 || frame.width >= 1280 ? SWS_CS_ITU709 : SWS_CS_ITU601;
    default:
      return {};
  }
}

/// Whether no pixel of a frame is transparent. Palettes are taken for opaque.
bool frame_is_opaque(const AVFrame& frame) {
  const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame.format));
  const std::uint64_t flags = d->flags;
  if ((flags & AV_PIX_FMT_FLAG_ALPHA) == 0 || (flags & AV_PIX_FMT_FLAG_PAL) != 0) return true;
  const int alpha = d->nb_components - 1;
  const std::uint32_t opaque = (flags & AV_PIX_FMT_FLAG_FLOAT) != 0 ? std::bit_cast<std::uint32_t>(1.0F)
                                                                    : (1U << d->comp[alpha].depth) - 1;
  std::vector<std::uint32_t> line(static_cast<std::size_t>(frame.width));
  std::array<const std::uint8_t*, 4> planes{};
  std::copy_n(frame.data, planes.size(), planes.begin());
  for (int y = 0; y < frame.height; ++y) {
    av_read_image_line2(line.data(), planes.data(), frame.linesize, d, 0, y, alpha, frame.width, 0,
                        sizeof line[0]);
    if (!std::all_of(line.begin(), line.end(), [&](std::uint32_t a) { return a == opaque; })) return false;
  }
  return true;
}

std::vector<std::string> unapplied_fields(const AVStream& stream) {
  std::vector<std::string> fields;
  const VideoDisplay display = display_of(stream);
  if (display.matrix) {
    const auto& m = *display.matrix;
    const bool mirrors = std::int64_t{m[0]} * m[4] < std::int64_t{m[1]} * m[3];
    const long degrees = std::lround(360 - av_display_rotation_get(m.data())) % 360;
    fields.push_back("the display matrix (" + std::string(mirrors ? "mirrored, " : "") + "turned by " +
                     std::to_string(degrees) + " degrees) isn't applied");
  }
  if (!display.square()) {
    fields.push_back("pixels of " + std::to_string(display.pixel_width) + ":" +
                     std::to_string(display.pixel_height) + " aren't made square");
  }
  const AVColorTransferCharacteristic transfer = stream.codecpar->color_trc;
  if (transfer == AVCOL_TRC_SMPTE2084 || transfer == AVCOL_TRC_ARIB_STD_B67) {
    fields.push_back("the transfer function " + std::string(av_color_transfer_name(transfer)) +
                     " isn't applied");
  }
  return fields;
}

class VideoFile final : public FrameFile {
 public:
  VideoFile(AvInput input, std::string where, Colours colours, Checking checking)
      : input_(std::move(input)),
        checking_(checking),
        packet_(av_packet_alloc()),
        frame_(av_frame_alloc()),
        where_(std::move(where)),
        colours_(colours) {}

  Result<Image> next() override {
    EMBERLOCK_RETURN_IF_ERROR(decode());
    return convert();
  }

  Status skip(std::int64_t frames) override {
    for (; frames > 0; --frames) EMBERLOCK_RETURN_IF_ERROR(decode());
    return {};
  }

  Status seek(std::int64_t ticks) override {
    wanted_ = ticks;
    damage_.clear();
    jumped_ = av_seek_frame(input_.format.get(), input_.stream, ticks, AVSEEK_FLAG_BACKWARD) >= 0;
    if (!jumped_) return start_anew();
    avcodec_flush_buffers(input_.decoder.get());
    return {};
  }

  [[nodiscard]] std::optional<std::int64_t> ticks() const override {
    return stamp_ == AV_NOPTS_VALUE ? std::nullopt : std::optional(stamp_);
  }

  [[nodiscard]] std::vector<std::string> unapplied() const override {
    return unapplied_fields(*input_.format->streams[input_.stream]);
  }

  [[nodiscard]] VideoClaims claims() const override {
    const AVStream& stream = *input_.format->streams[input_.stream];
    VideoClaims claims;
    const double rate = stream.avg_frame_rate.den > 0 ? av_q2d(stream.avg_frame_rate) : 0;
    if (rate > 0) claims.frame_rate = Hertz(rate);
    const double seconds = stream.duration != AV_NOPTS_VALUE
                               ? static_cast<double>(stream.duration) * av_q2d(stream.time_base)
                               : static_cast<double>(input_.format->duration) / AV_TIME_BASE;
    if (stream.nb_frames > 0) {
      claims.frames = stream.nb_frames;
    } else if (rate > 0 && seconds > 0) {
      claims.frames = std::llround(seconds * rate);
    }
    return claims;
  }

 private:
  /// Decodes the next frame into `frame_`.
  Status decode() {
    for (;;) {
      const int code = avcodec_receive_frame(input_.decoder.get(), frame_.get());
      if (code == 0) {
        const std::int64_t here = frame_->best_effort_timestamp;
        if (wanted_ && here != AV_NOPTS_VALUE && here < *wanted_) continue;
        if (wanted_ && here != *wanted_ && jumped_) {  // the index led past the wanted frame
          EMBERLOCK_RETURN_IF_ERROR(start_anew());
          continue;
        }
        wanted_.reset();
        ++count_;
        stamp_ = frame_->pts;
        if (here != AV_NOPTS_VALUE) last_pts_ = here;
        if (frame_->decode_error_flags == 0 && (frame_->flags & AV_FRAME_FLAG_CORRUPT) == 0) return {};
        return damaged("its data don't decode");
      }
      if (code == AVERROR_EOF && wanted_ && jumped_) {  // the index led behind the last key frame
        EMBERLOCK_RETURN_IF_ERROR(start_anew());
        continue;
      }
      if (code == AVERROR_EOF) return end();
      if (code != AVERROR(EAGAIN)) return damaged(av_message(code));
      EMBERLOCK_RETURN_IF_ERROR(feed());
    }
  }

  Status start_anew() {
    jumped_ = false;
    damage_.clear();
    EMBERLOCK_ASSIGN_OR_RETURN(AvInput fresh, open_av_input(where_, checking_));
    input_.format.reset();  // before the file that it reads
    input_ = std::move(fresh);
    return {};
  }

  /// Feeds the decoder the next packet, or the end of the stream.
  Status feed() {
    for (;;) {
      av_packet_unref(packet_.get());
      const int code = av_read_frame(input_.format.get(), packet_.get());
      if (code == AVERROR_EOF) {
        avcodec_send_packet(input_.decoder.get(), nullptr);
        return {};
      }
      if (code < 0) return damaged(av_message(code));
      if (packet_->stream_index != input_.stream) continue;
      if ((packet_->flags & AV_PKT_FLAG_CORRUPT) != 0) {
        damage_ = goes_on() ? "data are missing, or another recording begins" : "the file is truncated";
        avcodec_send_packet(input_.decoder.get(), nullptr);  // the frames before it are told first
        return {};
      }
      const int sent = avcodec_send_packet(input_.decoder.get(), packet_.get());
      if (sent < 0) return damaged(av_message(sent));
      return {};
    }
  }

  /// Whether the stream has more packets. They are passed over.
  [[nodiscard]] bool goes_on() {
    do {
      av_packet_unref(packet_.get());
      if (av_read_frame(input_.format.get(), packet_.get()) < 0) return false;
    } while (packet_->stream_index != input_.stream);
    return true;
  }

  [[nodiscard]] Error damaged(const std::string& reason) const {
    return {ErrorKind::bad_input, "the video is damaged: " + reason, position(), "Copy or record it again"};
  }
  [[nodiscard]] std::string position() const { return where_ + ", frame " + std::to_string(count_); }
  [[nodiscard]] Error end() const {
    if (!damage_.empty()) return damaged(damage_);
    if (count_ == 0)
      return {ErrorKind::bad_input, "the video holds no frames", where_, "Copy or record it again"};
    if (ends_early()) return damaged("the file is truncated, it promises more frames");
    return {ErrorKind::out_of_data, "the video has ended", position()};
  }
  /// Whether the file is truncated. Many demuxers take the end of the file for the end of the film;
  /// containers that state a duration reveal the difference.
  [[nodiscard]] bool ends_early() const {
    const AVFormatContext& format = *input_.format;
    const AVStream& stream = *format.streams[input_.stream];
    const double tick = av_q2d(stream.time_base);
    const bool stated = format.duration_estimation_method == AVFMT_DURATION_FROM_STREAM;
    if (!stated || last_pts_ == AV_NOPTS_VALUE || stream.avg_frame_rate.num <= 0) return false;
    const double start =
        stream.start_time == AV_NOPTS_VALUE ? 0 : static_cast<double>(stream.start_time) * tick;
    const double seen = static_cast<double>(last_pts_) * tick - start;
    const double promised = stream.duration == AV_NOPTS_VALUE
                                ? static_cast<double>(format.duration) / AV_TIME_BASE
                                : static_cast<double>(stream.duration) * tick;
    const double other_streams = format.nb_streams > 1 ? 1 : 0;  // a sound track may be longer
    return seen < 0.98 * promised - 3 * av_q2d(av_inv_q(stream.avg_frame_rate)) - other_streams;
  }

  Result<Image> convert() {
    EMBERLOCK_RETURN_IF_ERROR(check_image_size(frame_->width, frame_->height, where_));
    if (!frame_is_opaque(*frame_)) {
      return Error{ErrorKind::bad_input, "is transparent, and a film doesn't state the meaning of its alpha",
                   position(), "Compose the film over black and write it without alpha"};
    }
    const Target target = target_of(*frame_, colours_);
    Image image(target.layout);
    if (target.transfer == Transfer::rows) copy_rows(*frame_, image);
    if (target.transfer == Transfer::samples) copy_samples(*frame_, image);
    if (target.transfer != Transfer::scaler) return image;
    return rescale(std::move(image));
  }

  Result<Image> rescale(Image image) {
    const auto matrix = matrix_of(*frame_);
    if (!matrix && channels(image.layout().format) == 3) {
      const char* const name = av_color_space_name(frame_->colorspace);
      return Error{ErrorKind::bad_input,
                   "its colours are coded as " + std::string(name != nullptr ? name : "an unknown kind"),
                   position(), "Convert the video to BT.709"};
    }
    const int flags = SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT | SWS_FULL_CHR_H_INP | SWS_BITEXACT;
    scaler_.reset(sws_getCachedContext(scaler_.release(), frame_->width, frame_->height,
                                       static_cast<AVPixelFormat>(frame_->format), frame_->width,
                                       frame_->height, scaled_format(image.layout().format), flags, nullptr,
                                       nullptr, nullptr));
    if (!scaler_) return damaged("its pixel format can't be converted");
    const int full_in = frame_->color_range == AVCOL_RANGE_JPEG ? 1 : 0;
    // libswscale refuses this for RGB input, where it isn't needed.
    sws_setColorspaceDetails(scaler_.get(), sws_getCoefficients(matrix.value_or(SWS_CS_DEFAULT)), full_in,
                             sws_getCoefficients(SWS_CS_DEFAULT), 1, 0, 1 << 16, 1 << 16);
    // libswscale may write beyond the end of a row, so it writes to a padded row, which is then copied.
    const bool planar = image.layout().format == PixelFormat::rgb8;
    const std::size_t row_bytes = image.layout().row_bytes() / (planar ? 3 : 1);
    const std::size_t stride = (row_bytes + 127) / 64 * 64;
    const std::size_t plane = stride * static_cast<std::size_t>(frame_->height);
    scratch_.resize(plane * (planar ? 3 : 1));
    std::array<std::uint8_t*, 4> planes{scratch_.data(), nullptr, nullptr, nullptr};
    std::array<int, 4> strides{static_cast<int>(stride), 0, 0, 0};
    for (std::size_t p = 1; planar && p < 3; ++p) {
      planes[p] = scratch_.data() + p * plane;
      strides[p] = strides[0];
    }
    const int rows = sws_scale(scaler_.get(), frame_->data, frame_->linesize, 0, frame_->height,
                               planes.data(), strides.data());
    if (rows != frame_->height) return damaged("its pixel format can't be converted");
    for (int y = 0; y < frame_->height; ++y) {
      const std::uint8_t* row = scratch_.data() + static_cast<std::size_t>(y) * stride;
      if (planar) {
        interleave(row + 2 * plane, row, row + plane,
                   image.row_as<std::uint8_t>(y));  // the planes are G, B, R
      } else {
        std::memcpy(image.row_as<std::byte>(y), row, row_bytes);
      }
    }
    return image;
  }

  void interleave(const std::uint8_t* red, const std::uint8_t* green, const std::uint8_t* blue,
                  std::uint8_t* out) const {
    for (int x = 0; x < frame_->width; ++x, out += 3) {
      out[0] = red[x];
      out[1] = green[x];
      out[2] = blue[x];
    }
  }

  AvInput input_;
  Checking checking_;
  AvPtr<AVPacket> packet_;
  AvPtr<AVFrame> frame_;
  std::unique_ptr<SwsContext, SwsFree> scaler_;
  std::vector<std::uint8_t> scratch_;
  std::string where_;
  Colours colours_;
  std::uint64_t count_ = 0;
  std::optional<std::int64_t> wanted_{};    ///< frames before this time stamp are skipped
  bool jumped_ = false;                     ///< the index was used to seek to `wanted_`
  std::string damage_;                      ///< what ends the film before its end; else empty
  std::int64_t stamp_ = AV_NOPTS_VALUE;     ///< that the file holds for the last frame
  std::int64_t last_pts_ = AV_NOPTS_VALUE;  ///< stated or estimated, of the last frame that has one
};

}  // namespace

Result<std::unique_ptr<FrameFile>> open_video(const std::filesystem::path& path, Colours colours,
                                              Stamps stamps) {
  const Checking checking = stamps == Stamps::stored ? Checking::unfilled : Checking::lenient;
  EMBERLOCK_ASSIGN_OR_RETURN(AvInput input, open_av_input(path, checking));
  EMBERLOCK_RETURN_IF_ERROR(check_image_size(input.decoder->width, input.decoder->height, path.string()));
  return std::unique_ptr<FrameFile>(
      std::make_unique<VideoFile>(std::move(input), path.string(), colours, checking));
}

}  // namespace emberlock::session
