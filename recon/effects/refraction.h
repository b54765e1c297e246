// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/effects/effects.h"
#include "recon/hull/medium.h"
#include "recon/kernels/refract.h"

namespace emberlock::recon {

/// n - 1 of air, or of burnt gas (which differs little), at atmospheric pressure: (n_air - 1) T_air / T
/// (Gladstone and Dale 1863), with n_air - 1 = 2.7e-4 at 293 K for visible light (Ciddor 1996: 2.71e-4 at 589
/// nm).
double index_excess(Kelvin temperature);

/// A gas temperature at key points. On the box's surface it should be that of the surroundings.
struct GasTemperature {
  Grid grid;
  std::vector<float> kelvin;
};

/// The assumed temperature, since the program can't measure it: `refraction.flame` in the middle of the
/// medium, `refraction.ambient` outside, with a transition as wide as the smoothing, about two coarse cells
/// (a coarse cell is a 32nd of the medium's longest side, at least one voxel). `emission` at the medium's key
/// points, if given, shows where the medium is hot: gas with less than the mean luminance is proportionally
/// cooler. The plume above the medium is neglected. A known temperature is better; any GasTemperature can be
/// used. Solvers keep the paths fixed: a change of the paths with the medium is neglected, also in the
/// adjoint.
GasTemperature assume_temperature(const Hull& medium, const std::vector<Rgba>& emission,
                                  const Refraction& refraction);

/// The refractive index relative to the surroundings, and its gradient by central differences. Owns the
/// values that `field` points to.
class RefractiveIndex {
 public:
  RefractiveIndex(const GasTemperature& gas, Kelvin ambient);
  /// n - 1 at key points, for fields from other sources.
  RefractiveIndex(const Grid& grid, const std::vector<float>& excess);

  /// The field for rays through a medium on `grid`, in `grid`'s voxel edges.
  [[nodiscard]] IndexField field(const Grid& grid) const;

 private:
  Grid grid_;
  std::vector<Rgba> values_;
};

}  // namespace emberlock::recon
