// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "recon/views/box.h"
#include "recon/views/camera_model.h"
#include "recon/views/radiance_image.h"

namespace emberlock::recon {

struct CameraResponse;

enum class ViewRole {
  input,     ///< the volume is fitted to it
  held_out,  ///< judges the volume
  left_out,  ///< does neither, as its picture shows nothing of the flame (pipeline/blind_views.h)
};
/// "input", "held_out" or "left_out".
std::string_view name(ViewRole role);

/// View::bounds of a pixel that is left out, and whose image is black: any light explains it, it is in no
/// error, and it carves nothing.
inline constexpr std::uint8_t kLeftOutMarks = 8 | 7;
constexpr bool is_left_out(std::uint8_t marks) { return (marks & 8) != 0; }
constexpr bool is_saturated(std::uint8_t marks) { return marks != 0 && !is_left_out(marks); }

/// One camera's picture of the flame. Copies share their pixels.
struct View {
  std::string name;  ///< file or camera id, for messages
  CameraModel camera;
  SharedImage image;
  ViewRole role = ViewRole::input;
  /// What lies behind the flame, of the image's size; null is black.
  SharedImage background = {};
  /// Where the sensor was saturated and the image's value is a lower bound: one a pixel, bits 1, 2 and 4 for
  /// R, G and B; kLeftOutMarks where the pixel is left out. Null where no pixel is. Unlike Sensor::Clipping's
  /// one white for all views, it holds after gains and vignetting have been taken out.
  SharedBounds bounds = {};
  Seconds lateness{0};        ///< by how much it was filmed after the scene's instant
  Seconds lateness_sigma{0};  ///< standard error of that
  /// What the camera shows on average over the recording, of the image's size; null is not known.
  SharedImage average = {};
};

/// Whether the view marks saturated pixels.
[[nodiscard]] inline bool marks_saturation(const View& view) {
  return view.bounds && std::any_of(view.bounds->begin(), view.bounds->end(), is_saturated);
}
/// Whether the view has pixels that are left out.
[[nodiscard]] inline bool leaves_out(const View& view) {
  return view.bounds && std::any_of(view.bounds->begin(), view.bounds->end(), is_left_out);
}

/// A step of preparing the pictures: whether it ran, and why.
struct PreprocessStep {
  std::string name;
  bool on = false;
  std::string reason;
};

/// What a reconstruction starts from.
struct Scene {
  std::vector<View> views;
  Box box;
  std::vector<PreprocessStep> preprocessing = {};  ///< what was done to the pictures, in order
  std::vector<std::string> warnings = {};          ///< of reading the input
  /// They went through their cameras' calibrated responses: another gamma would bend them twice.
  bool linearised = false;
  std::shared_ptr<const CameraResponse> response = {};  ///< of all views; null: not known
  std::optional<Seconds> time = {};  ///< of a session: its instant, after the first camera's first frame
};

}  // namespace emberlock::recon
