// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/kernels/combustion.h"
#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// A disk in the floor out of which gas flows.
struct Burner {
  Meters x{0}, y{0};
  Meters radius{0.05};
  double speed = 0.02;  ///< m/s, upwards; 0: nothing comes out
};

enum class Combustion {
  none,      ///< only warm gas and smoke: the passes of burning aren't in the list
  one_step,  ///< recon/kernels/combustion.h
};

struct FlameSimulationOptions {
  int nx = 48, ny = 48, nz = 96;  ///< cells, multiples of 8 from 8 to 1024
  Meters edge{0.02};              ///< of a cell, 1e-5..100 m
  std::vector<Burner> burners = {Burner{}};
  Combustion combustion = Combustion::one_step;
  GasProperties gas;
  double burner_soot = 0;  ///< mass fraction of soot (or smoke) in what flows out, 0..0.5
  double confinement = 0;  ///< strength of the vorticity confinement, 0..1; 0: no such pass
  double diffusivity = 0;  ///< of momentum, heat and mass, m^2/s, constant; 0: no such pass
  double eddies = 0;       ///< Smagorinsky's constant, 0..0.3: mixing by eddies below a cell; 0: no such pass
  double unevenness = 0.1;  ///< of the burners' speed from face to face, 0..1 of it
  std::uint64_t seed = 1;   ///< of that
  double cfl = 0.9;         ///< cells that gas passes in a substep at most, along all axes together, 0.1..1
  int substeps = 1000;      ///< of a step at most; a longer step is refused
  ComputeOptions compute;
};

enum class FlamePreset { candle, pool_fire, torch, two_plumes, smoke };

/// "candle", "pool-fire", "torch", "two-plumes" or "smoke"; an Error that lists them otherwise.
Result<FlamePreset> parse_flame_preset(std::string_view name);
std::string_view name(FlamePreset preset);

/// A preset with so many cells across, a multiple of 8; twice as many upwards. Each has only the effects it
/// calls for: a candle is laminar, so it has diffusion and no confinement; smoke doesn't burn.
FlameSimulationOptions flame_preset(FlamePreset preset, int cells);

/// What a step did.
struct FluidStats {
  int substeps = 0;
  int iterations = 0;              ///< of the pressure's solver, all substeps together
  double relative_divergence = 0;  ///< rms of (divergence - that of expanding gas): after the projection over
                                   ///< before it; the worst substep's
  double cfl = 0;                  ///< cells passed in a substep, the most
  double fastest = 0;              ///< m/s, the components of a velocity added up
  Kelvin hottest;
  double heat_release = 0;  ///< W, of the last substep
};

/// The physical truth of an instant: values in the cells' centres, which are the grid's key points. The
/// burners' floor is at z = 0, the middle of the fluid at x = y = 0.
struct GasState {
  Grid grid;
  std::vector<float> temperature;  ///< K
  std::vector<float> absorption;   ///< 1/m, of soot, at 550 nm (at another wavelength: times 550 nm over it)
  std::vector<float> velocity;     ///< m/s, x, y, z interleaved
  std::vector<float> heat;         ///< W/m^3 released by combustion; empty if nothing burns
};

/// Buoyant, burning gas on a staggered grid, after Nguyen, Fedkiw and Jensen 2002 ("Physically based modeling
/// and animation of fire") and Hong, Shinar and Fedkiw 2007 ("Wrinkled flames and cellular patterns"). Unlike
/// theirs its flames are not a sharp front but burn where fuel and oxygen mix. A substep: transport of what
/// the gas carries, MacCormack advection of its velocity, diffusion, combustion with soot and radiation,
/// buoyancy, vorticity confinement, and a projection with the gas' true density, after which the divergence
/// is that of gas which expands. Gas flows freely through the sides and the top, beyond which there is still
/// air; the floor is solid and slips. Pure: no clock and no file, and the same bits for any number of
/// threads. Not thread-safe; on a GPU it belongs to the thread that made it.
class FlameSimulation {
 public:
  /// Errors: bad_input for an option out of its range, device for a device that isn't there or full.
  static Result<FlameSimulation> make(const FlameSimulationOptions& options);
  FlameSimulation(FlameSimulation&&) noexcept;
  FlameSimulation& operator=(FlameSimulation&&) noexcept;
  ~FlameSimulation();

  /// Goes on by a time, in as many substeps as the CFL number asks for; 0 changes nothing. Errors: bad_input
  /// for a time that is negative or not finite, refused (and nothing changed) where it would take more than
  /// `substeps`, not_converged where a number isn't finite or the projection fails, device.
  Result<FluidStats> step(Seconds time);

  /// The same gas at the same time on a grid twice as fine, linear between the cells: what is finer comes
  /// with the next steps, whose first takes out what divergence that leaves. Errors: as make().
  [[nodiscard]] Result<FlameSimulation> finer() const;

  [[nodiscard]] GasState state() const;
  [[nodiscard]] Seconds time() const;
  [[nodiscard]] const FlameSimulationOptions& options() const;

 private:
  class Fluid;
  explicit FlameSimulation(std::unique_ptr<Fluid> fluid);
  std::unique_ptr<Fluid> fluid_;
};

}  // namespace emberlock::recon
