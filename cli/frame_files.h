// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/export/exr_file.h"
#include "recon/views/radiance_image.h"
#include "session/video_writer.h"

namespace emberlock::cli {

/// Grey level of white.
inline constexpr float kWhite = 255;

/// What `--format` and `--rate` say: png, exr, mp4 or ffv1.
struct FrameFormat {
  std::string format = "png";
  double rate = 24;  ///< of a video, frames a second

  [[nodiscard]] bool video() const { return format == "mp4" || format == "ffv1"; }
  [[nodiscard]] session::VideoWriter::Coding coding() const {
    using Coding = session::VideoWriter::Coding;
    return format == "ffv1" ? Coding::lossless : Coding::for_players;
  }
};
/// Error: sides, a rate or a brightness out of range; odd sides of a video for players.
Status check_frames(const FrameFormat& format, ImageSize size, double brightness);

/// Colours and opacities of 8 bits.
struct Picture {
  Image rgb;
  std::vector<std::uint8_t> opacity;  ///< empty: opaque
};
/// Of linear light in grey levels. What glows before nothing has to cover it where it is bright: PNG knows no
/// light that is only added.
Picture picture_of(const recon::RadianceImage& light, const std::vector<float>& opacity, bool transparent);

/// Pictures in a folder, frame-0000 and so on, or one video, NAME.mp4 or NAME.mkv.
class FrameFiles {
 public:
  static Result<FrameFiles> create(const FrameFormat& format, const std::filesystem::path& folder,
                                   const std::string& name, ImageSize size,
                                   const session::VideoDisplay& display = {});
  Status put(const Picture& picture);
  /// Light as fractions of white, the opacity beside it, and further channels.
  Status put_exr(const recon::RadianceImage& light, const std::vector<float>& opacity,
                 const std::vector<recon::ExrChannel>& further = {});
  Status put_exr(ImageSize size, const std::vector<recon::ExrChannel>& channels);
  Status close() { return video_ ? video_->close() : Status(); }

 private:
  explicit FrameFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}
  [[nodiscard]] std::filesystem::path next(const char* ending);

  std::filesystem::path folder_;
  int number_ = 0;
  std::unique_ptr<session::VideoWriter> video_;
};

}  // namespace emberlock::cli
