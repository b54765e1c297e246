// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "recon/preprocess/develop.h"
#include "session/reader.h"

namespace emberlock::recon {

/// How a session's frames become pictures.
struct FrameOptions {
  enum class Background {
    automatic,  ///< the first or last frames of each camera, where the flame isn't burning in them; else
                ///< `level`
    level,      ///< of the picture's own darker half
    frames,     ///< the mean of the middle half of `dark`
  };
  Background background = Background::automatic;
  std::pair<std::size_t, std::size_t> dark = {};  ///< first and last frame of each camera, 33 at most
  DevelopOptions develop = {};
};

/// "auto", "level" or "FIRST-LAST", in frames of each camera.
Status parse_background(const std::string& text, FrameOptions& options);
/// "auto", "off", or a fraction of every row's light such as 2e-4; FRACTION:above and FRACTION:below count
/// the rows on that side alone.
Status parse_smear(const std::string& text, FrameOptions& options);

/// Develops frames of one camera of a session by its colour and sensor. Its part without flame is looked for,
/// and read, once.
class FrameDeveloper {
 public:
  /// `stream`: the camera as it is known by now, by the manifest or a rig. `flame`: a frame that shows the
  /// flame, number `number` of the camera's. Reads up to two frames to see whether there is a part without
  /// flame, and all eight of that. Errors: those of SessionReader::read() and read_colour(); dark frames that
  /// the camera doesn't have.
  static Result<FrameDeveloper> create(session::SessionReader& reader, std::size_t camera,
                                       const v1::CameraStream& stream, const Frame& flame, std::size_t number,
                                       const FrameOptions& options);

  /// A frame of the camera as radiance.
  [[nodiscard]] DevelopedPicture develop(const Frame& frame) const;

  /// Whether the camera's calibrated response makes its pictures linear in light.
  [[nodiscard]] bool linearises() const { return colour_ && !colour_->response.empty(); }

 private:
  FrameDeveloper() = default;
  SensorKind sensor_ = SensorKind::ccd;
  std::optional<Colour> colour_;
  std::shared_ptr<const DarkPicture> dark_;
  DevelopOptions options_;
};

}  // namespace emberlock::recon
