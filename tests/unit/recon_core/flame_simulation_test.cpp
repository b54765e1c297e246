// SPDX-License-Identifier: Apache-2.0
#include "recon/synthetic/flame_simulation.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/devices.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(FlameSimulationTest);
ON_EACH_DEVICE(FlameSimulationTestSlow);

constexpr FlamePreset kAll[] = {FlamePreset::candle, FlamePreset::pool_fire, FlamePreset::torch,
                                FlamePreset::two_plumes, FlamePreset::smoke};

FlameSimulationOptions small(FlamePreset preset, int threads = 2) {
  FlameSimulationOptions o = flame_preset(preset, 16);
  o.compute.threads = threads;
  return o;
}

/// About as long as gas takes for a few cells.
Seconds short_time(const FlameSimulationOptions& o) { return Seconds(std::sqrt(2 * o.edge.value() / 9.81)); }

void expect_sound(const GasState& gas, const FlameSimulationOptions& o) {
  const std::size_t size = gas.grid.size();
  ASSERT_EQ(gas.temperature.size(), size);
  ASSERT_EQ(gas.absorption.size(), size);
  ASSERT_EQ(gas.velocity.size(), 3 * size);
  for (const float t : gas.temperature) {
    ASSERT_GE(t, o.gas.air_temperature - 0.01F);
    ASSERT_LE(t, 2500);
  }
  for (const float a : gas.absorption) ASSERT_TRUE(a >= 0 && std::isfinite(a));
  for (const float v : gas.velocity) ASSERT_TRUE(std::isfinite(v));
  for (const float h : gas.heat) ASSERT_TRUE(h >= 0 && std::isfinite(h));
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}
bool same_bits(const GasState& a, const GasState& b) {
  return same_bits(a.temperature, b.temperature) && same_bits(a.absorption, b.absorption) &&
         same_bits(a.velocity, b.velocity) && same_bits(a.heat, b.heat);
}

FlameSimulation after_steps(const FlameSimulationOptions& o, int steps) {
  auto flame = value_of(FlameSimulation::make(o));
  for (int i = 0; i < steps; ++i) value_of(flame.step(short_time(o)));
  return flame;
}

TEST_P(FlameSimulationTest, EveryPresetRunsAndLeavesNoDivergence) {
  for (const FlamePreset preset : kAll) {
    SCOPED_TRACE(name(preset));
    const FlameSimulationOptions o = small(preset);
    auto flame = value_of(FlameSimulation::make(o));
    for (int i = 0; i < 5; ++i) {
      const auto stats = value_of(flame.step(short_time(o)));
      EXPECT_LE(stats.relative_divergence, 1e-5);
      EXPECT_LE(stats.cfl, o.cfl);
      EXPECT_GT(stats.iterations, 0);
    }
    const GasState gas = flame.state();
    expect_sound(gas, o);
    EXPECT_GT(*std::max_element(gas.temperature.begin(), gas.temperature.end()), 400);
    EXPECT_EQ(gas.heat.empty(), preset == FlamePreset::smoke);
    EXPECT_GT(*std::max_element(gas.velocity.begin(), gas.velocity.end()), 0);
  }
}

TEST_P(FlameSimulationTest, SameBitsOnAnyNumberOfThreads) {
  for (const FlamePreset preset : {FlamePreset::torch, FlamePreset::candle, FlamePreset::smoke}) {
    GasState first;
    for (const int threads : {1, 2, 5}) {
      const FlameSimulation flame = after_steps(small(preset, threads), 3);
      if (threads == 1)
        first = flame.state();
      else
        EXPECT_TRUE(same_bits(flame.state(), first)) << name(preset) << ", " << threads << " threads";
    }
  }
}

