#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "session/av.h"
#include "session/writer.h"

// One file of frames. Which libav pixel format carries which layout stands in segment_pixels.h.
namespace emberlock {

/// Encodes frames into one segment file. At most kClusterTime of frames waits in memory; a killed process
/// loses those.
class SegmentWriter {
 public:
  static Result<std::unique_ptr<SegmentWriter>> create(const std::filesystem::path& path,
                                                       const ImageLayout& layout, Encoding encoding,
                                                       Hertz frame_rate);
  SegmentWriter(const SegmentWriter&) = delete;
  SegmentWriter& operator=(const SegmentWriter&) = delete;
  ~SegmentWriter();

  /// `milliseconds` rises from frame to frame. The image has the segment's layout.
  Status write(const Image& image, std::uint32_t milliseconds);
  /// Writes the container's end and flushes to disk.
  Status close();
  /// Bytes handed to the file so far.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  SegmentWriter(ImageLayout layout, Encoding encoding) : layout_(layout), encoding_(encoding) {}
  Status open(const std::filesystem::path& path, Hertz frame_rate);
  Status write_header(Hertz frame_rate);
  Status put_uncompressed(const Image& image, std::uint32_t milliseconds);
  Status drain();
  Status put_packet();
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
  std::uint64_t on_its_way_ = 0;  ///< bytes that the kernel has been told to write
};

/// Decodes frames of one segment file by their time stamps.
class SegmentReader {
 public:
  static Result<SegmentReader> open(const std::filesystem::path& path, const ImageLayout& layout);

  /// The frame with this time stamp. Rising stamps are fastest. Errors: bad_input (absent, damaged, other
  /// layout).
  Result<Image> read(std::uint32_t milliseconds);

 private:
  SegmentReader(std::filesystem::path path, ImageLayout layout, AvInput input);
  enum class From { here, start };
  Result<Image> scan_to(std::uint32_t milliseconds, From from);
  Result<Image> scan_from_start(std::uint32_t milliseconds);
  Result<Image> decode();
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

}  // namespace emberlock
