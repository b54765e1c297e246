// SPDX-License-Identifier: Apache-2.0
#include "recon/synthetic/flame_simulation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "recon/synthetic/fluid.h"

namespace emberlock::recon {
namespace {

bool in_range(double v, double low, double high) { return v >= low && v <= high; }  // false for NaN

Error bad_flame(const std::string& what, const std::string& range) {
  return {ErrorKind::bad_input, what + " out of range", "flame simulation", "Take " + range};
}

Status check_burner(const Burner& burner) {
  if (!in_range(burner.radius.value(), 0, 1e4) || !in_range(std::abs(burner.x.value()), 0, 1e5) ||
      !in_range(std::abs(burner.y.value()), 0, 1e5))
    return bad_flame("a burner's place or radius", "metres");
  if (!in_range(burner.speed, 0, 100)) return bad_flame("a burner's speed", "0 to 100 m/s");
  return {};
}

Status check_gas(const GasProperties& gas) {
  const bool good = in_range(gas.air_temperature, 100, 1000) && in_range(gas.air_density, 1e-3, 100) &&
                    in_range(gas.heat_capacity, 100, 1e5) && in_range(gas.heat_of_combustion, 0, 2e8) &&
                    in_range(gas.oxygen_per_fuel, 0.1, 40) && in_range(gas.burner_temperature, 100, 2500) &&
                    in_range(gas.mixing_time, 0, 1e3) && in_range(gas.precursor_share, 0, 1);
  if (!good) return bad_flame("a property of the gas", "SI units as GasProperties documents them");
  return {};
}

Status check_options(const FlameSimulationOptions& o) {
  for (const int n : {o.nx, o.ny, o.nz})
    if (n < 8 || n > 1024 || n % 8 != 0) return bad_flame("cells", "multiples of 8 from 8 to 1024");
  if (!in_range(o.edge.value(), 1e-5, 100)) return bad_flame("a cell's edge", "1e-5 to 100 m");
  for (const Burner& burner : o.burners) EMBERLOCK_RETURN_IF_ERROR(check_burner(burner));
  EMBERLOCK_RETURN_IF_ERROR(check_gas(o.gas));
  if (!in_range(o.burner_soot, 0, 0.5)) return bad_flame("burner_soot", "0 to 0.5");
  if (!in_range(o.confinement, 0, 1)) return bad_flame("confinement", "0 to 1");
  if (!in_range(o.diffusivity, 0, 1e3)) return bad_flame("diffusivity", "0 to 1000 m^2/s");
  if (!in_range(o.eddies, 0, 0.3)) return bad_flame("eddies", "0 to 0.3");
  if (!in_range(o.unevenness, 0, 1)) return bad_flame("unevenness", "0 to 1");
  if (!in_range(o.cfl, 0.1, 1)) return bad_flame("cfl", "0.1 to 1");
  if (o.substeps < 1) return bad_flame("substeps", "1 or more");
  return {};
}

}  // namespace

FlameSimulation::FlameSimulation(std::unique_ptr<Fluid> fluid) : fluid_(std::move(fluid)) {}
FlameSimulation::FlameSimulation(FlameSimulation&&) noexcept = default;
FlameSimulation& FlameSimulation::operator=(FlameSimulation&&) noexcept = default;
FlameSimulation::~FlameSimulation() = default;

Result<FlameSimulation> FlameSimulation::make(const FlameSimulationOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check_options(options));
  try {
    return FlameSimulation(std::make_unique<Fluid>(options));
  } catch (const DeviceError& error) {
    return error.error();
  }
}

Result<FluidStats> FlameSimulation::step(Seconds time) {
  if (!in_range(time.value(), 0, 1e9)) return bad_flame("a time step", "0 or more, in seconds");
  try {
    return fluid_->step(time);
  } catch (const DeviceError& error) {
    return error.error();
  }
}

Result<FlameSimulation> FlameSimulation::finer() const {
  FlameSimulationOptions fine = options();
  fine.nx *= 2;
  fine.ny *= 2;
  fine.nz *= 2;
  fine.edge = fine.edge / 2;
  EMBERLOCK_RETURN_IF_ERROR(check_options(fine));
  try {
    return FlameSimulation(Fluid::finer(*fluid_, fine));
  } catch (const DeviceError& error) {
    return error.error();
  }
}

GasState FlameSimulation::state() const { return fluid_->state(); }
Seconds FlameSimulation::time() const { return fluid_->time(); }
const FlameSimulationOptions& FlameSimulation::options() const { return fluid_->options(); }

}  // namespace emberlock::recon
