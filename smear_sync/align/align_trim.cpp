// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_trim.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

namespace emberlock::smear {
namespace {

constexpr double kLongestWay = 3600;  // s, no plan goes further
constexpr int kHalvings = 50;
/// The target stands still from when the last camera has so many steps to go.
constexpr double kNearSteps = 2;
/// Nobody is reset for what a plan says before rates are known to this part of the trims' range.
constexpr double kKnownRate = 0.03;
/// Rounds that trims take to stop cleanly.
constexpr double kSettlingRounds = 4;
/// What is left for trims, however late it is: this part of the time. So nobody is reset for a short way.
constexpr double kLeastPart = 0.25;

/// What the servo is told in this round, the same for every camera.
struct Timing {
  TimePoint at;      ///< the round's instant
  Seconds interval;  ///< between two rounds
  /// When an order of now comes into force.
  [[nodiscard]] TimePoint in_force(const FrameRateTrim& trim) const {
    return at + interval / 2 + trim.latency;
  }
};

/// A camera's free course: seconds of tau beside the middle of them all, parts of one.
struct Course {
  double tau;
  double rate;
  double range;  ///< of the trim, one step kept back for the servo
};

/// Phases that all cameras can have reached after t seconds.
struct Common {
  double from, to;
};
Common common(const std::vector<Course>& courses, double t) {
  Common c{-INFINITY, INFINITY};
  for (const Course& k : courses) {
    c.from = std::max(c.from, k.tau + (k.rate - k.range) * t);
    c.to = std::min(c.to, k.tau + (k.rate + k.range) * t);
  }
  return c;
}

/// The soonest time after which there is one.
double soonest(const std::vector<Course>& courses) {
  double late = kLongestWay;
  double early = 0;
  for (int i = 0; i < kHalvings; ++i) {
    const double t = (early + late) / 2;
    const Common c = common(courses, t);
    (c.from <= c.to ? late : early) = t;
  }
  return late;
}

/// The time that is left for trims to meet.
double time_left(const AlignState& state, const Timing& timing, const AlignOptions& options) {
  const Seconds left = *state.trimming + options.trim_time - timing.at - kSettlingRounds * timing.interval;
  return std::max(left, kLeastPart * options.trim_time).value();
}

/// Cameras that keep the others from meeting within t seconds: of the two that are farthest apart then, the
/// one without which the others come nearer, and so on. Those that can't be brought by a reset stay.
std::vector<std::size_t> latecomers(std::vector<Course> courses, const std::vector<AlignCamera>& cameras,
                                    double t) {
  std::vector<std::size_t> late;
  std::vector<std::size_t> index(courses.size());
  std::iota(index.begin(), index.end(), std::size_t{0});
  while (courses.size() > 1) {
    const Common all = common(courses, t);
    if (all.from <= all.to) break;
    std::optional<std::size_t> outermost;
    double gap = all.from - all.to;
    for (std::size_t i = 0; i < courses.size(); ++i) {
      if (cameras[index[i]].method != ShutterReset::on_command) continue;
      std::vector<Course> others = courses;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      const Common rest = common(others, t);
      if (rest.from - rest.to >= gap) continue;
      gap = rest.from - rest.to;
      outermost = i;
    }
    if (!outermost) break;
    late.push_back(index[*outermost]);
    courses.erase(courses.begin() + static_cast<std::ptrdiff_t>(*outermost));
    index.erase(index.begin() + static_cast<std::ptrdiff_t>(*outermost));
  }
  return late;
}

struct Plan {
  AlignTarget target;
  std::vector<std::size_t> late;  ///< cameras that are reset rather than waited for
};

/// The target that the last camera reaches soonest, latecomers aside; its rate is the middle one, which holds
/// with the least trims. Settled when that is soon.
Plan plan(const AlignState& state, const Timing& timing, const std::vector<AlignCamera>& cameras,
          const AlignOptions& options, Seconds middle) {
  const TrackOptions track = track_options(options);
  std::vector<Course> courses;
  double slowest = INFINITY;
  double fastest = -INFINITY;
  bool foreseeable = true;
  TimePoint begin = timing.at;
  for (const AlignCamera& camera : cameras) begin = std::max(begin, timing.in_force(*camera.trim));
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Drift d = state.cameras[i].phase.at(begin, track);
    const double rate = d.rate.value() * 1e-6;
    courses.push_back({wrap_symmetric(d.tau - middle, options.period).value(), rate,
                       (cameras[i].trim->range - cameras[i].trim->step).value() * 1e-6});
    foreseeable = foreseeable && d.rate_sigma < kKnownRate * cameras[i].trim->range;
    slowest = std::min(slowest, rate);
    fastest = std::max(fastest, rate);
  }
  std::vector<std::size_t> late;
  if (foreseeable) late = latecomers(courses, cameras, time_left(state, timing, options));
  std::vector<std::size_t> leave = late;
  std::sort(leave.rbegin(), leave.rend());
  for (const std::size_t i : leave) courses.erase(courses.begin() + static_cast<std::ptrdiff_t>(i));
  const double t = soonest(courses);
  const Common meeting = common(courses, t);
  const double rate = (slowest + fastest) / 2;
  const Seconds tau = middle + Seconds((meeting.from + meeting.to) / 2 - rate * t);
  return {{begin, wrap_positive(tau, options.period), PartsPerMillion(rate * 1e6),
           late.empty() && t <= kNearSteps * timing.interval.value()},
          std::move(late)};
}

CameraReason reason_of(const ServoStep& step) {
  switch (step.state) {
    case ServoState::slewing:
      return {.cause = CameraCause::slewing, .trim = step.trim};
    case ServoState::settling:
      return {.cause = CameraCause::settling, .trim = step.trim};
    case ServoState::locked:
      break;
  }
  return {.cause = CameraCause::locked, .trim = step.trim};
}

}  // namespace

