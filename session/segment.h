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

// One file of frames. Which libav pixel format carries which layout stands in segment_pixels.h. With each
// frame goes its record of the index, so that a segment tells by itself all that is known of its frames: in
// Matroska as a BlockAdditional of id 1, in NUT (version 4) as side data "CodecSpecificSide1". Players pass
// it over.
namespace emberlock::session {

/// Encodes frames into one segment file. Frames wait in memory for flush(), in Matroska a quarter of a second
/// of them at most; a killed process loses those.
class SegmentWriter {
 public:
  static Result<std::unique_ptr<SegmentWriter>> create(const std::filesystem::path& path,
                                                       const ImageLayout& layout, Encoding encoding,
                                                       Hertz frame_rate);
  SegmentWriter(const SegmentWriter&) = delete;
  SegmentWriter& operator=(const SegmentWriter&) = delete;
  ~SegmentWriter();

  /// `record.segment_ms`, the frame's time stamp, rises from frame to frame. The image has the segment's
  /// layout.
  Status write(const Image& image, const IndexRecord& record);
  /// Hands all frames written so far to the operating system: a player, and salvage, find them.
  Status flush();
  /// Writes the container's end. sync() has the disk hold it.
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
  bool waiting_ = false;          ///< frames, for flush()
  std::uint64_t on_its_way_ = 0;  ///< bytes that the kernel has been told to write
};

/// The records that a segment's frames carry, in the order of the file, as far as it can be read; pixels
/// aren't looked at. Empty for one that was written before frames carried them, or that isn't a segment.
std::vector<IndexRecord> records_in(const std::filesystem::path& segment);

/// Decodes frames of one segment file by their time stamps.
class SegmentReader {
 public:
  static Result<SegmentReader> open(const std::filesystem::path& path, const ImageLayout& layout);

  /// The frame with this time stamp. Rising stamps are fastest. Errors: bad_input (absent, damaged, other
  /// layout).
  Result<Image> read(std::uint32_t milliseconds);
  /// Whether the frame with this time stamp lies there as it was written, `hash` being pixel_hash of its
  /// pixels. FFV1 is told by the checksums of its slices, without decoding it; what has none is decoded and
  /// compared with the hash. A frame that it calls whole can be read; one that it doesn't may be readable, as
  /// a few bytes matter to checksums alone. Errors: as read().
  Status check(std::uint32_t milliseconds, std::uint64_t hash);

 private:
  SegmentReader(std::filesystem::path path, ImageLayout layout, AvInput input);
  enum class From { here, start };
  /// Finds the packet with this time stamp, and returns what `take` makes of it.
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
  std::int64_t beyond_;        ///< reading from the start ends before this time stamp
  std::int64_t position_ = 0;  ///< every packet before this time stamp has been read; -1: unknown
};

}  // namespace emberlock::session
