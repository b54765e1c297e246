// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/modes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace emberlock::drivers {
namespace {

// Far more than real devices have; stops at a device that never ends its list.
constexpr std::uint32_t kMostEntries = 256;
constexpr std::size_t kMostModes = 4096;
// The accepted range of frame rates.
constexpr Hertz kSlowest{0.01};
constexpr Hertz kFastest{10000};

constexpr std::array<ImageSize, 12> kUsualSizes = {{{160, 120},
                                                    {320, 240},
                                                    {640, 360},
                                                    {640, 480},
                                                    {800, 600},
                                                    {1024, 768},
                                                    {1280, 720},
                                                    {1280, 1024},
                                                    {1920, 1080},
                                                    {2048, 1536},
                                                    {2592, 1944},
                                                    {3840, 2160}}};

bool usable(Hertz rate) { return rate >= kSlowest && rate <= kFastest; }

/// Reads entries until the device has no more.
template <class Entry>
std::vector<Entry> list(const Ioctl& device, unsigned long request, Entry entry) {
  std::vector<Entry> all;
  for (entry.index = 0; entry.index < kMostEntries; ++entry.index) {
    Entry answer = entry;
    if (device(request, &answer) != 0) break;
    all.push_back(answer);
  }
  return all;
}

/// Whether a side of `n` pixels is one of min, min + step, .. max.
bool fits(std::int64_t n, std::uint32_t min, std::uint32_t max, std::uint32_t step) {
  return n >= min && n <= max && (n - min) % std::max(step, 1U) == 0;
}

ImageSize size(std::uint32_t width, std::uint32_t height) {
  constexpr std::uint32_t kBeyond = 1 << 30;  // larger than any image
  return {static_cast<int>(std::min(width, kBeyond)), static_cast<int>(std::min(height, kBeyond))};
}

void add_once(std::vector<ImageSize>& sizes, ImageSize size) {
  if (std::find(sizes.begin(), sizes.end(), size) == sizes.end()) sizes.push_back(size);
}

std::vector<ImageSize> sizes_by_steps(const v4l2_frmsize_stepwise& range, std::optional<ImageSize> wanted) {
  std::vector<ImageSize> sizes;
  std::vector<ImageSize> candidates(kUsualSizes.begin(), kUsualSizes.end());
  if (wanted) candidates.push_back(*wanted);
  for (const ImageSize candidate : candidates) {
    if (fits(candidate.width, range.min_width, range.max_width, range.step_width) &&
        fits(candidate.height, range.min_height, range.max_height, range.step_height)) {
      add_once(sizes, candidate);
    }
  }
  add_once(sizes, size(range.min_width, range.min_height));
  add_once(sizes, size(range.max_width, range.max_height));
  return sizes;
}

std::vector<ImageSize> list_sizes(const Ioctl& device, std::uint32_t fourcc,
                                  std::optional<ImageSize> wanted) {
  v4l2_frmsizeenum entry{};
  entry.pixel_format = fourcc;
  std::vector<ImageSize> sizes;
  for (const auto& answer : list(device, VIDIOC_ENUM_FRAMESIZES, entry)) {
    if (answer.type != V4L2_FRMSIZE_TYPE_DISCRETE) return sizes_by_steps(answer.stepwise, wanted);
    add_once(sizes, size(answer.discrete.width, answer.discrete.height));
  }
  if (!sizes.empty()) return sizes;
  v4l2_format now{};
  now.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device(VIDIOC_G_FMT, &now) == 0) sizes.push_back(size(now.fmt.pix.width, now.fmt.pix.height));
  return sizes;
}

/// Sets the mode's intervals and its highest rate. Returns whether there is one.
bool add_intervals(const Ioctl& device, V4l2Mode& mode) {
  v4l2_frmivalenum entry{};
  entry.pixel_format = mode.fourcc;
  entry.width = static_cast<std::uint32_t>(mode.pixels.size.width);
  entry.height = static_cast<std::uint32_t>(mode.pixels.size.height);
  for (const auto& answer : list(device, VIDIOC_ENUM_FRAMEINTERVALS, entry)) {
    if (answer.type != V4L2_FRMIVAL_TYPE_DISCRETE) {
      mode.intervals = {answer.stepwise.min, answer.stepwise.max};
      mode.between = V4l2Mode::Between::any;
      break;
    }
    mode.intervals.push_back(answer.discrete);
  }
  v4l2_streamparm now{};
  now.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (mode.intervals.empty() && device(VIDIOC_G_PARM, &now) == 0) {
    mode.intervals.push_back(now.parm.capture.timeperframe);
  }
  std::erase_if(mode.intervals, [](v4l2_fract interval) { return !usable(rate_of(interval)); });
  if (mode.intervals.empty()) return false;
  std::sort(mode.intervals.begin(), mode.intervals.end(),
            [](v4l2_fract a, v4l2_fract b) { return rate_of(a) > rate_of(b); });
  mode.mode.frame_rate = rate_of(mode.intervals.front());
  return true;
}

}  // namespace

