// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "smear_sync/align/align.h"
#include "smear_sync/align/stagger.h"
#include "smear_sync/clocks/phase.h"
#include "tests/support/properties.h"
#include "tests/support/shift_register.h"

namespace emberlock::smear {
namespace {

using test::any_real;
using test::law;

const Seconds kPeriod(1 / 23.976);

Seconds any_tau() { return Seconds(any_real(0, kPeriod.value())); }

Phase known(Seconds tau) { return {PhaseState::known, wrap_positive(tau, kPeriod), microseconds(10), {}}; }

bool same(Seconds a, Seconds b) { return abs(wrap_symmetric(a - b, kPeriod)) < nanoseconds(1); }

TEST(PhaseLaws, WrapIsCircular) {
  law("whole periods change nothing", [] {
    const Seconds tau(any_real(-10, 10));
    const int turns = *rc::gen::inRange(-50, 50);
    RC_ASSERT(same(wrap_symmetric(tau + turns * kPeriod, kPeriod), tau));
    const Seconds w = wrap_symmetric(tau, kPeriod);
    RC_ASSERT(w >= -kPeriod / 2 && w < kPeriod / 2);
  });
}

TEST(PhaseLaws, ErrorIsAntisymmetricAndAddsUp) {
  law("error(a, b) = -error(b, a); error(a, b) + error(b, c) = error(a, c)", [] {
    const Phase a = known(any_tau());
    const Phase b = known(any_tau());
    const Phase c = known(any_tau());
    RC_ASSERT(same(phase_error(a, b, kPeriod), -phase_error(b, a, kPeriod)));
    RC_ASSERT(same(phase_error(a, b, kPeriod) + phase_error(b, c, kPeriod), phase_error(a, c, kPeriod)));
  });
}

TEST(PhaseLaws, PhaseInvertsTheShiftRegister) {
  law("phase_of(shift_register(tau)) is the middle of tau's row", [] {
    CcdTiming timing;
    timing.rows = *rc::gen::inRange(10, 200);
    timing.shifts = timing.rows + *rc::gen::element(0, 1, 20);
    timing.row_time = microseconds_per_row(any_real(10, 100));
    timing.frame_period = Rows(timing.shifts + any_real(0, 60)) * timing.row_time;
    timing.direction = *rc::gen::element(ReadDirection::top_first, ReadDirection::bottom_first);
    const int lamp = *rc::gen::inRange(0, timing.rows);
    const int k = *rc::gen::inRange(0, timing.shifts);
    const auto dot = test::shift_register(timing, lamp, Rows(k + any_real(0.01, 0.99)) * timing.row_time);
    RC_PRE(dot.has_value());
    const Phase phase = phase_of(test::reading_of(*dot, lamp), timing, microseconds(1));
    RC_ASSERT(abs(phase.tau - Rows(k + 0.5) * timing.row_time) < nanoseconds(1));
  });
}

TEST(PhaseLaws, EqualDistancesOnOppositeSidesAreNotInStep) {
  law("unless the distance is half of the shifts", [] {
    CcdTiming timing;
    timing.shifts = *rc::gen::element(720, 740, 772);
    const int distance = *rc::gen::inRange(10, 300);
    const Phase above = phase_of(test::reading_of(360 - distance, 360), timing, microseconds(1));
    const Phase below = phase_of(test::reading_of(360 + distance, 360), timing, microseconds(1));
    const Rows expected(
        std::min<double>(timing.shifts - 2 * distance,
                         (timing.frame_period / timing.row_time).value() - timing.shifts + 2 * distance));
    RC_ASSERT(
        std::abs((abs(phase_error(above, below, timing.frame_period)) / timing.row_time - expected).value()) <
        1e-6);
  });
}

TEST(PhaseLaws, CombineTurnsWithTheCircle) {
  law("a shift of all samples shifts the result", [] {
    const auto offsets = *rc::gen::container<std::vector<int>>(7, rc::gen::inRange(-50, 50));
    const Seconds centre = any_tau();
    const Seconds shift = any_tau();
    const auto mean_at = [&](Seconds where) {
      std::vector<PhaseSample> samples;
      samples.reserve(offsets.size());
      for (const int o : offsets) samples.push_back({{}, known(where + microseconds(o * 0.5))});
      return combine(samples, {}, {});
    };
    const Phase here = mean_at(centre);
    const Phase there = mean_at(centre + shift);
    RC_ASSERT(here.state == PhaseState::known);
    RC_ASSERT(same(here.tau + shift, there.tau));
  });
}

AlignRound any_round(std::size_t cameras) {
  AlignRound round;
  for (std::size_t i = 0; i < cameras; ++i)
    round.cameras.push_back({known(any_tau()), TimePoint{} + any_tau()});
  return round;
}

std::vector<AlignCamera> rig(std::size_t n) {
  std::vector<AlignCamera> cameras(n);
  for (std::size_t i = 0; i < n; ++i) cameras[i].id = std::to_string(i);
  return cameras;
}

AlignOptions any_options() {
  AlignOptions options;
  options.policy = *rc::gen::element(AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed);
  return options;
}

TEST(AlignLaws, ACommonShiftOfTheStrobeChangesNoDecision) {
  law("the same cameras, reference and errors", [] {
    AlignRound round = any_round(6);
    const AlignOptions options = any_options();
    const auto before = align_step({}, round, rig(6), options).decision;
    const Seconds shift = any_tau();
    for (CameraView& view : round.cameras) view.phase = known(view.phase.tau + shift);
    const auto after = align_step({}, round, rig(6), options).decision;
    RC_ASSERT(before.reference == after.reference);
    for (std::size_t i = 0; i < 6; ++i) {
      RC_ASSERT(before.cameras[i].reset == after.cameras[i].reset);
      RC_ASSERT(same(*before.cameras[i].error, *after.cameras[i].error));
    }
  });
}

TEST(AlignLaws, StaggeredCamerasAreAlignedAsOthersThatReadAtOnce) {
  law("offsets taken out of the phases beforehand change no decision", [] {
    const AlignRound round = any_round(6);
    const AlignOptions options = any_options();
    std::vector<AlignCamera> cameras = rig(6);
    const std::vector<Seconds> offsets = staggered_offsets(6, options.period);
    const Seconds turn = any_tau();  // all offsets more: the target less, nothing else
    AlignRound own = round;
    for (std::size_t i = 0; i < 6; ++i) {
      cameras[i].offset = wrap_positive(offsets[i] + turn, options.period);
      if (own.cameras[i].phase.state == PhaseState::known)
        own.cameras[i].phase.tau = wrap_positive(own.cameras[i].phase.tau + offsets[i], options.period);
    }
    const auto staggered = align_step({}, round, cameras, options).decision;
    const auto at_once = align_step({}, own, rig(6), options).decision;
    RC_ASSERT(staggered.verdict == at_once.verdict);
    for (std::size_t i = 0; i < 6; ++i) {
      RC_ASSERT(staggered.cameras[i].reset == at_once.cameras[i].reset);
      RC_ASSERT(staggered.cameras[i].reason == at_once.cameras[i].reason);
      RC_ASSERT(same(*staggered.cameras[i].error, *at_once.cameras[i].error));
    }
  });
}

TEST(AlignLaws, OnlyCamerasOutOfToleranceAreReset) {
  law("and somebody is reset exactly when not aligned", [] {
    AlignOptions options = any_options();
    options.strobe_step = Seconds(0);  // cameras in tolerance would be looked at once more
    const auto decision = align_step({}, any_round(5), rig(5), options).decision;
    bool any_reset = false;
    for (const CameraDecision& camera : decision.cameras) {
      any_reset |= camera.reset;
      if (camera.reset) RC_ASSERT(abs(*camera.error) > options.tolerance.in_time(options.row_time));
      RC_ASSERT(camera.reason.cause != CameraCause::none);
    }
    RC_ASSERT(any_reset == (decision.verdict == AlignVerdict::go_on));
    // The target lies within tolerance of a camera.
    const Seconds tolerance = options.tolerance.in_time(options.row_time);
    RC_ASSERT(*decision.worst_pair + tolerance >= abs(*decision.cameras[0].error));
  });
}

TEST(AlignLaws, TheStepIsAPureFunction) {
  law("equal inputs, equal decisions", [] {
    const AlignRound round = any_round(5);
    const AlignOptions options = any_options();
    const auto a = align_step({}, round, rig(5), options).decision;
    const auto b = align_step({}, round, rig(5), options).decision;
    for (std::size_t i = 0; i < 5; ++i) {
      RC_ASSERT(a.cameras[i].reason == b.cameras[i].reason);
      RC_ASSERT(a.cameras[i].moment == b.cameras[i].moment);
    }
  });
}

}  // namespace
}  // namespace emberlock::smear
