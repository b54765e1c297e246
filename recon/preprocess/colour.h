// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/calibrate/camera_response.h"
#include "recon/kernels/develop.h"
#include "session/rig_file.h"  // v1::Colour

namespace emberlock::recon {

/// The relative light that vignetting doesn't describe (dust on the sensor, coloured shading): values at the
/// middles of cells that divide the picture evenly, linear between them.
struct FlatField {
  int columns = 0, rows = 0;
  std::vector<float> light = {};  ///< [3 * (row * columns + column) + channel]; empty: 1 everywhere
};

/// How a camera's samples are converted to radiance: (response(sample / white) - dark) * gain / (vignetting *
/// flat). The default changes nothing. Immutable; results of `read_colour` are valid.
struct Colour {
  std::vector<double> response = {};       ///< exposure 0..1 at even samples 0..1, rising; empty: linear
  std::array<double, 3> dark = {};         ///< exposure without light
  std::array<double, 3> gain = {1, 1, 1};  ///< radiance for an exposure of 1
  std::array<double, 3> vignetting = {};   ///< k2, k4, k6
  FlatField flat = {};
  std::vector<std::uint32_t> hot_pixels = {};  ///< y * width + x, rising
  /// Of the pictures that all of the above made; null: not known.
  std::shared_ptr<const CameraResponse> spectral = {};
  Seconds exposure{0};  ///< at which `spectral` holds; 0: not told
};

/// Whether pictures stay as they are: nothing but the spectral response is known.
bool changes_nothing(const Colour& colour);

/// Relative exposure 0..1 of a sample 0..1, linear between the points of the response.
double exposure_of(const Colour& colour, double sample);

/// The relative light at a pixel (falloff() of kernels/develop.h).
inline double falloff(const std::array<double, 3>& k, double r_squared) {
  return falloff(k.data(), r_squared);
}
/// For kernels.
CellsOfLight cells_of(const FlatField& flat);

/// A flat field's three values at a place, with x and y in 0..1 of the picture's sides.
std::array<double, 3> light_at(const FlatField& flat, double x, double y);

/// Squared distance of a point (pixel centres at +0.5) from the picture's middle, in half diagonals.
double radius_squared(ImageSize size, double x, double y);

/// Converts the message for pictures of `size`. Errors name the field below `where`: numbers that aren't
/// finite, a response that doesn't rise from 0 to 1, other than three gains or dark levels, gains not above
/// 0, a vignetting or flat field without light somewhere, a flat field with a wrong number of values, hot
/// pixels outside the picture, a spectral response that isn't valid (camera_response.h), an exposure time
/// below 0 or above an hour.
Result<Colour> read_colour(const v1::Colour& message, ImageSize size, const std::string& where);
v1::Colour to_message(const Colour& colour);

}  // namespace emberlock::recon