std::optional<V4l2Packing> packing_of(std::uint32_t fourcc) {
  using enum BayerPhase;
  switch (fourcc) {
    case V4L2_PIX_FMT_GREY:
      return V4l2Packing{PixelPacking::gray8};
    case V4L2_PIX_FMT_Y10:
      return V4l2Packing{PixelPacking::gray10};
    case V4L2_PIX_FMT_Y12:
      return V4l2Packing{PixelPacking::gray12};
    case V4L2_PIX_FMT_Y14:
      return V4l2Packing{PixelPacking::gray14};
    case V4L2_PIX_FMT_Y16:
      return V4l2Packing{PixelPacking::gray16};
    case V4L2_PIX_FMT_Y10P:
      return V4l2Packing{PixelPacking::gray10_mipi};
    case V4L2_PIX_FMT_MJPEG:
    case V4L2_PIX_FMT_JPEG:
    case V4L2_PIX_FMT_RGB24:
      return V4l2Packing{PixelPacking::rgb8};
    case V4L2_PIX_FMT_BGR24:
      return V4l2Packing{PixelPacking::bgr8};
    case V4L2_PIX_FMT_YUYV:
      return V4l2Packing{PixelPacking::yuyv};
    case V4L2_PIX_FMT_UYVY:
      return V4l2Packing{PixelPacking::uyvy};
    case V4L2_PIX_FMT_SRGGB8:
      return V4l2Packing{PixelPacking::bayer8, rggb};
    case V4L2_PIX_FMT_SGRBG8:
      return V4l2Packing{PixelPacking::bayer8, grbg};
    case V4L2_PIX_FMT_SGBRG8:
      return V4l2Packing{PixelPacking::bayer8, gbrg};
    case V4L2_PIX_FMT_SBGGR8:
      return V4l2Packing{PixelPacking::bayer8, bggr};
    case V4L2_PIX_FMT_SRGGB10:
      return V4l2Packing{PixelPacking::bayer10, rggb};
    case V4L2_PIX_FMT_SGRBG10:
      return V4l2Packing{PixelPacking::bayer10, grbg};
    case V4L2_PIX_FMT_SGBRG10:
      return V4l2Packing{PixelPacking::bayer10, gbrg};
    case V4L2_PIX_FMT_SBGGR10:
      return V4l2Packing{PixelPacking::bayer10, bggr};
    case V4L2_PIX_FMT_SRGGB12:
      return V4l2Packing{PixelPacking::bayer12, rggb};
    case V4L2_PIX_FMT_SGRBG12:
      return V4l2Packing{PixelPacking::bayer12, grbg};
    case V4L2_PIX_FMT_SGBRG12:
      return V4l2Packing{PixelPacking::bayer12, gbrg};
    case V4L2_PIX_FMT_SBGGR12:
      return V4l2Packing{PixelPacking::bayer12, bggr};
    case V4L2_PIX_FMT_SRGGB16:
      return V4l2Packing{PixelPacking::bayer16, rggb};
    case V4L2_PIX_FMT_SGRBG16:
      return V4l2Packing{PixelPacking::bayer16, grbg};
    case V4L2_PIX_FMT_SGBRG16:
      return V4l2Packing{PixelPacking::bayer16, gbrg};
    case V4L2_PIX_FMT_SBGGR16:
      return V4l2Packing{PixelPacking::bayer16, bggr};
    default:
      return {};
  }
}

bool is_jpeg(std::uint32_t fourcc) { return fourcc == V4L2_PIX_FMT_MJPEG || fourcc == V4L2_PIX_FMT_JPEG; }

std::string fourcc_name(std::uint32_t fourcc) {
  std::string name;
  for (int shift = 0; shift < 32; shift += 8) {
    const auto letter = static_cast<char>(fourcc >> shift & 0x7f);
    name += letter > ' ' && letter <= '~' ? letter : '.';
  }
  return name;
}

Hertz rate_of(v4l2_fract interval) {
  if (interval.numerator == 0) return Hertz(0);
  return Hertz(static_cast<double>(interval.denominator) / interval.numerator);
}

V4l2Modes list_modes(const Ioctl& device, std::optional<ImageSize> wanted) {
  V4l2Modes all;
  std::vector<std::uint32_t> seen;
  v4l2_fmtdesc format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (const auto& answer : list(device, VIDIOC_ENUM_FMT, format)) {
    if (std::find(seen.begin(), seen.end(), answer.pixelformat) != seen.end()) continue;
    seen.push_back(answer.pixelformat);
    const auto packing = packing_of(answer.pixelformat);
    if (!packing) {
      all.unknown.push_back(fourcc_name(answer.pixelformat));
      continue;
    }
    for (const ImageSize size : list_sizes(device, answer.pixelformat, wanted)) {
      V4l2Mode mode{{}, answer.pixelformat, {size, packing->packing, packing->phase}, {}};
      const auto layout = layout_of(mode.pixels);
      if (!layout || !add_intervals(device, mode)) continue;
      mode.mode.layout = *layout;
      mode.mode.encoding = fourcc_name(mode.fourcc);
      all.modes.push_back(std::move(mode));
      if (all.modes.size() == kMostModes) return all;
    }
  }
  return all;
}

v4l2_fract interval_for(const V4l2Mode& mode, std::optional<Hertz> wanted) {
  const v4l2_fract shortest = mode.intervals.front();
  if (!wanted || !usable(*wanted)) return shortest;
  if (mode.between == V4l2Mode::Between::any && *wanted <= rate_of(shortest) &&
      *wanted >= rate_of(mode.intervals.back())) {
    constexpr std::uint32_t kTicks = 100'000;  // rates up to kFastest keep six digits
    return {kTicks, static_cast<std::uint32_t>(std::lround(wanted->value() * kTicks))};
  }
  return *std::min_element(mode.intervals.begin(), mode.intervals.end(), [&](v4l2_fract a, v4l2_fract b) {
    return std::abs(std::log(rate_of(a) / *wanted)) < std::abs(std::log(rate_of(b) / *wanted));
  });
}

}  // namespace emberlock::drivers
