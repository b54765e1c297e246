// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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

/// One camera's picture of the flame. Copies share their pixels.
struct View {
  std::string name;  ///< file or camera id, for messages
  CameraModel camera;
  SharedImage image;
  ViewRole role = ViewRole::input;
  /// What lies behind the flame, of the image's size; null is black.
  SharedImage background = {};
  /// Where the sensor was saturated and the image's value is a lower bound: one a pixel, bits 1, 2 and 4 for
  /// R, G and B. Null where no pixel is. Unlike Sensor::Clipping's one white for all views, it holds after
  /// gains and vignetting have been taken out.
  SharedBounds bounds = {};
  Seconds lateness{0};        ///< by how much it was filmed after the scene's instant
  Seconds lateness_sigma{0};  ///< standard error of that
  /// What the camera shows on average over the recording, of the image's size; null is not known.
  SharedImage average = {};
};

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
  /// They went through their cameras' calibrated responses: another gamma would bend them twice.
  bool linearised = false;
  std::shared_ptr<const CameraResponse> response = {};  ///< of all views; null: not known
  std::optional<Seconds> time = {};  ///< of a session: its instant, after the first camera's first frame
};

}  // namespace emberlock::recon
