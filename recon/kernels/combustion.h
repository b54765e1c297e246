// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "recon/kernels/fluid_grid.h"

namespace emberlock::recon {

// What burns, glows and smokes in a cell. Gas of one molar mass, so that density is inverse to temperature,
// and of one heat capacity. Lanes of a cell's state: temperature, K; mixture fraction Z (mass that came from
// the burner); fuel F (mass fraction, at most Z); soot (mass fraction). Beside it soot particles, 1e15 per
// kg.

enum GasLane { kTemperature = 0, kMixture = 1, kFuel = 2, kSoot = 3 };

/// SI units. Defaults: a heavy hydrocarbon (heptane) in air.
struct GasProperties {
  float air_temperature = 293;         ///< K, outside
  float air_density = 1.2F;            ///< kg/m^3, outside
  float heat_capacity = 1400;          ///< J/(kg K), the mean from air to flame
  float heat_of_combustion = 44.6e6F;  ///< J per kg of fuel
  float oxygen_per_fuel = 3.52F;       ///< kg
  float burner_temperature = 350;      ///< K, of what comes out of the burner
  float mixing_time = 0.01F;           ///< s: oxygen and fuel of a cell burn within about this time
  float precursor_share =
      0.05F;  ///< kmol of what soot grows from (as acetylene) per kmol of hot fuel of 26 kg
};

constexpr float kAirOxygen = 0.232F;              // mass fraction
constexpr float kSootDensity = 2000.F;            // kg/m^3
constexpr float kStefanBoltzmann = 5.670374e-8F;  // W/(m^2 K^4)

/// Volume fraction of soot.
HOST_DEVICE inline float soot_volume(const GasProperties& p, float temperature, float soot) {
  return p.air_density * p.air_temperature / temperature * soot / kSootDensity;
}

/// Absorption coefficient of soot, 1/m, at a wavelength in metres: 6 pi E(m) fv / wavelength in the Rayleigh
/// limit, with E(m) = 0.26 for m = 1.57 - 0.56 i (Smyth and Shaddix 1996).
HOST_DEVICE inline float soot_absorption(float volume_fraction, float wavelength) {
  return 18.8495559F * 0.26F * volume_fraction / wavelength;
}

/// How fast soot comes and goes, after Leung, Lindstedt and Jones 1991 ("A simplified reaction mechanism for
/// soot formation in nonpremixed flames"), with their constants: nucleation and growth from acetylene,
/// oxidation by O2, coagulation. Simplified: acetylene is a fixed share of the fuel that is hot.
struct SootKinetics {
  float nucleation, growth;  ///< of mass, kg/(m^3 s)
  float oxidation;           ///< kg/(m^3 s)
  float births;              ///< 1e15 particles / (m^3 s)
  float coagulation;         ///< m^3 / (1e15 s)

