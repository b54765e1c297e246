#include "smear_sync/align_trim.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "smear_sync/align_words.h"

namespace emberlock {
namespace {

constexpr double kLongestWay = 3600;  // s, no plan goes further
constexpr int kHalvings = 50;
/// The target stands still from when the last camera has so many steps to go.
constexpr double kNearSteps = 2;

/// What the servo is told in this round, the same for every camera.
struct Timing {
  TimePoint at;      ///< the round's instant
  Seconds interval;  ///< between two rounds
  /// When an order of now comes into force.
  [[nodiscard]] TimePoint in_force(const RateTrim& trim) const { return at + interval / 2 + trim.latency; }
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

/// The target that the last camera reaches soonest; its rate is the middle one, which holds with the least
/// trims. Settled when that is soon.
AlignTarget plan(const AlignState& state, const Timing& timing, const std::vector<AlignCamera>& cameras,
                 const AlignOptions& options, Seconds middle) {
  const TrackOptions track = track_options(options);
  std::vector<Course> courses;
  double slowest = INFINITY;
  double fastest = -INFINITY;
  TimePoint begin = timing.at;
  for (const AlignCamera& camera : cameras) begin = std::max(begin, timing.in_force(*camera.trim));
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Drift d = state.cameras[i].phase.at(begin, track);
    const double rate = d.rate.value() * 1e-6;
    courses.push_back({wrap_symmetric(d.tau - middle, options.period).value(), rate,
                       (cameras[i].trim->range - cameras[i].trim->step).value() * 1e-6});
    slowest = std::min(slowest, rate);
    fastest = std::max(fastest, rate);
  }
  const double t = soonest(courses);
  const Common meeting = common(courses, t);
  const double rate = (slowest + fastest) / 2;
  const Seconds tau = middle + Seconds((meeting.from + meeting.to) / 2 - rate * t);
  return {begin, wrap_positive(tau, options.period), PartsPerMillion(rate * 1e6),
          t <= kNearSteps * timing.interval.value()};
}

std::string words(Seconds error, const ServoStep& step, SecondsPerRow row_time) {
  std::string stands = standing(error, row_time);
  const std::string by = fmt::format(" {:+.1f} ppm", step.trim.value());
  switch (step.state) {
    case ServoState::slewing:
      return stands + ": comes at full rate, trimmed by" + by;
    case ServoState::settling:
      return stands + ": is stopped on the target, trimmed by" + by;
    case ServoState::locked:
      return stands + ", locked: held there by" + by;
  }
  return stands;
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
    const Seconds middle = wrap_positive(*decision.target - round.strobe_phase, options.period);
    state.target = plan(state, timing, cameras, options, middle);
  }
  const AlignTarget& target = *state.target;
  decision.target =
      wrap_positive(target_at(target, round.at, options.period) + round.strobe_phase, options.period);
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
    camera.servo = step.state;
    if (abs(step.trim - ordered) > cameras[i].trim->step / 2) camera.trim = step.trim;
    camera.reason = words(*camera.error, step, options.row_time);
    const bool in =
        abs(*camera.error) + 2 * now.tau_sigma <= tolerance && abs(to_go) + 2 * now.tau_sigma <= tolerance;
    all_in = all_in && in;
  }
  if (!all_in) return false;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const PartsPerMillion holding = target.rate - state.cameras[i].phase.at(round.at, track).rate;
    const ServoStep step = rate_servo({Seconds(0), Seconds(1), holding}, *cameras[i].trim, timing.interval);
    camera.servo = ServoState::locked;
    camera.trim = step.trim;
    camera.reason = words(*camera.error, {step.trim, ServoState::locked}, options.row_time);
  }
  return true;
}

}  // namespace emberlock
