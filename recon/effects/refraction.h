// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/effects/effects.h"
#include "recon/hull/medium.h"
#include "recon/kernels/refract.h"

namespace emberlock::recon {

/// n - 1 of air, or of burnt gas, which differs little from it, at atmospheric pressure: (n_air - 1) T_air /
/// T (Gladstone and Dale 1863), n_air - 1 = 2.7e-4 at 293 K for visible light (Ciddor 1996: 2.71e-4 at 589
/// nm).
double index_excess(Kelvin temperature);

/// A gas temperature at key points. The values on the box's surface should be the surroundings'.
struct GasTemperature {
  Grid grid;
  std::vector<float> kelvin;
};

/// What the program assumes, as it can't measure the gas: `refraction.flame` in the middle of the medium,
/// `refraction.ambient` outside, and between them a transition as wide as the smoothing, which is about two
/// coarse cells (a coarse cell is a 32nd of the medium's longest side, at least one voxel). `emission` at the
/// medium's key points, if not empty, says where the medium is hot: gas below the mean luminance is
/// proportionally cooler. The plume above the medium is left out. Known temperatures beat this: any
/// GasTemperature will do. Solvers hold the paths fixed: how a change of the medium would move them is left
/// out, from the adjoint too.
GasTemperature assume_temperature(const Hull& medium, const std::vector<Rgba>& emission,
                                  const Refraction& refraction);

/// The refractive index relative to the surroundings' and its gradient, by central differences. Holds the
/// values that `field` points to.
class RefractiveIndex {
 public:
  RefractiveIndex(const GasTemperature& gas, Kelvin ambient);
  /// n - 1 at key points, for fields known otherwise.
  RefractiveIndex(const Grid& grid, const std::vector<float>& excess);

  /// As rays through a medium on `grid` see it, in `grid`'s voxel edges.
  [[nodiscard]] IndexField field(const Grid& grid) const;

 private:
  Grid grid_;
  std::vector<Rgba> values_;
};

}  // namespace emberlock::recon