  /// T in K; precursor and oxygen in kmol/m^3; soot mass m in kg/m^3 and its particles n in 1e15/m^3.
  HOST_DEVICE static SootKinetics at(float t, float precursor, float oxygen, float m, float n) {
    constexpr float kPi = 3.14159265F;
    SootKinetics k{};
    const float nucleated = 1e4F * std::exp(-21100.F / t) * precursor;
    k.nucleation = 24.F * nucleated;
    k.births = 2.F / 100.F * 6.022e11F * nucleated;
    if (!(n > 0) || !(m > 0)) return k;
    const float diameter = std::cbrt(6.F * m / (kPi * kSootDensity * n)) * 1e-5F;
    const float surface = kPi * diameter * diameter * n * 1e15F;
    k.growth = 24.F * 6e3F * std::exp(-12100.F / t) * precursor * std::sqrt(surface);
    k.oxidation = 12.F * 1e4F * std::sqrt(t) * std::exp(-19680.F / t) * oxygen * surface;
    k.coagulation = 2e15F * 9.F * std::sqrt(diameter * 6.F * 1.380649e-23F * t / kSootDensity);
    return k;
  }
};

/// One cell burns for a time: mixing-limited combustion in one step (fuel and oxygen that are in a cell
/// burn, Magnussen and Hjertager 1976 with a fixed mixing time), soot, and radiation that leaves (optically
/// thin: soot's Planck mean, 3.83 C fv T / C2 where it absorbs C fv / wavelength, and 1.8 / m for the
/// products of stoichiometric burning).
struct Burn {
  GasProperties gas;
  Rgba* state = nullptr;
  float* particles = nullptr;
  float* expansion = nullptr;  ///< 1/s: the divergence that heat asks for is added
  float* heat = nullptr;       ///< out, W/m^3 released by combustion
  FluidGrid grid;
  float dt = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    Rgba s = state[c];
    heat[c] = 0;
    if (s.c[kMixture] < 1e-6F && s.c[kTemperature] < gas.air_temperature + 1) return;  // air
    const float before = s.c[kTemperature];
    const float density = gas.air_density * gas.air_temperature / before;
    float z = clamp_between(s.c[kMixture], 0.F, 1.F);
    float fuel = clamp_between(s.c[kFuel], 0.F, z);
    const float oxygen = most_of(0.F, kAirOxygen * (1 - z) - gas.oxygen_per_fuel * (z - fuel));
    const float burnt = least_of(fuel, oxygen / gas.oxygen_per_fuel) * dt / (dt + gas.mixing_time);
    fuel -= burnt;
    const float rise = gas.heat_of_combustion / gas.heat_capacity;
    // No hotter than what burnt so far without losing heat.
    const float hottest = gas.air_temperature + rise * (z - fuel) +
                          most_of(0.F, gas.burner_temperature - gas.air_temperature) * z;
    float t = least_of(before + rise * burnt, most_of(hottest, gas.air_temperature));
    float soot = most_of(0.F, s.c[kSoot]);
    if (t > 1000) make_soot(c, density, t, fuel, oxygen - gas.oxygen_per_fuel * burnt, soot);
    t = radiate(density, t, z - fuel, soot);
    s.c[kTemperature] = t;
    s.c[kMixture] = z;
    s.c[kFuel] = fuel;
    s.c[kSoot] = soot;
    state[c] = s;
    expansion[c] += std::log(t / before) / dt;
    heat[c] = density * burnt * gas.heat_of_combustion / dt;
  }

 private:
  HOST_DEVICE void make_soot(std::size_t c, float density, float t, float& fuel, float oxygen,
                             float& soot) const {
    const float m = density * soot;
    const float n = density * most_of(0.F, particles[c]);
    const SootKinetics k =
        SootKinetics::at(t, gas.precursor_share * density * fuel / 26.F, density * oxygen / 32.F, m, n);
    const float grown = least_of((k.nucleation + k.growth) * dt, 0.5F * density * fuel);
    // Sinks are implicit, so nothing becomes negative at any time step.
    const float kept = m > 0 ? 1.F / (1.F + dt * k.oxidation / m) : 1.F;
    const float mass = (m + grown) * kept;
    constexpr float kLeast = 100 * 12 / 6.022e11F;  // kg of 1e15 particles with 100 atoms of carbon each
    const float born = (n + dt * k.births) / (1.F + dt * k.coagulation * n);
    fuel -= grown / density;
    soot = mass / density;
    particles[c] = least_of(born, mass / kLeast) / density;
  }
  [[nodiscard]] HOST_DEVICE float radiate(float density, float t, float products, float soot) const {
    const float air = gas.air_temperature;
    if (t <= air + 1) return t;
    const float stoichiometric = kAirOxygen / (kAirOxygen + gas.oxygen_per_fuel);
    const float share = least_of(1.F, most_of(0.F, products) / stoichiometric);
    constexpr float kPlanckMean = 3.83F * 18.8495559F * 0.26F / 0.01438777F;  // 1/(m K)
    const float planck_mean = kPlanckMean * soot_volume(gas, t, soot) * t + 1.8F * share;
    const float lost = 4 * kStefanBoltzmann * planck_mean * (t * t * t * t - air * air * air * air) /
                       (density * gas.heat_capacity);
    return air + (t - air) / (1 + dt * lost / (t - air));
  }
};

}  // namespace emberlock::recon