TEST(FlameSimulationDevices, OthersMeetTheCpu) {
  for (const Device device : other_devices())
    for (const FlamePreset preset : kAll) {
      FlameSimulationOptions o = small(preset, 1);
      GasState gas[2];
      for (int run = 0; run < 2; ++run) {
        o.compute.device = run == 0 ? Device(Device::cpu) : device;
        gas[run] = after_steps(o, 3).state();
      }
      double worst = 0;
      for (std::size_t i = 0; i < gas[0].temperature.size(); ++i)
        worst = std::max(worst, std::abs(static_cast<double>(gas[0].temperature[i] - gas[1].temperature[i])));
      EXPECT_LE(worst, 1) << name(preset) << ", kelvin";
    }
}

/// 0.10 m/s of vapour at 600 K out of a wick of 3 mm radius, 44.6 MJ/kg: little of it leaves as soot.
TEST_P(FlameSimulationTestSlow, ACandleBurnsWhatItsWickGives) {
  FlameSimulationOptions o = flame_preset(FlamePreset::candle, 16);
  o.compute.threads = 2;
  auto flame = value_of(FlameSimulation::make(o));
  FluidStats stats;
  for (int i = 0; i < 10; ++i) stats = value_of(flame.step(Seconds(0.04)));
  const double given = 0.10 * std::numbers::pi * 0.003 * 0.003 * 1.2 * 293 / 600 * 44.6e6;
  EXPECT_NEAR(stats.heat_release, given, 0.05 * given);
  EXPECT_GT(stats.hottest.value(), 1500);
}

TEST_P(FlameSimulationTest, WithoutFuelAirStaysStill) {
  FlameSimulationOptions o = small(FlamePreset::pool_fire);
  o.burners.clear();
  auto flame = value_of(FlameSimulation::make(o));
  const auto stats = value_of(flame.step(Seconds(0.1)));
  EXPECT_EQ(stats.heat_release, 0);
  EXPECT_EQ(stats.fastest, 0);
  for (const float v : flame.state().velocity) ASSERT_EQ(v, 0);
  o.burners = {Burner{Meters(0), Meters(0), Meters(0.1), 0}};
  EXPECT_TRUE(FlameSimulation::make(o)->step(Seconds(0.1)).ok());
}

TEST_P(FlameSimulationTest, NoTimeChangesNothing) {
  const FlameSimulationOptions o = small(FlamePreset::torch);
  FlameSimulation flame = after_steps(o, 1);
  const GasState before = flame.state();
  EXPECT_EQ(value_of(flame.step(Seconds(0))).substeps, 0);
  EXPECT_TRUE(same_bits(flame.state(), before));
}

TEST_P(FlameSimulationTest, AStepFarAboveItsLimitIsRefused) {
  FlameSimulationOptions o = small(FlamePreset::torch);
  o.substeps = 10;
  auto flame = FlameSimulation::make(o);
  ASSERT_TRUE(flame.ok() && flame->step(Seconds(0.002)).ok());
  const GasState before = flame->state();
  EXPECT_EQ(flame->step(Seconds(1000)).error().kind, ErrorKind::refused);
  EXPECT_TRUE(same_bits(flame->state(), before));
}

TEST_P(FlameSimulationTest, BadTimesAreRefused) {
  auto flame = value_of(FlameSimulation::make(small(FlamePreset::smoke)));
  for (const double t : {-1.0, std::numeric_limits<double>::infinity(), std::nan("")})
    EXPECT_EQ(flame.step(Seconds(t)).error().kind, ErrorKind::bad_input);
}

TEST_P(FlameSimulationTest, TinyAndHugeDomains) {
  for (const FlamePreset preset : {FlamePreset::pool_fire, FlamePreset::smoke})
    for (const double edge : {1e-5, 1e-3, 1.0, 100.0}) {
      SCOPED_TRACE(edge);
      FlameSimulationOptions o = small(preset);
      o.edge = Meters(edge);
      o.burners = {Burner{Meters(0), Meters(0), Meters(3 * edge), 0.02}};
      auto flame = value_of(FlameSimulation::make(o));
      for (int i = 0; i < 3; ++i)
        value_of(flame.step(Seconds(std::min(0.5 * edge / 0.02, short_time(o).value()))));
      expect_sound(flame.state(), o);
    }
}

