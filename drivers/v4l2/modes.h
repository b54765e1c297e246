// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <linux/videodev2.h>

#include "base/image.h"
#include "base/quantity.h"
#include "drivers/driver.h"
#include "drivers/unpack.h"

// The format tables of a V4L2 device. They aren't trusted: a device may contradict itself, repeat entries
// endlessly or list sizes of zero.
namespace emberlock::drivers {

/// ioctl(2) on one device. Returns 0 or errno.
using Ioctl = std::function<int(unsigned long request, void* argument)>;

/// The pixel layout of a V4L2 FourCC code; nullopt if unknown.
struct V4l2Packing {
  PixelPacking packing = PixelPacking::gray8;
  BayerPhase phase = BayerPhase::rggb;
};
std::optional<V4l2Packing> packing_of(std::uint32_t fourcc);

/// Whether each frame is a JPEG.
bool is_jpeg(std::uint32_t fourcc);

/// "YUYV"; unprintable letters become '.'.
std::string fourcc_name(std::uint32_t fourcc);

/// A mode, and the settings of the device that select it.
struct V4l2Mode {
  CameraMode mode;
  std::uint32_t fourcc = 0;
  PackedPixels pixels;  ///< for JPEG only the size matters
  /// Seconds per frame, ascending, all > 0. If a range is allowed, its two ends.
  std::vector<v4l2_fract> intervals;
  enum class Between { none, any } between = Between::none;
};

struct V4l2Modes {
  std::vector<V4l2Mode> modes;
  std::vector<std::string> unknown;  ///< encodings that can't be unpacked
};

/// The device's modes in known formats, at most 4096. For stepwise sizes: the usual sizes, both ends, and
/// `wanted`. For a device that lists no sizes or rates, its present setting.
V4l2Modes list_modes(const Ioctl& device, std::optional<ImageSize> wanted);

/// The interval closest to the wanted rate; the shortest if no rate is wanted.
v4l2_fract interval_for(const V4l2Mode& mode, std::optional<Hertz> wanted);

/// 1 / interval; 0 for an invalid one.
Hertz rate_of(v4l2_fract interval);

}  // namespace emberlock::drivers
