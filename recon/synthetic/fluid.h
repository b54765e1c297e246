// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "recon/kernels/fluid_diffusion.h"
#include "recon/kernels/fluid_forces.h"
#include "recon/kernels/fluid_transport.h"
#include "recon/synthetic/flame_simulation.h"
#include "recon/synthetic/fluid_work.h"
#include "recon/synthetic/pressure_solver.h"

namespace emberlock::recon {

/// The relative divergence that a projection reaches or else says.
constexpr double kWantedDivergence = 1e-5;

/// The fields of a FlameSimulation and its passes in their order. Options are valid.
class FlameSimulation::Fluid {
 public:
  explicit Fluid(const FlameSimulationOptions& options);
  /// The same gas on a grid twice as fine.
  static std::unique_ptr<Fluid> finer(const Fluid& coarse, const FlameSimulationOptions& options);

  Result<FluidStats> step(Seconds time);
  [[nodiscard]] GasState state() const;
  [[nodiscard]] Seconds time() const { return time_; }
  [[nodiscard]] const FlameSimulationOptions& options() const { return options_; }

 private:
  void set_burners();
  [[nodiscard]] double longest_substep(const FluidStats& stats) const;
  void look(FluidStats& stats);
  Status substep(double dt, FluidStats& stats);
  void transport(float cells);
  void advect(float cells);
  template <int Axis>
  void advect_faces(float cells);
  void diffuse(float dt);
  template <int Axis>
  void diffuse_faces(float share, const float* eddies);
  void confine(float dt);
  Status project(FluidStats& stats);
  [[nodiscard]] ConstFaceFields faces() const;
  [[nodiscard]] bool diffuses() const { return options_.diffusivity > 0 || options_.eddies > 0; }
  [[nodiscard]] bool burns() const { return options_.combustion == Combustion::one_step; }

  FlameSimulationOptions options_;
  FluidGrid grid_;
  FluidWork work_;
  Seconds time_{0};
  FluidArray<float> velocity_[3], next_velocity_[3];
  FluidArray<float> face_scratch_[3], scratch_;
  FluidArray<Rgba> gas_, next_gas_, gas_scratch_;
  FluidArray<float> particles_, next_particles_, heat_;  // empty if nothing burns
  FluidArray<float> expansion_, eddies_;

  PressureSolver pressure_;
  double fastest_burner_ = 0;
};

}  // namespace emberlock::recon
