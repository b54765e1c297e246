// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "drivers/virtual/virtual_dial.h"
#include "tests/support/small_rig.h"

namespace emberlock::test {

/// A small rig whose strobe has a dial, and somebody at it.
struct DialBench : SmallBench {
  explicit DialBench(drivers::VirtualRigOptions setup, PartsPerMillion error = PartsPerMillion(0),
                     StrobeDial dial = {})
      : SmallBench(with_dial(std::move(setup), error, dial)) {
    options.align.dial = dial;
    for (smear::CcdTiming& timing : options.timing) timing.row_time = microseconds_per_row(150);
  }

  static drivers::VirtualRigOptions with_dial(drivers::VirtualRigOptions setup, PartsPerMillion error,
                                              StrobeDial dial) {
    setup.strobe.dial = drivers::VirtualDialOptions{.dial = dial, .error = error};
    return setup;
  }

  /// Does what is said: sets the dial to what is asked for, once the strobe flashes turns it by what it is
  /// off.
  void obey(const smear::DialAdvice& advice) {
    drivers::VirtualDial& dial = *rig->dial();
    if (!advice.act) return;
    ++turns;
    const bool seen = dial.shown() > Hertz(0) && advice.measured;
    dial.turn(seen ? dial.shown() + advice.set - *advice.measured : advice.set);
  }
  /// Runs an alignment with somebody who obeys.
  Result<rig::AlignRunResult> run(std::function<void(const rig::AlignRoundReport&)> seen = {}) {
    int rounds = 0;
    return rig::run_align(
        align, options,
        [this, &rounds, seen = std::move(seen)](const rig::AlignRoundReport& report) {
          ++rounds;
          if (seen) seen(report);
          if (report.decision.dial) obey(*report.decision.dial);
        },
        {}, [&rounds] { return rounds >= kMostRounds; });
  }

  static constexpr int kMostRounds = 500;
  int turns = 0;
};

}  // namespace emberlock::test
