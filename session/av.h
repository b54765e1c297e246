// SPDX-License-Identifier: Apache-2.0
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/frame.h>
}

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "base/unique_fd.h"
#include "session/video_display.h"

// RAII owners of libav's objects. Files are passed to libav as descriptors, so protocols and special file
// names have no effect.
namespace emberlock::session {

struct AvFree {
  void operator()(AVFrame* f) const { av_frame_free(&f); }
  void operator()(AVPacket* p) const { av_packet_free(&p); }
  void operator()(AVCodecContext* c) const { avcodec_free_context(&c); }
  void operator()(AVIOContext* io) const {
    av_freep(reinterpret_cast<void*>(&io->buffer));
    avio_context_free(&io);
  }
};
struct AvCloseInput {
  void operator()(AVFormatContext* c) const { avformat_close_input(&c); }
};
struct AvFreeOutput {
  void operator()(AVFormatContext* c) const { avformat_free_context(c); }
};
template <class T>
using AvPtr = std::unique_ptr<T, AvFree>;

/// libav's text for an error code.
std::string av_message(int code);
/// Redirects libav's messages to the session log at level debug. Idempotent.
void quiet_libav();

/// An AVIOContext over a file. Not movable, because libav holds its address.
class AvFile {
 public:
  enum class Mode { read, create };
  static Result<std::unique_ptr<AvFile>> open(const std::filesystem::path& path, Mode mode);
  AvFile(const AvFile&) = delete;
  AvFile& operator=(const AvFile&) = delete;
  ~AvFile() = default;

  [[nodiscard]] AVIOContext* io() const { return io_.get(); }
  [[nodiscard]] int fd() const { return fd_.get(); }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  AvFile(UniqueFd fd, std::filesystem::path path) : fd_(std::move(fd)), path_(std::move(path)) {}
  static int read(void* self, std::uint8_t* buffer, int size);
  static int write(void* self, std::uint8_t* buffer, int size);
  static std::int64_t seek(void* self, std::int64_t offset, int whence);

  UniqueFd fd_;
  std::filesystem::path path_;
  AvPtr<AVIOContext> io_;
};

/// A video stream of a local file opened for reading, with its decoder.
struct AvInput {
  std::unique_ptr<AvFile> file;
  std::unique_ptr<AVFormatContext, AvCloseInput> format;
  AvPtr<AVCodecContext> decoder;
  int stream = -1;
};

enum class Checking {
  lenient,   ///< errors are concealed as far as the decoder can
  strict,    ///< checksums are verified; damage is an error
  unfilled,  ///< as lenient, but packets have only those time stamps that the file holds
};

/// Opens the first video stream of `path`. No other file is read, even if the file refers to one.
Result<AvInput> open_av_input(const std::filesystem::path& path, Checking checking);

VideoDisplay display_of(const AVStream& stream);

/// The sound track of a local video file opened for reading.
struct AvSound {
  AvInput input;         ///< has no decoder where there is no decodable sound
  Seconds begins;        ///< of the first sample, by the file's clock
  Seconds video_begins;  ///< of the first frame
};

/// Opens the sound track that belongs to the first video stream of `path`. Errors: no video.
Result<AvSound> open_av_sound(const std::filesystem::path& path);

}  // namespace emberlock::session
