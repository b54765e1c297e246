// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "session/media/frame_file.h"
#include "session/video_display.h"

namespace emberlock::cli {

/// What `ar` draws into: a video's file, or what a camera filmed.
class ArFilm {
 public:
  /// Errors: those of session::scan_video().
  static Result<ArFilm> of_video(const std::filesystem::path& path);
  /// Rgb8 frames of one size, and when each was filmed.
  ArFilm(std::string name, std::vector<Image> frames, std::vector<Seconds> times);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] ImageSize size() const { return size_; }
  /// Of each frame, after the first. Of a video, those that its packets promise: fewer may decode.
  [[nodiscard]] const std::vector<Seconds>& times() const { return times_; }
  /// How players show a video's frames; they are drawn into as they are stored.
  [[nodiscard]] const session::VideoDisplay& display() const { return display_; }
  [[nodiscard]] bool sound() const { return sound_; }
  /// As most frames follow one another; 24 of a single one.
  [[nodiscard]] Hertz rate() const;

  /// The next frame, as rgb8. Errors: out_of_data behind the last; bad_input where it is damaged, or has
  /// another size than the first: the error names it.
  Result<Image> next();
  /// Back to the first frame.
  Status rewind();

 private:
  ArFilm() = default;

  std::string name_;
  ImageSize size_;
  session::VideoDisplay display_;
  bool sound_ = false;
  std::vector<Seconds> times_;
  std::filesystem::path path_;
  std::unique_ptr<session::FrameFile> file_;
  std::vector<Image> held_;
  std::size_t at_ = 0;
};

/// Films with a camera that is connected, or one of emberlockd's configuration (`config` not empty), which
/// may be virtual or recorded too. Errors: bad_input (no such camera), those of the camera, refused (more
/// than 4 GB).
Result<ArFilm> film_camera(const std::string& camera, const std::filesystem::path& config, Seconds seconds);

}  // namespace emberlock::cli
