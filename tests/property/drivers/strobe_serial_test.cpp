// SPDX-License-Identifier: Apache-2.0
// Laws of strobes on a serial line: what is set reads back within the device's steps, and no damage to the
// line ever makes a driver believe what isn't so.
#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/properties.h"
#include "tests/support/strobe_bench.h"

namespace emberlock::drivers {
namespace {

using test::any_int;
using test::any_real;
using test::Fault;
using test::StrobeBench;

struct Steps {
  double slowest, narrowest;
  double rate;          // Hz, at `r`
  double phase, width;  // s
};
Steps steps(StrobeDialect dialect, double r) {
  switch (dialect) {
    case StrobeDialect::emberlock:
      return {0.5, 1e-5, r * r * 0.5e-9, 500e-9, 500e-9};
    case StrobeDialect::scpi:
      return {0.5, 1e-6, 1e-6, 1e-3 / 360 / r, 1e-9};
    case StrobeDialect::siglent_bswv:
      return {0.5, 1e-6, 1e-6, 1e-8, 1e-8};
    case StrobeDialect::gardasoft_rt:
      return {1.1, 1e-5, r * r * 10e-6, 10e-6, 1e-6};
    case StrobeDialect::schott_cv_ls:
      return {6.5, 1e-3 / r, 0.5, 0, 1.1e-3 / r};
  }
  return {};
}

StrobeSettings any_settings(StrobeDialect dialect) {
  StrobeSettings s;
  s.output = *rc::gen::element(StrobeOutput::off, StrobeOutput::flashing);
  // As many slow ones as fast ones.
  s.rate = Hertz(std::exp(any_real(std::log(steps(dialect, 1).slowest), std::log(333.0))));
  const Steps step = steps(dialect, s.rate.value());
  const double longest = 0.9 / s.rate.value();
  s.width = Seconds(std::exp(any_real(std::log(step.narrowest), std::log(longest))));
  if (dialect != StrobeDialect::schott_cv_ls)
    s.phase = Seconds(any_real(0, std::min(0.99 / s.rate.value(), 0.9)));
  if (dialect == StrobeDialect::emberlock) {
    s.code.resize(static_cast<std::size_t>(any_int(0, 600)));
    for (auto&& bit : s.code) bit = any_int(0, 2) == 1;
  }
  return s;
}

void expect_within_steps(StrobeDialect dialect, const StrobeSettings& told, const StrobeSettings& asked) {
  const Steps step = steps(dialect, asked.rate.value());
  RC_ASSERT(told.output == asked.output);
  RC_ASSERT(told.code == asked.code);
  // A Gardasoft that is dark keeps the period it had.
  if (dialect == StrobeDialect::gardasoft_rt && asked.output == StrobeOutput::off) return;
  RC_ASSERT(std::abs((told.rate - asked.rate).value()) <= step.rate);
  RC_ASSERT(std::abs((told.width - asked.width).value()) <= step.width);
  const Seconds off = wrap_symmetric(told.phase - asked.phase, period(told.rate));
  RC_ASSERT(std::abs(off.value()) <= step.phase + 1e-12);
}

RC_GTEST_PROP(StrobeSerialLaws, SettingsReadBackWithinTheDevicesSteps, ()) {
  const StrobeDialect dialect = *rc::gen::elementOf(test::kAllDialects);
  StrobeBench bench(dialect);
  for (int i = 0; i < 3; ++i) {
    const StrobeSettings asked = any_settings(dialect);
    const Status applied = bench.strobe.apply(asked);
    if (!applied.ok()) RC_FAIL(applied.error().message());
    expect_within_steps(dialect, bench.strobe.read_back().value(), asked);
  }
}

RC_GTEST_PROP(StrobeSerialLaws, WhateverTheLineLosesOrBreaksWhatIsToldIsSo, ()) {
  const StrobeDialect dialect = *rc::gen::elementOf(test::kAllDialects);
  StrobeBench bench(dialect);
  StrobeSettings asked = any_settings(dialect);
  asked.output = StrobeOutput::flashing;
  RC_ASSERT(bench.strobe.apply(asked).ok());
  for (int i = 0; i < 3; ++i) {
    for (int f = any_int(0, 8); f > 0; --f) {
      // A flipped bit can turn one number into another where there is no checksum: not of these.
      bench.faults.push_back(*rc::gen::element(Fault::none, Fault::none, Fault::silent, Fault::garbled,
                                               Fault::truncated, Fault::late, Fault::chatter));
    }
    if (dialect == StrobeDialect::emberlock)
      bench.faults.insert(bench.faults.end(), {Fault::flipped, Fault::renumbered});
    const double begin = bench.seconds();
    const auto told = bench.strobe.read_back();
    RC_ASSERT(bench.seconds() - begin < 4.1);
    if (told.ok()) expect_within_steps(dialect, *told, asked);
  }
  bench.faults.clear();
  expect_within_steps(dialect, bench.strobe.read_back().value(), asked);
}

}  // namespace
}  // namespace emberlock::drivers