TEST_P(FlameSimulationTestSlow, GoesOnOnAGridTwiceAsFine) {
  for (const FlamePreset preset : {FlamePreset::torch, FlamePreset::smoke}) {
    const FlameSimulationOptions o = small(preset);
    FlameSimulation flame = after_steps(o, 8);
    auto fine = value_of(flame.finer());
    EXPECT_EQ(fine.time(), flame.time());
    EXPECT_EQ(fine.options().nz, 2 * o.nz);
    EXPECT_EQ(fine.options().edge, o.edge / 2);
    const GasState before = flame.state();
    const GasState after = fine.state();
    expect_sound(after, fine.options());
    const auto mean = [](const std::vector<float>& values) {
      double sum = 0;
      for (const float v : values) sum += static_cast<double>(v);
      return sum / static_cast<double>(values.size());
    };
    EXPECT_NEAR(mean(after.temperature) - 293, mean(before.temperature) - 293,
                0.05 * (mean(before.temperature) - 293));
    EXPECT_NEAR(mean(after.absorption), mean(before.absorption), 0.25 * mean(before.absorption))
        << "the soot is in a cell or two";
    // A coarse cell's middle is a corner of eight finer ones, whose mean is near its value.
    const std::size_t c = before.grid.index(7, 7, 3);
    double eight = 0;
    for (int corner = 0; corner < 8; ++corner)
      eight += static_cast<double>(after.temperature[after.grid.index(
                   14 + (corner & 1), 14 + (corner >> 1 & 1), 6 + (corner >> 2 & 1))]) /
               8;
    EXPECT_NEAR(eight, static_cast<double>(before.temperature[c]),
                0.3 * static_cast<double>(before.temperature[c]));
    const auto stats = value_of(fine.step(short_time(fine.options())));
    EXPECT_LE(stats.relative_divergence, 1e-5);
    expect_sound(fine.state(), fine.options());
  }
  FlameSimulationOptions large = small(FlamePreset::smoke);
  large.nz = 520;
  const auto largest = value_of(FlameSimulation::make(large));
  ASSERT_FALSE(largest.finer().ok()) << "1040 cells";
}

TEST(FlameSimulationOptionsTest, AreRefusedOutOfRange) {
  const auto refused = [](auto change) {
    FlameSimulationOptions o = small(FlamePreset::torch);
    change(o);
    const auto flame = FlameSimulation::make(o);
    return !flame.ok() && flame.error().kind == ErrorKind::bad_input;
  };
  using O = FlameSimulationOptions;
  EXPECT_TRUE(refused([](O& o) { o.nx = 20; }));
  EXPECT_TRUE(refused([](O& o) { o.nz = 0; }));
  EXPECT_TRUE(refused([](O& o) { o.edge = Meters(0); }));
  EXPECT_TRUE(refused([](O& o) { o.edge = Meters(std::nan("")); }));
  EXPECT_TRUE(refused([](O& o) { o.burners.front().speed = -1; }));
  EXPECT_TRUE(refused([](O& o) { o.burner_soot = 2; }));
  EXPECT_TRUE(refused([](O& o) { o.confinement = -1; }));
  EXPECT_TRUE(refused([](O& o) { o.diffusivity = -1; }));
  EXPECT_TRUE(refused([](O& o) { o.eddies = 1; }));
  EXPECT_TRUE(refused([](O& o) { o.cfl = 5; }));
  EXPECT_TRUE(refused([](O& o) { o.substeps = 0; }));
  EXPECT_TRUE(refused([](O& o) { o.gas.heat_capacity = 0; }));
}

TEST(FlamePresetTest, NamesAreReadBack) {
  for (const FlamePreset preset : kAll) EXPECT_EQ(value_of(parse_flame_preset(name(preset))), preset);
  EXPECT_THAT(parse_flame_preset("bonfire"), FailsWith("candle"));
}

}  // namespace
}  // namespace emberlock::recon
