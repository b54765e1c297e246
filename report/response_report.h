// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/preprocess/glow_region.h"
#include "recon/temperature/response_fit.h"

namespace emberlock::report {

/// A picture of an emitter of known temperature.
struct GlowSource {
  std::string name;  ///< of the file
  recon::PatchPlace region;
  recon::GlowReading reading;
};

/// Three lines of text on a channel: its peak and scale, its shift, its width, each with its error.
std::vector<std::string> channel_words(const recon::FittedChannel& channel);

/// A page on a camera's spectral response: the response and its base, scale, shift and width with their
/// errors, what a flame's level is known to, and each picture's levels beside those of the fit.
std::string response_report_page(const std::vector<GlowSource>& sources, const recon::ResponseFit& fit,
                                 const recon::CameraResponse& base);

}  // namespace emberlock::report
