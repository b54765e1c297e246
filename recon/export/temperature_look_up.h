// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "base/quantity.h"
#include "recon/calibrate/camera_response.h"
#include "recon/temperature/emitter.h"

namespace emberlock::recon {

/// Temperatures for the previews of a running solve: of a place's colour alone, by a monotone table. Grey and
/// soot: by the share of the light that the first channel sees; the paper: by green and its constant opacity.
/// It knows no errors, leaves emission over extinction out, and doesn't give soot its own blue back, so the
/// grids of temperature_of() are better. Immutable, thread-safe.
class TemperatureLookUp {
 public:
  /// One table of EmitterTable. A camera whose channels all see alike tells nothing, except to the paper.
  TemperatureLookUp(const CameraResponse& response, Emitter emitter);

  /// K of each place; 0: darker than kShareThatCounts of the brightest, or beyond the table. `emission`: R,
  /// G, B of each, levels a metre. `edge`: of the grid's voxels, which the paper's opacity counts by.
  [[nodiscard]] std::vector<float> read(const std::vector<float>& emission, Meters edge) const;
  /// The paper's convention on a scale that stays the same while the light changes: a green of `hottest` (>
  /// 0) and above is its hottest. 0: without green, or below its coldest. For Emitter::paper, whose response
  /// is taken as relative.
  [[nodiscard]] std::vector<float> read_green(const std::vector<float>& emission, float hottest) const;

 private:
  struct Entry {
    double key, inverse;  ///< falls as temperature rises; 1 / K
  };
  [[nodiscard]] double share(const float* rgb) const;
  [[nodiscard]] double kelvin(double key) const;

  Emitter emitter_;
  bool absolute_;
  std::size_t channel_ = 0;     ///< whose share tells
  std::vector<Entry> entries_;  ///< rising keys; empty: nothing can be told
};

}  // namespace emberlock::recon
