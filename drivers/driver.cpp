// SPDX-License-Identifier: Apache-2.0
#include "drivers/driver.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

namespace emberlock::drivers {
namespace {

std::string words(const CameraMode& mode) {
  return fmt::format("{} x {} {} at {:.4g} frames/s", mode.layout.size.width, mode.layout.size.height,
                     name(mode.layout.format), mode.frame_rate.value());
}

Error no_such_mode(std::span<const CameraMode> modes, const std::string& what, const std::string& camera) {
  constexpr std::size_t kListed = 12;
  std::string remedy = "it films";
  for (std::size_t i = 0; i < std::min(kListed, modes.size()); ++i) {
    remedy += (i == 0 ? " " : ", ") + words(modes[i]);
  }
  if (modes.size() > kListed) remedy += fmt::format(", and in {} more ways", modes.size() - kListed);
  return {ErrorKind::bad_input, what, camera, std::move(remedy)};
}

/// How much of a scene a mode preserves, for comparison: colour first, then depth; then raw data before data
/// computed by the camera, and these before JPEG.
std::tuple<bool, int, int> fidelity(const CameraMode& mode) {
  const ImageLayout& layout = mode.layout;
  const bool jpeg = mode.encoding == "MJPG" || mode.encoding == "JPEG";
  const int as_measured = is_bayer(layout.format) ? 2 : jpeg ? 0 : 1;
  return {channels(layout.format) > 1 || is_bayer(layout.format), layout.bit_depth, as_measured};
}

long area(const CameraMode& mode) {
  return static_cast<long>(mode.layout.size.width) * mode.layout.size.height;
}

}  // namespace

Result<CameraMode> choose_mode(std::span<const CameraMode> modes, const CameraRequest& request,
                               const std::string& camera) {
  if (modes.empty()) {
    return Error{ErrorKind::device, "it offers no mode that can be used", camera,
                 "`emberlock devices` shows what it sends; uncompressed grey, Bayer, RGB or YUYV is needed"};
  }
  std::vector<CameraMode> left(modes.begin(), modes.end());
  const auto keep = [&](const auto& wanted) {
    std::erase_if(left, [&](const CameraMode& mode) { return !wanted(mode); });
    return !left.empty();
  };
  if (request.size && !keep([&](const CameraMode& m) { return m.layout.size == *request.size; })) {
    return no_such_mode(
        modes, fmt::format("it has no pictures of {} x {}", request.size->width, request.size->height),
        camera);
  }
  if (request.format && !keep([&](const CameraMode& m) { return m.layout.format == *request.format; })) {
    return no_such_mode(modes, fmt::format("it doesn't send {} so", name(*request.format)), camera);
  }
  constexpr double kRounding = 1.001;  // 23.976 is often given as 23.98 or 24
  if (request.frame_rate &&
      !keep([&](const CameraMode& m) { return m.frame_rate * kRounding >= *request.frame_rate; })) {
    return no_such_mode(modes, fmt::format("it doesn't film {} frames/s so", request.frame_rate->value()),
                        camera);
  }
  return *std::max_element(left.begin(), left.end(), [](const CameraMode& a, const CameraMode& b) {
    return std::tuple(area(a), fidelity(a), a.frame_rate) < std::tuple(area(b), fidelity(b), b.frame_rate);
  });
}

}  // namespace emberlock::drivers
