// SPDX-License-Identifier: Apache-2.0
#include "session/av.h"

#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/kind_of_file.h"
#include "base/log.h"
#include "session/files.h"

namespace emberlock::session {
namespace {

constexpr int kIoBuffer = 1 << 18;

void log_av(void* /*context*/, int level, const char* format, std::va_list arguments) {
  if (level > AV_LOG_WARNING) return;
  std::array<char, 512> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  log(LogCategory::session).debug("libav: {}", text.data());
}

int deny_open(AVFormatContext* /*context*/, AVIOContext** /*io*/, const char* /*url*/, int /*flags*/,
              AVDictionary** /*options*/) {
  return AVERROR(EPERM);
}

Error not_a_video(const std::filesystem::path& path, const std::string& reason) {
  return {
      ErrorKind::bad_input, "not an image, and not a readable video: " + reason, path.string(),
      "Known are PGM, PPM, PNG, JPEG, TIFF, FITS and what FFmpeg reads; a truncated file may lack its index"};
}

/// Opens the file without selecting a stream.
Result<AvInput> open_file(const std::filesystem::path& path, Checking checking) {
  quiet_libav();
  AvInput input;
  EMBERLOCK_ASSIGN_OR_RETURN(input.file, AvFile::open(path, AvFile::Mode::read));
  AVFormatContext* format = avformat_alloc_context();
  format->pb = input.file->io();
  format->io_open = deny_open;
  format->flags |= AVFMT_FLAG_CUSTOM_IO;
  if (checking == Checking::strict) format->error_recognition |= AV_EF_CRCCHECK;
  if (checking == Checking::unfilled) format->flags |= AVFMT_FLAG_NOFILLIN;
  // On failure avformat_open_input frees the context itself.
  int code = avformat_open_input(&format, "", nullptr, nullptr);
  if (code < 0) return not_a_video(path, av_message(code));
  input.format.reset(format);
  code = avformat_find_stream_info(format, nullptr);
  if (code < 0) return not_a_video(path, av_message(code));
  return input;
}

/// Opens the decoder of the selected stream and discards the packets of all others. Returns libav's code.
int open_decoder(AvInput& input, const AVCodec* codec, Checking checking) {
  AVFormatContext* format = input.format.get();
  for (unsigned i = 0; i < format->nb_streams; ++i) {
    if (static_cast<int>(i) != input.stream) format->streams[i]->discard = AVDISCARD_ALL;
  }
  input.decoder.reset(avcodec_alloc_context3(codec));
  const int code =
      avcodec_parameters_to_context(input.decoder.get(), format->streams[input.stream]->codecpar);
  if (code < 0) return code;
  input.decoder->thread_count = 1;
  if (checking == Checking::strict) input.decoder->err_recognition |= AV_EF_CRCCHECK | AV_EF_EXPLODE;
  return avcodec_open2(input.decoder.get(), codec, nullptr);
}

Seconds begin_of(const AVStream& stream) {
  if (stream.start_time == AV_NOPTS_VALUE) return Seconds(0);
  return Seconds(static_cast<double>(stream.start_time) * av_q2d(stream.time_base));
}

}  // namespace

std::string av_message(int code) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(code, text.data(), text.size());
  return text.data();
}

void quiet_libav() {
  static std::once_flag once;
  std::call_once(once, [] { av_log_set_callback(log_av); });
}

Result<std::unique_ptr<AvFile>> AvFile::open(const std::filesystem::path& path, Mode mode) {
  UniqueFd fd;
  if (mode == Mode::read) {
    EMBERLOCK_ASSIGN_OR_RETURN(fd, open_regular_file(path));
  } else {
    fd = UniqueFd(::open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (!fd) return errno_error(path, "cannot create");
  }
  auto* buffer = static_cast<std::uint8_t*>(av_malloc(kIoBuffer));
  std::unique_ptr<AvFile> file(new AvFile(std::move(fd), path));
  file->io_.reset(avio_alloc_context(buffer, kIoBuffer, mode == Mode::create ? 1 : 0, file.get(),
                                     AvFile::read, AvFile::write, AvFile::seek));
  return file;
}

int AvFile::read(void* self, std::uint8_t* buffer, int size) {
  const int fd = static_cast<AvFile*>(self)->fd();
  ssize_t n = 0;
  do {
    n = ::read(fd, buffer, static_cast<std::size_t>(size));
  } while (n < 0 && errno == EINTR);
  if (n == 0) return AVERROR_EOF;
  return n < 0 ? AVERROR(errno) : static_cast<int>(n);
}

int AvFile::write(void* self, std::uint8_t* buffer, int size) {
  const int fd = static_cast<AvFile*>(self)->fd();
  for (int done = 0; done < size;) {
    const ssize_t n = ::write(fd, buffer + done, static_cast<std::size_t>(size - done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return AVERROR(errno);
    done += static_cast<int>(n);
  }
  return size;
}

std::int64_t AvFile::seek(void* self, std::int64_t offset, int whence) {
  const int fd = static_cast<AvFile*>(self)->fd();
  if ((whence & AVSEEK_SIZE) != 0) {
    struct stat info {};
    return ::fstat(fd, &info) == 0 ? info.st_size : AVERROR(errno);
  }
  const off_t at = ::lseek(fd, offset, whence & ~AVSEEK_FORCE);
  return at < 0 ? AVERROR(errno) : at;
}

Result<AvInput> open_av_input(const std::filesystem::path& path, Checking checking) {
  EMBERLOCK_ASSIGN_OR_RETURN(AvInput input, open_file(path, checking));
  const AVCodec* codec = nullptr;
  input.stream = av_find_best_stream(input.format.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
  if (input.stream < 0 || codec == nullptr)
    return not_a_video(path, "it holds no video stream that can be decoded");
  const int code = open_decoder(input, codec, checking);
  if (code < 0) return not_a_video(path, av_message(code));
  return input;
}

VideoDisplay display_of(const AVStream& stream) {
  constexpr std::array<std::int32_t, 9> kAsStored{1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30};
  VideoDisplay display;
  std::size_t size = 0;
  const std::uint8_t* const data = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, &size);
  std::array<std::int32_t, 9> matrix{};
  if (data != nullptr && size >= sizeof matrix) {
    std::memcpy(matrix.data(), data, sizeof matrix);
    matrix[6] = matrix[7] = 0;  // offsets only move the picture within a player's window
    if (matrix != kAsStored) display.matrix = matrix;
  }
  const AVRational container = stream.sample_aspect_ratio;
  const AVRational pixel = container.num > 0 ? container : stream.codecpar->sample_aspect_ratio;
  if (pixel.num > 0 && pixel.den > 0) {
    display.pixel_width = pixel.num;
    display.pixel_height = pixel.den;
  }
  return display;
}

Result<AvSound> open_av_sound(const std::filesystem::path& path) {
  AvSound sound;
  EMBERLOCK_ASSIGN_OR_RETURN(sound.input, open_file(path, Checking::lenient));
  AVFormatContext* format = sound.input.format.get();
  const int video = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (video < 0) return not_a_video(path, "it holds no video stream");
  sound.video_begins = begin_of(*format->streams[video]);
  const AVCodec* codec = nullptr;
  sound.input.stream = av_find_best_stream(format, AVMEDIA_TYPE_AUDIO, -1, video, &codec, 0);
  if (sound.input.stream < 0 || codec == nullptr) return sound;
  sound.begins = begin_of(*format->streams[sound.input.stream]);
  if (open_decoder(sound.input, codec, Checking::lenient) < 0) sound.input.decoder.reset();
  return sound;
}

}  // namespace emberlock::session
