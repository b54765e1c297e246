// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "session/av.h"
#include "session/index.h"
#include "session/writer.h"

// One file of frames. segment_pixels.h says which libav pixel format holds which layout. Each frame carries
// its index record, so the index can be rebuilt from the segment: in Matroska as a BlockAdditional of id 1,
// in NUT (version 4) as side data "CodecSpecificSide1". Players ignore it.
namespace emberlock::session {

/// Encodes frames into one segment file. Frames wait in memory until flush(), in Matroska for at most a
/// quarter of a second; they are lost if the process is killed.
class SegmentWriter {
 public:
  static Result<std::unique_ptr<SegmentWriter>> create(const std::filesystem::path& path,
                                                       const ImageLayout& layout, Encoding encoding,
                                                       Hertz frame_rate);
  SegmentWriter(const SegmentWriter&) = delete;
  SegmentWriter& operator=(const SegmentWriter&) = delete;
  ~SegmentWriter();

  /// `record.segment_ms`, the frame's time stamp, must rise from frame to frame. The image must have the
  /// segment's layout.
  Status write(const Image& image, const IndexRecord& record);
  /// Hands all frames written so far to the operating system, where players and salvage can read them.
  Status flush();
  /// Writes the end of the container. sync() makes it durable.
  Status close();
  Status sync();
  [[nodiscard]] int fd() const { return file_->fd(); }
  /// Bytes handed to the file so far.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  SegmentWriter(ImageLayout layout, Encoding encoding) : layout_(layout), encoding_(encoding) {}
  Status open(const std::filesystem::path& path, Hertz frame_rate);
  Status write_header(Hertz frame_rate);
  Status put_uncompressed(const Image& image, const IndexRecord& record);
  Status encode_and_put(const Image& image, const IndexRecord& record);
  Status drain(const IndexRecord* record);
  Status put_packet(const IndexRecord* record);
  [[nodiscard]] bool uncompressed() const;
  void start_writeback();
  [[nodiscard]] Error failure(int code, const char* action) const;

  ImageLayout layout_;
  Encoding encoding_;
  std::unique_ptr<AvFile> file_;
  std::unique_ptr<AVFormatContext, AvFreeOutput> format_;
  AvPtr<AVCodecContext> encoder_;
  AvPtr<AVFrame> frame_;
  AvPtr<AVPacket> packet_;
  bool waiting_ = false;          ///< some frames haven't been flushed
  std::uint64_t on_its_way_ = 0;  ///< bytes whose write-back the kernel has been asked to start
};

/// The index records of a segment's frames in file order, as far as the file can be read. Pixels are not
/// checked. Empty for segments without records, and for other files.
std::vector<IndexRecord> records_in(const std::filesystem::path& segment);

/// Decodes frames of one segment file by their time stamps.
class SegmentReader {
 public:
  static Result<SegmentReader> open(const std::filesystem::path& path, const ImageLayout& layout);

  /// The frame with this time stamp. Rising stamps are fastest. Errors: bad_input (absent, damaged, other
  /// layout).
  Result<Image> read(std::uint32_t milliseconds);
  /// Whether the frame with this time stamp is intact; `hash` is the pixel_hash of its pixels. FFV1 frames
  /// are checked by their slice checksums without decoding; others are decoded and compared with the hash. A
  /// frame that passes can be read. One that fails may still be readable, since a few bytes affect only the
  /// checksums. Errors: as read().
  Status check(std::uint32_t milliseconds, std::uint64_t hash);

 private:
  SegmentReader(std::filesystem::path path, ImageLayout layout, AvInput input);
  enum class From { here, start };
  /// Finds the packet with this time stamp and returns the result of `take`.
  template <class T>
  Result<T> at(std::uint32_t milliseconds, const std::function<Result<T>()>& take);
  template <class T>
  Result<T> scan_to(std::uint32_t milliseconds, From from, const std::function<Result<T>()>& take);
  Result<Image> decode();
  Status check_slices() const;
  bool seek(std::uint32_t milliseconds);
  [[nodiscard]] std::int64_t ticks(std::uint32_t milliseconds) const;
  [[nodiscard]] Error damaged(const std::string& reason) const;

  std::filesystem::path path_;
  ImageLayout layout_;
  AvInput input_;
  AvPtr<AVPacket> packet_;
  AvPtr<AVFrame> frame_;
  std::int64_t beyond_;        ///< reading from the start stops before this time stamp
  std::int64_t position_ = 0;  ///< all packets before this time stamp have been read; -1: unknown
};

}  // namespace emberlock::session