Seconds target_at(const AlignTarget& target, TimePoint at, Seconds period) {
  return wrap_positive(target.tau + (at - target.at) * (target.rate.value() * 1e-6), period);
}

bool trim_rates(AlignState& state, AlignDecision& decision, const AlignRound& round,
                const std::vector<AlignCamera>& cameras, const AlignOptions& options) {
  const Timing timing{round.at, state.last_round ? round.at - *state.last_round : options.round_time};
  const TrackOptions track = track_options(options);
  if (!state.target || !state.target->settled) {
    // The rounding is that of recordings, which replay to the last digit.
    const Seconds delayed = wrap_positive(*decision.target + round.strobe_phase, options.period);
    const Seconds middle = wrap_positive(delayed - round.strobe_phase, options.period);
    if (!state.trimming) state.trimming = round.at;
    Plan planned = plan(state, timing, cameras, options, middle);
    state.target = planned.target;
    for (const std::size_t i : planned.late) decision.cameras[i].reset = true;
  }
  const AlignTarget& target = *state.target;
  decision.target = target_at(target, round.at, options.period);
  const Seconds tolerance = options.tolerance.in_time(options.row_time);
  bool all_in = true;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const PhaseTrack& phase = state.cameras[i].phase;
    const Drift now = phase.at(round.at, track);
    camera.error = wrap_symmetric(now.tau - target_at(target, round.at, options.period), options.period);
    const TimePoint from = timing.in_force(*cameras[i].trim);
    const Drift then = phase.at(from, track);
    const Seconds to_go = wrap_symmetric(target_at(target, from, options.period) - then.tau, options.period);
    const PartsPerMillion holding = target.rate - now.rate;
    const PartsPerMillion ordered = phase.trim(from);
    const ServoStep step = rate_servo({to_go, then.tau_sigma, holding}, *cameras[i].trim, timing.interval);
    if (camera.reset) {
      camera.reason = {CameraCause::late};
      all_in = false;
      continue;
    }
    camera.servo = step.state;
    if (abs(step.trim - ordered) > cameras[i].trim->step / 2) camera.trim = step.trim;
    camera.reason = reason_of(step);
    const bool in =
        abs(*camera.error) + 2 * now.tau_sigma <= tolerance && abs(to_go) + 2 * now.tau_sigma <= tolerance;
    all_in = all_in && in;
  }
  if (!all_in) return false;
  state.trimming.reset();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const PartsPerMillion holding = target.rate - state.cameras[i].phase.at(round.at, track).rate;
    const ServoStep step = rate_servo({Seconds(0), Seconds(1), holding}, *cameras[i].trim, timing.interval);
    camera.servo = ServoState::locked;
    camera.trim = step.trim;
    camera.reason = reason_of({step.trim, ServoState::locked});
  }
  return true;
}

}  // namespace emberlock::smear
