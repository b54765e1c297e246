// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace emberlock::session {

/// How players show the stored frames of a video.
struct VideoDisplay {
  /// By which they turn or mirror them, in libav's fixed-point form; nullopt: as stored.
  std::optional<std::array<std::int32_t, 9>> matrix{};
  int pixel_width = 1;  ///< of a pixel, in proportion to its height
  int pixel_height = 1;

  [[nodiscard]] bool square() const { return pixel_width == pixel_height; }
};

}  // namespace emberlock::session
