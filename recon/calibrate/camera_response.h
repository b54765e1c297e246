// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace emberlock::recon {

/// What a camera's channels answer to light: the level (0..255) of channel c is the integral over wavelengths
/// of R_c(lambda) L(lambda) d lambda, where L is spectral radiance in W / (sr m^2 nm) and R_c is linear
/// between the given wavelengths and 0 outside. Valid if read or made by the functions below: at least two
/// rising wavelengths of 100..20000 nm, finite numbers, a channel that isn't 0 everywhere.
struct CameraResponse {
  std::vector<double> wavelength_nm;
  std::array<std::vector<double>, 3> level = {};  ///< R, G, B: one a wavelength; all 0: a dead channel
  /// Whether the levels' scale is known: levels per W / (sr m^2). Otherwise only channels compare.
  bool absolute = false;
  bool operator==(const CameraResponse&) const = default;
};

/// The integral of R_c f over the wavelengths, by Simpson's rule over pieces of at most 2 nm.
double integral(const CameraResponse& response, std::size_t channel,
                const std::function<double(double nm)>& f);

bool is_dead(const CameraResponse& response, std::size_t channel);

/// A camera whose pictures are linear sRGB (IEC 61966-2-1) of the CIE 1931 observer: what a camera that
/// reproduces colours shows. Relative. Its channels have negative lobes, as those of sRGB have.
const CameraResponse& standard_response();

/// The CIE 1931 observer itself, X, Y, Z in place of R, G, B; relative.
const CameraResponse& cie_1931_observer();

/// {"unit": "levels (0..255) per W / (sr m2)" or "relative", "wavelength_nm": [...], "r": [...], "g": [...],
/// "b": [...]}; "comment" is ignored. Errors name the file, the field and the remedy: other keys, a missing
/// one, lists of different lengths, what makes a CameraResponse invalid.
Result<CameraResponse> parse_camera_response(std::string_view json, const std::string& where);
Result<CameraResponse> read_camera_response(const std::filesystem::path& path);
/// What parse_camera_response() reads back bit by bit.
std::string to_json(const CameraResponse& response);

/// Why it isn't valid, if it isn't.
Status check_camera_response(const CameraResponse& response, const std::string& where);

}  // namespace emberlock::recon
