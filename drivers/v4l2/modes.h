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

// The tables by which a V4L2 device says how it can film. Nothing in them is believed: a device may
// contradict itself, repeat itself without end or name sizes of zero.
namespace emberlock::drivers {

/// The kernel's ioctl on one device: 0, or errno.
using Ioctl = std::function<int(unsigned long request, void* argument)>;

/// How a four-letter code of V4L2 lays out its pixels; none where we don't know it.
struct V4l2Packing {
  PixelPacking packing = PixelPacking::gray8;
  BayerPhase phase = BayerPhase::rggb;
};
std::optional<V4l2Packing> packing_of(std::uint32_t fourcc);

/// Each frame is a JPEG.
bool is_jpeg(std::uint32_t fourcc);

/// "YUYV"; letters that can't be shown become '.'.
std::string fourcc_name(std::uint32_t fourcc);

/// A mode, and what the device has to be told for it.
struct V4l2Mode {
  CameraMode mode;
  std::uint32_t fourcc = 0;
  PackedPixels pixels;  ///< of a JPEG only the size counts
  /// Seconds a frame, shortest first, all > 0. Where any between two will do, those two.
  std::vector<v4l2_fract> intervals;
  enum class Between { none, any } between = Between::none;
};

struct V4l2Modes {
  std::vector<V4l2Mode> modes;
  std::vector<std::string> unknown;  ///< encodings that can't be unpacked
};

/// What the device offers in formats that we know, at most 4096 modes. Of sizes by steps: the usual ones, the
/// ends, and `wanted`. A device that names no sizes or rates is taken at what it is set to.
V4l2Modes list_modes(const Ioctl& device, std::optional<ImageSize> wanted);

/// The interval nearest to what is wanted, else the shortest.
v4l2_fract interval_for(const V4l2Mode& mode, std::optional<Hertz> wanted);

/// 1 / interval; 0 for what is none.
Hertz rate_of(v4l2_fract interval);

}  // namespace emberlock::drivers
