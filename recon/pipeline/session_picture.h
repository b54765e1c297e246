#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "base/result.h"
#include "recon/preprocess/develop.h"
#include "session/reader.h"

namespace emberlock {

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

/// A frame of a session, and its camera as it is known by now: the manifest's, or a rig's.
struct SessionFrame {
  std::size_t camera = 0;
  std::size_t frame = 0;
  const v1::CameraStream& stream;
};

/// A frame as radiance, by its camera's colour and sensor. Reads up to two frames to see whether there is a part
/// without flame, and eight of it. Errors: those of SessionReader::read() and read_colour(); dark frames that the
/// camera doesn't have.
Result<DevelopedPicture> develop_frame(SessionReader& reader, const SessionFrame& which, const FrameOptions& options);

}  // namespace emberlock
