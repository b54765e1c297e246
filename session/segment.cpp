// SPDX-License-Identifier: Apache-2.0
#include "session/segment.h"

extern "C" {
#include <libavutil/crc.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <limits>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "session/files.h"
#include "session/index.h"
#include "session/segment_pixels.h"

namespace emberlock::session {
namespace {

constexpr AVRational kMilliseconds{1, 1000};
constexpr int kClusterMilliseconds = 250;
constexpr int kClusterBytes = 4 << 20;
constexpr int kSmallestSliced = 16;
/// Precedes a frame's record in its packet's side data: the id of Matroska's BlockAdditional, big-endian.
constexpr std::array<std::uint8_t, 8> kAdditionalId{0, 0, 0, 0, 0, 0, 0, 1};

AVCodecID codec_of(const ImageLayout& layout, Encoding encoding) {
  if (encoding == Encoding::ffv1) return AV_CODEC_ID_FFV1;
  const bool wide = bytes_per_sample(layout.format) > 1;
  if (encoding == Encoding::raw_nut || wide) return AV_CODEC_ID_RAWVIDEO;
  return layout.format == PixelFormat::rgb8 ? AV_CODEC_ID_UTVIDEO : AV_CODEC_ID_FFVHUFF;
}

AVRational as_rational(Hertz rate) {
  return rate.value() > 0 ? av_d2q(rate.value(), 1'000'000) : AVRational{25, 1};
}

}  // namespace

Result<std::unique_ptr<SegmentWriter>> SegmentWriter::create(const std::filesystem::path& path,
                                                             const ImageLayout& layout, Encoding encoding,
                                                             Hertz frame_rate) {
  quiet_libav();
  std::unique_ptr<SegmentWriter> writer(new SegmentWriter(layout, encoding));
  EMBERLOCK_RETURN_IF_ERROR(writer->open(path, frame_rate));
  return writer;
}

SegmentWriter::~SegmentWriter() = default;

Error SegmentWriter::failure(int code, const char* action) const {
  // libav reports the operating system's errors as negated errno values.
  errno = AVUNERROR(code);
  return code == AVERROR(EROFS) || code == AVERROR(EIO)
             ? errno_error(file_->path(), action)
             : Error{ErrorKind::io, std::string(action) + ": " + av_message(code), file_->path().string(),
                     "Check the disk's space and health"};
}

Status SegmentWriter::open(const std::filesystem::path& path, Hertz frame_rate) {
  EMBERLOCK_ASSIGN_OR_RETURN(file_, AvFile::open(path, AvFile::Mode::create));
  const AVCodec* codec = avcodec_find_encoder(codec_of(layout_, encoding_));
  if (codec == nullptr) return failure(AVERROR_ENCODER_NOT_FOUND, "cannot encode");
  encoder_.reset(avcodec_alloc_context3(codec));
  AVCodecContext& c = *encoder_;
  c.width = layout_.size.width;
  c.height = layout_.size.height;
  c.pix_fmt = coded_format(layout_, encoding_);
  c.time_base = kMilliseconds;
  c.framerate = as_rational(frame_rate);
  c.gop_size = 1;  // every frame is a key frame
  c.thread_count = 1;
  c.flags |= AV_CODEC_FLAG_BITEXACT;
  if (encoding_ == Encoding::ffv1) {
    c.level = 3;
    // libav's default of four slices or more corrupts images of a few pixels.
    if (c.width < kSmallestSliced || c.height < kSmallestSliced) c.slices = 1;
    c.color_range = AVCOL_RANGE_JPEG;
    av_opt_set_int(c.priv_data, "slicecrc", 1, 0);
  } else if (uncompressed()) {
    c.codec_tag = avcodec_pix_fmt_to_codec_tag(c.pix_fmt);
  } else {
    av_opt_set(c.priv_data, "pred", "median", 0);
  }
  if (const int code = avcodec_open2(&c, codec, nullptr); code < 0) return failure(code, "cannot encode");

  frame_.reset(av_frame_alloc());
  packet_.reset(av_packet_alloc());
  frame_->format = c.pix_fmt;
  frame_->width = c.width;
  frame_->height = c.height;
  if (const int code = av_frame_get_buffer(frame_.get(), 0); code < 0) return failure(code, "cannot encode");
  return write_header(frame_rate);
}

Status SegmentWriter::write_header(Hertz frame_rate) {
  AVFormatContext* format = nullptr;
  const char* container = encoding_ == Encoding::ffv1 ? "matroska" : "nut";
  int code = avformat_alloc_output_context2(&format, nullptr, container, nullptr);
  if (code < 0) return failure(code, "cannot write");
  format_.reset(format);
  format->pb = file_->io();
  format->flags |= AVFMT_FLAG_CUSTOM_IO | AVFMT_FLAG_BITEXACT | AVFMT_FLAG_FLUSH_PACKETS;
  AVStream* stream = avformat_new_stream(format, nullptr);
  stream->time_base = kMilliseconds;
  stream->avg_frame_rate = as_rational(frame_rate);
  avcodec_parameters_from_context(stream->codecpar, encoder_.get());
  AVDictionary* options = nullptr;
  if (encoding_ == Encoding::ffv1) {
    av_dict_set_int(&options, "cluster_time_limit", kClusterMilliseconds, 0);
    av_dict_set_int(&options, "cluster_size_limit", kClusterBytes, 0);
  } else {
    // Side data needs NUT version 4, which libav writes only with this setting.
    format->strict_std_compliance = FF_COMPLIANCE_EXPERIMENTAL;
    av_dict_set(&options, "syncpoints", "timestamped", 0);
  }
  code = avformat_write_header(format, &options);
  av_dict_free(&options);
  if (code < 0) {
    format_.reset();
    return failure(code, "cannot write");
  }
  file_->io()->direct = uncompressed() ? 1 : 0;  // pixels go from the image to the kernel without a copy
  return {};
}

/// Writes a packet like that of libav's raw video encoder, but without its copy: rows without gaps.
Status SegmentWriter::put_uncompressed(const Image& image, const IndexRecord& record) {
  // libav only reads the packet.
  packet_->data = const_cast<std::uint8_t*>(reinterpret_cast<const std::uint8_t*>(image.bytes().data()));
  packet_->size = static_cast<int>(image.bytes().size());
  packet_->pts = record.segment_ms;
  packet_->dts = record.segment_ms;
  return put_packet(&record);
}

Status SegmentWriter::encode_and_put(const Image& image, const IndexRecord& record) {
  if (const int code = av_frame_make_writable(frame_.get()); code < 0) return failure(code, "cannot encode");
  to_av(image, *frame_);
  frame_->pts = record.segment_ms;
  if (const int code = avcodec_send_frame(encoder_.get(), frame_.get()); code < 0) {
    return failure(code, "cannot encode");
  }
  return drain(&record);
}

Status SegmentWriter::write(const Image& image, const IndexRecord& record) {
  EMBERLOCK_RETURN_IF_ERROR(uncompressed() ? put_uncompressed(image, record) : encode_and_put(image, record));
  waiting_ = true;
  start_writeback();
  return {};
}

/// The encoders delay no frame, so their output belongs to `record`.
Status SegmentWriter::drain(const IndexRecord* record) {
  for (;;) {
    const int code = avcodec_receive_packet(encoder_.get(), packet_.get());
    if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) return {};
    if (code < 0) return failure(code, "cannot encode");
    EMBERLOCK_RETURN_IF_ERROR(put_packet(record));
  }
}

Status SegmentWriter::put_packet(const IndexRecord* record) {
  packet_->stream_index = 0;
  packet_->flags |= AV_PKT_FLAG_KEY;
  if (record != nullptr) {
    std::uint8_t* const side = av_packet_new_side_data(packet_.get(), AV_PKT_DATA_MATROSKA_BLOCKADDITIONAL,
                                                       kAdditionalId.size() + kIndexRecordBytes);
    if (side == nullptr) return failure(AVERROR(ENOMEM), "cannot write");
    const auto bytes = encode(*record);
    std::copy(bytes.begin(), bytes.end(), std::copy(kAdditionalId.begin(), kAdditionalId.end(), side));
  }
  av_packet_rescale_ts(packet_.get(), kMilliseconds, format_->streams[0]->time_base);
  int code = av_write_frame(format_.get(), packet_.get());
  av_packet_unref(packet_.get());
  if (code >= 0) code = file_->io()->error;
  if (code < 0) return failure(code, "cannot write");
  return {};
}

Status SegmentWriter::flush() {
  if (!std::exchange(waiting_, false)) return {};
  int code = av_write_frame(format_.get(), nullptr);  // ends the Matroska cluster
  avio_flush(file_->io());
  if (code >= 0) code = file_->io()->error;
  if (code < 0) return failure(code, "cannot write");
  start_writeback();
  return {};
}

/// Starts the write-back early. Otherwise the kernel keeps seconds of frames in memory; flushing them when
/// the segments of all cameras close at once would fill the queues.
void SegmentWriter::start_writeback() {
  constexpr std::uint64_t kStep = std::uint64_t{1} << 20;
  const std::uint64_t written = bytes();
  if (written - on_its_way_ < kStep) return;
  // If the call isn't supported, the next sync writes everything.
  ::sync_file_range(file_->fd(), static_cast<off64_t>(on_its_way_),
                    static_cast<off64_t>(written - on_its_way_), SYNC_FILE_RANGE_WRITE);
  on_its_way_ = written;
}

Status SegmentWriter::close() {
  avcodec_send_frame(encoder_.get(), nullptr);
  EMBERLOCK_RETURN_IF_ERROR(drain(nullptr));
  int code = av_write_trailer(format_.get());
  avio_flush(file_->io());
  if (code >= 0) code = file_->io()->error;
  format_.reset();
  if (code < 0) return failure(code, "cannot finish the segment");
  return {};
}

Status SegmentWriter::sync() {
  if (::fdatasync(file_->fd()) != 0) return errno_error(file_->path(), "cannot flush");
  return {};
}

bool SegmentWriter::uncompressed() const { return codec_of(layout_, encoding_) == AV_CODEC_ID_RAWVIDEO; }

std::uint64_t SegmentWriter::bytes() const { return static_cast<std::uint64_t>(avio_tell(file_->io())); }

std::vector<IndexRecord> records_in(const std::filesystem::path& segment) {
  std::vector<IndexRecord> records;
  const auto input = open_av_input(segment, Checking::lenient);
  if (!input) return records;
  const AvPtr<AVPacket> packet(av_packet_alloc());
  for (; av_read_frame(input->format.get(), packet.get()) >= 0; av_packet_unref(packet.get())) {
    if (packet->stream_index != input->stream) continue;
    std::size_t size = 0;
    const std::uint8_t* const side =
        av_packet_get_side_data(packet.get(), AV_PKT_DATA_MATROSKA_BLOCKADDITIONAL, &size);
    // libav's NUT puts another id before it, so the record is taken from the end.
    if (side == nullptr || size < kIndexRecordBytes) continue;
    const char* const at = reinterpret_cast<const char*>(side) + (size - kIndexRecordBytes);
    if (const auto record = decode_record({at, kIndexRecordBytes})) records.push_back(*record);
  }
  return records;
}

SegmentReader::SegmentReader(std::filesystem::path path, ImageLayout layout, AvInput input)
    : path_(std::move(path)),
      layout_(layout),
      input_(std::move(input)),
      packet_(av_packet_alloc()),
      frame_(av_frame_alloc()),
      beyond_(std::numeric_limits<std::int64_t>::max()) {}

Result<SegmentReader> SegmentReader::open(const std::filesystem::path& path, const ImageLayout& layout) {
  auto input = open_av_input(path, Checking::strict);
  if (!input) {
    return Error{input.error().kind, "the segment can't be opened: " + input.error().what, path.string(),
                 "Its frames are lost; others stay readable"};
  }
  SegmentReader reader(path, layout, std::move(input).value());
  return reader;
}

Error SegmentReader::damaged(const std::string& reason) const {
  return {ErrorKind::bad_input, reason, path_.string(), "Leave this frame out, or restore the file"};
}

std::int64_t SegmentReader::ticks(std::uint32_t milliseconds) const {
  return av_rescale_q(milliseconds, kMilliseconds, input_.format->streams[input_.stream]->time_base);
}

bool SegmentReader::seek(std::uint32_t milliseconds) {
  avcodec_flush_buffers(input_.decoder.get());
  return av_seek_frame(input_.format.get(), input_.stream, ticks(milliseconds), AVSEEK_FLAG_BACKWARD) >= 0;
}

Result<Image> SegmentReader::read(std::uint32_t milliseconds) {
  return at<Image>(milliseconds, [this] { return decode(); });
}

Status SegmentReader::check(std::uint32_t milliseconds, std::uint64_t hash) {
  if (input_.format->streams[input_.stream]->codecpar->codec_id == AV_CODEC_ID_FFV1)
    return at<void>(milliseconds, [this] { return check_slices(); });
  EMBERLOCK_ASSIGN_OR_RETURN(const Image image, read(milliseconds));
  if (pixel_hash(image.bytes()) != hash) return damaged("the pixels aren't those that were recorded");
  return {};
}

template <class T>
Result<T> SegmentReader::at(std::uint32_t milliseconds, const std::function<Result<T>()>& take) {
  constexpr std::uint32_t kNear = 200;  // up to this distance reading on is faster than seeking
  const std::int64_t target = ticks(milliseconds);
  const bool ahead = position_ >= 0 && target >= position_ && target - position_ <= ticks(kNear);
  if (ahead || seek(milliseconds)) {
    Result<T> found = scan_to(milliseconds, From::here, take);
    if (found || target >= beyond_) return found;
  }
  // A damaged seek table must not cost good frames.
  EMBERLOCK_ASSIGN_OR_RETURN(AvInput fresh, open_av_input(path_, Checking::strict));
  input_.format.reset();  // before the file that it reads
  input_ = std::move(fresh);
  return scan_to(milliseconds, From::start, take);
}

template <class T>
Result<T> SegmentReader::scan_to(std::uint32_t milliseconds, From from,
                                 const std::function<Result<T>()>& take) {
  const std::int64_t target = ticks(milliseconds);
  position_ = -1;
  for (;;) {
    av_packet_unref(packet_.get());
    const int code = av_read_frame(input_.format.get(), packet_.get());
    if (code < 0) {
      if (from == From::start) beyond_ = std::min(beyond_, target);
      return damaged("the frame isn't in the segment, which is truncated or damaged");
    }
    if (packet_->stream_index != input_.stream || packet_->pts < target) continue;
    if (packet_->pts > target) return damaged("the frame isn't in the segment, which is damaged");
    Result<T> taken = take();
    if (taken) position_ = target + 1;
    return taken;
  }
}

/// A frame of FFV1 version 3 is a chain of slices. Each slice ends with its length (24 bits), an error byte
/// and a checksum (32 bits); the CRC over the slice and these is 0 (RFC 9043, 4.9). The chain is walked from
/// its end.
Status SegmentReader::check_slices() const {
  constexpr int kFooter = 8;
  const AVCRC* const table = av_crc_get_table(AV_CRC_32_IEEE);
  int end = packet_->size;
  while (end > 0) {
    if (end < kFooter) return damaged("the frame's slices don't join");
    const std::uint8_t* const footer = packet_->data + end - kFooter;
    const int length = (footer[0] << 16 | footer[1] << 8 | footer[2]) + kFooter;
    if (length > end) return damaged("the frame's slices don't join");
    if (length == kFooter) return damaged("a slice is empty");  // zeros would pass the checksum
    end -= length;
    if (av_crc(table, 0, packet_->data + end, static_cast<std::size_t>(length)) != 0)
      return damaged("a slice's checksum is wrong");
  }
  return packet_->size > 0 ? Status() : damaged("the frame is empty");
}

Result<Image> SegmentReader::decode() {
  int code = avcodec_send_packet(input_.decoder.get(), packet_.get());
  if (code >= 0) code = avcodec_receive_frame(input_.decoder.get(), frame_.get());
  if (code < 0) return damaged("the frame doesn't decode: " + av_message(code));
  const bool known = frame_->format == coded_format(layout_, Encoding::ffv1) ||
                     frame_->format == coded_format(layout_, Encoding::raw_nut) ||
                     frame_->format == coded_format(layout_, Encoding::huffman_nut);
  if (!known || frame_->width != layout_.size.width || frame_->height != layout_.size.height) {
    return damaged("the frame has another size or format than the manifest says");
  }
  Image image(layout_);
  from_av(*frame_, image);
  av_frame_unref(frame_.get());
  return image;
}

}  // namespace emberlock::session
