// SPDX-License-Identifier: Apache-2.0
#include "recon/synthetic/fluid.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/random.h"
#include "recon/kernels/fluid_refine.h"

namespace emberlock::recon {
namespace {

FluidGrid grid_of(const FlameSimulationOptions& o) {
  return {o.nx, o.ny, o.nz, static_cast<float>(o.edge.value())};
}

/// The share of a face of the floor that lies in a disk, of 8 x 8 points.
double covered(const Burner& burner, double x, double y, double edge) {
  constexpr int kPoints = 8;
  int inside = 0;
  for (int a = 0; a < kPoints; ++a)
    for (int b = 0; b < kPoints; ++b) {
      const double px = x + ((a + 0.5) / kPoints - 0.5) * edge - burner.x.value();
      const double py = y + ((b + 0.5) / kPoints - 0.5) * edge - burner.y.value();
      inside += px * px + py * py <= burner.radius.value() * burner.radius.value() ? 1 : 0;
    }
  return static_cast<double>(inside) / (kPoints * kPoints);
}

}  // namespace

FlameSimulation::Fluid::Fluid(const FlameSimulationOptions& options)
    : options_(options), grid_(grid_of(options)), work_(options.compute), pressure_(grid_, work_) {
  const std::size_t size = grid_.size();
  for (int axis = 0; axis < 3; ++axis) {
    velocity_[axis] = work_.array<float>(size);
    next_velocity_[axis] = work_.array<float>(size);
    face_scratch_[axis] = work_.array<float>(size);
  }
  Rgba air;
  air.c[kTemperature] = options_.gas.air_temperature;
  const std::vector<Rgba> still(size, air);
  for (FluidArray<Rgba>* array : {&gas_, &next_gas_, &gas_scratch_}) {
    *array = work_.array<Rgba>(size);
    array->fill(still);
  }
  if (burns())
    for (FluidArray<float>* array : {&particles_, &next_particles_, &scratch_, &heat_})
      *array = work_.array<float>(size);
  if (burns() || diffuses()) expansion_ = work_.array<float>(size);
  if (options.eddies > 0) eddies_ = work_.array<float>(size);
  set_burners();
}

std::unique_ptr<FlameSimulation::Fluid> FlameSimulation::Fluid::finer(const Fluid& coarse,
                                                                      const FlameSimulationOptions& options) {
  auto fine = std::make_unique<Fluid>(options);
  fine->time_ = coarse.time_;
  const auto from = coarse.grid_;
  const auto to = fine->grid_;
  FluidWork& work = fine->work_;
  work.cells(to, Refine<Rgba, -1>{coarse.gas_.data(), fine->gas_.data(), from, to});
  if (fine->burns())
    work.cells(to, Refine<float, -1>{coarse.particles_.data(), fine->particles_.data(), from, to});
  work.faces<0>(to, Refine<float, 0>{coarse.velocity_[0].data(), fine->velocity_[0].data(), from, to});
  work.faces<1>(to, Refine<float, 1>{coarse.velocity_[1].data(), fine->velocity_[1].data(), from, to});
  work.faces<2>(to, Refine<float, 2>{coarse.velocity_[2].data(), fine->velocity_[2].data(), from, to});
  return fine;
}

/// Their speeds stand in the floor's faces, which no pass changes.
void FlameSimulation::Fluid::set_burners() {
  std::vector<float> w(grid_.size());
  for (int j = 0; j < grid_.ny; ++j)
    for (int i = 0; i < grid_.nx; ++i) {
      const double x = (i + 0.5 - grid_.nx / 2.0) * options_.edge.value();
      const double y = (j + 0.5 - grid_.ny / 2.0) * options_.edge.value();
      double speed = 0;
      for (const Burner& burner : options_.burners)
        speed += burner.speed * covered(burner, x, y, options_.edge.value());
      const auto face = static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(grid_.nx) +
                        static_cast<std::uint64_t>(i);
      speed *= 1 + options_.unevenness * (2 * random_uniform(options_.seed, 0, face) - 1);
      w[grid_.index(i, j, 0)] = static_cast<float>(speed);
      fastest_burner_ = std::max(fastest_burner_, speed);
    }
  velocity_[2].fill(w);
  next_velocity_[2].fill(w);
}

ConstFaceFields FlameSimulation::Fluid::faces() const {
  return {{velocity_[0].data(), velocity_[1].data(), velocity_[2].data()}};
}

void FlameSimulation::Fluid::look(FluidStats& stats) {
  const FluidSums most = work_.greatest(grid_, Extremes{faces(), gas_.data(), grid_});
  stats.fastest = most.first;
  stats.hottest = Kelvin(most.second);
}

/// In which gas passes no more cells than wanted, though buoyancy speeds it up meanwhile; and in which
/// diffusion is stable.
double FlameSimulation::Fluid::longest_substep(const FluidStats& stats) const {
  const double way = options_.cfl * options_.edge.value();
  const double air = options_.gas.air_temperature;
  const double hottest =
      std::max(stats.hottest.value(), static_cast<double>(options_.gas.burner_temperature));
  const double faster = static_cast<double>(kGravity) * std::max(0.0, hottest / air - 1);
  const double speed = std::max(stats.fastest, fastest_burner_);
  // (speed + faster t) t = way, in the form that holds for faster = 0.
  const double divisor = speed + std::sqrt(speed * speed + 4 * faster * way);
  double longest = divisor > 0 ? 2 * way / divisor : 1e9;
  if (options_.diffusivity > 0)
    longest = std::min(longest, options_.edge.value() * options_.edge.value() / (12 * options_.diffusivity));
  return longest;
}

Result<FluidStats> FlameSimulation::Fluid::step(Seconds time) {
  FluidStats stats;
  look(stats);
  double left = time.value();
  while (left > 0) {
    const double parts = std::ceil(left / longest_substep(stats) * (1 - 1e-9));
    if (!(parts + stats.substeps <= options_.substeps))
      return Error{stats.substeps == 0 ? ErrorKind::refused : ErrorKind::not_converged,
                   "a step of " + std::to_string(time.value()) + " s needs more than " +
                       std::to_string(options_.substeps) + " substeps",
                   "flame simulation", "Take shorter steps, or allow more substeps"};
    const double dt = left / std::max(1.0, parts);
    stats.cfl = std::max(stats.cfl, stats.fastest * dt / options_.edge.value());
    EMBERLOCK_RETURN_IF_ERROR(substep(dt, stats));
    left = parts <= 1 ? 0 : left - dt;
    ++stats.substeps;
  }
  time_ += time;
  return stats;
}

Status FlameSimulation::Fluid::substep(double seconds, FluidStats& stats) {
  const auto dt = static_cast<float>(seconds);
  const float cells = dt / grid_.edge;
  transport(cells);
  advect(cells);
  if (diffuses())
    diffuse(dt);
  else if (burns())
    work_.cells(grid_, SetZero{expansion_.data(), grid_});
  if (burns())
    work_.cells(grid_, Burn{options_.gas, gas_.data(), particles_.data(), expansion_.data(), heat_.data(),
                            grid_, dt});
  work_.faces<2>(grid_, Buoyancy{gas_.data(), velocity_[2].data(), grid_, options_.gas.air_temperature, dt});
  if (options_.confinement > 0) confine(dt);
  EMBERLOCK_RETURN_IF_ERROR(project(stats));
  look(stats);
  if (!std::isfinite(stats.fastest) || !std::isfinite(stats.hottest.value()))
    return Error{ErrorKind::not_converged, "a number of the gas isn't finite", "flame simulation",
                 "Take smaller steps or a smaller cfl"};
  if (burns()) {
    const double volume = std::pow(options_.edge.value(), 3);
    stats.heat_release = volume * work_.sum(grid_, SumCells{heat_.data()}).first;
  }
  return {};
}

template <int Axis>
void FlameSimulation::Fluid::advect_faces(float cells) {
  const float* in = velocity_[Axis].data();
  float* hat = face_scratch_[Axis].data();
  float* out = next_velocity_[Axis].data();
  work_.faces<Axis>(grid_, TraceBack<float, Axis>{in, hat, faces(), grid_, cells});
  work_.faces<Axis>(grid_, CorrectTrace<float, Axis>{in, hat, out, faces(), grid_, cells});
}

void FlameSimulation::Fluid::transport(float cells) {
  Rgba inlet;
  inlet.c[kTemperature] = options_.gas.burner_temperature;
  inlet.c[kMixture] = burns() ? 1 : 0;
  inlet.c[kFuel] = inlet.c[kMixture];
  inlet.c[kSoot] = static_cast<float>(options_.burner_soot);
  const Rgba* gas = gas_.data();
  const float* particles = burns() ? particles_.data() : nullptr;
  work_.cells(grid_, Transport{gas, gas, gas_scratch_.data(), particles, particles, scratch_.data(), faces(),
                               grid_, inlet, cells, 0.F});
  const float* between = burns() ? scratch_.data() : nullptr;
  work_.cells(grid_, Transport{gas, gas_scratch_.data(), next_gas_.data(), particles, between,
                               next_particles_.data(), faces(), grid_, inlet, cells, 0.5F});
  particles_.swap(next_particles_);
  gas_.swap(next_gas_);
}

void FlameSimulation::Fluid::advect(float cells) {
  advect_faces<0>(cells);
  advect_faces<1>(cells);
  advect_faces<2>(cells);
  for (int axis = 0; axis < 3; ++axis) velocity_[axis].swap(next_velocity_[axis]);
}

template <int Axis>
void FlameSimulation::Fluid::diffuse_faces(float share, const float* eddies) {
  work_.faces<Axis>(
      grid_, DiffuseFaces<Axis>{velocity_[Axis].data(), next_velocity_[Axis].data(), eddies, grid_, share});
  velocity_[Axis].swap(next_velocity_[Axis]);
}

void FlameSimulation::Fluid::diffuse(float dt) {
  const float share = static_cast<float>(options_.diffusivity) * dt / (grid_.edge * grid_.edge);
  const float* eddies = nullptr;
  if (options_.eddies > 0) {
    const auto strength = static_cast<float>(options_.eddies);
    work_.cells(grid_, EddyDiffusion{faces(), eddies_.data(), grid_, strength * strength * dt / grid_.edge});
    eddies = eddies_.data();
  }
  const float* particles = burns() ? particles_.data() : nullptr;
  work_.cells(grid_, DiffuseGas{gas_.data(), next_gas_.data(), particles, next_particles_.data(),
                                expansion_.data(), eddies, grid_, share, 1 / dt});
  particles_.swap(next_particles_);
  gas_.swap(next_gas_);
  diffuse_faces<0>(share, eddies);
  diffuse_faces<1>(share, eddies);
  diffuse_faces<2>(share, eddies);
}

void FlameSimulation::Fluid::confine(float dt) {
  work_.cells(grid_, Vorticity{faces(), gas_scratch_.data(), grid_});
  work_.cells(grid_, Confinement{gas_scratch_.data(), next_gas_.data(), grid_,
                                 static_cast<float>(options_.confinement)});
  work_.faces<0>(grid_, Accelerate<0>{next_gas_.data(), velocity_[0].data(), grid_, dt});
  work_.faces<1>(grid_, Accelerate<1>{next_gas_.data(), velocity_[1].data(), grid_, dt});
  work_.faces<2>(grid_, Accelerate<2>{next_gas_.data(), velocity_[2].data(), grid_, dt});
}

/// Float holds q no better than to 1e-7 of its largest, which can be 1e-3 of its curvature. So a solve goes
/// that far only, and what divergence the velocities then really have is the next one's right-hand side.
Status FlameSimulation::Fluid::project(FluidStats& stats) {
  constexpr int kPasses = 6;
  constexpr int kIterations = 40;
  constexpr double kReduction = 1e-3;  // of a pass
  constexpr double kWorst = 1e-3;      // that is accepted where rounding stops the descent
  const PressureEquation& equation = pressure_.equation();
  const float per_kelvin = 1 / options_.gas.air_temperature;
  work_.faces<0>(grid_, FaceCoefficients<0>{gas_.data(), grid_, equation.a.axis[0], per_kelvin});
  work_.faces<1>(grid_, FaceCoefficients<1>{gas_.data(), grid_, equation.a.axis[1], per_kelvin});
  work_.faces<2>(grid_, FaceCoefficients<2>{gas_.data(), grid_, equation.a.axis[2], per_kelvin});
  pressure_.prepare();
  double first = 0;
  double left = 1;
  for (int pass = 0;; ++pass) {
    float* b = pressure_.b();
    work_.cells(grid_,
                DivergenceError{faces(), expansion_.size() > 0 ? expansion_.data() : nullptr, grid_, b});
    const double size = std::sqrt(work_.sum(grid_, TwoProducts{b, b, b}).first);
    if (pass == 0) first = size;
    if (!(first > 0)) return {};
    const double before = left;
    left = size / first;
    if (left <= kWantedDivergence || pass == kPasses || (pass > 1 && left > 0.5 * before)) break;
    stats.iterations +=
        pressure_.solve(std::max(0.5 * kWantedDivergence / left, kReduction), kIterations).iterations;
    work_.faces<0>(grid_, SubtractGradient<0>{equation, pressure_.q(), velocity_[0].data()});
    work_.faces<1>(grid_, SubtractGradient<1>{equation, pressure_.q(), velocity_[1].data()});
    work_.faces<2>(grid_, SubtractGradient<2>{equation, pressure_.q(), velocity_[2].data()});
  }
  stats.relative_divergence = std::max(stats.relative_divergence, left);
  if (!(left <= kWorst))
    return Error{ErrorKind::not_converged, "the projection left a divergence of " + std::to_string(left),
                 "flame simulation", "Take smaller steps"};
  return {};
}

GasState FlameSimulation::Fluid::state() const {
  GasState out;
  const float edge = grid_.edge;
  const auto middle = [&](int cells) { return -0.5F * edge * static_cast<float>(cells - 1); };
  out.grid = {{middle(grid_.nx), middle(grid_.ny), 0.5F * edge}, edge, grid_.nx, grid_.ny, grid_.nz};
  const std::vector<Rgba> gas = gas_.values();
  const std::vector<float> u[3] = {velocity_[0].values(), velocity_[1].values(), velocity_[2].values()};
  const std::vector<float> heat = burns() ? heat_.values() : std::vector<float>{};
  out.temperature.reserve(out.grid.size());
  out.absorption.reserve(out.grid.size());
  out.velocity.reserve(3 * out.grid.size());
  constexpr float kGreen = 550e-9F;
  const ConstFaceFields f{{u[0].data(), u[1].data(), u[2].data()}};
  for (int k = 0; k < grid_.nz; ++k)
    for (int j = 0; j < grid_.ny; ++j)
      for (int i = 0; i < grid_.nx; ++i) {
        const std::size_t c = grid_.index(i, j, k);
        const float t = gas[c].c[kTemperature];
        const FluidVelocity v = velocity_at<-1>(f, grid_, c);
        out.temperature.push_back(t);
        out.absorption.push_back(soot_absorption(soot_volume(options_.gas, t, gas[c].c[kSoot]), kGreen));
        out.velocity.insert(out.velocity.end(), {v.x, v.y, v.z});
        if (burns()) out.heat.push_back(heat[c]);
      }
  return out;
}

}  // namespace emberlock::recon
