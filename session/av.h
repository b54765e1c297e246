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

// Owners of libav's objects, and files for it that are plain descriptors: no protocols, no names with a
// meaning.
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

/// libav's words for one of its error codes.
std::string av_message(int code);
/// Sends libav's chatter to the session log at level debug; idempotent.
void quiet_libav();

/// A file behind an AVIOContext. Never moves, since libav holds its address.
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

/// A video stream of a local file, opened for reading, with its decoder.
struct AvInput {
  std::unique_ptr<AvFile> file;
  std::unique_ptr<AVFormatContext, AvCloseInput> format;
  AvPtr<AVCodecContext> decoder;
  int stream = -1;
};

enum class Checking {
  lenient,  ///< what the decoder makes of the bytes
  strict,   ///< checksums are verified, damage is an error
};

/// Opens the first video stream of `path`. Only the file itself is read, whatever it refers to.
Result<AvInput> open_av_input(const std::filesystem::path& path, Checking checking);

/// The sound of a local video file, opened for reading.
struct AvSound {
  AvInput input;         ///< without a decoder where there is no sound that can be decoded
  Seconds begins;        ///< the first sample, by the file's clock
  Seconds video_begins;  ///< the first frame
};

/// Opens the sound that belongs to the first video stream of `path`. Errors: no video.
Result<AvSound> open_av_sound(const std::filesystem::path& path);

}  // namespace emberlock::session
