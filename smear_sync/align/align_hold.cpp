// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_hold.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "smear_sync/align/align_look.h"

namespace emberlock::smear {
namespace {

/// The next check comes before any of the cameras leaves by so many standard errors, and by so much more than
/// its rate usually wanders.
constexpr double kScheduleSigmas = 3;
constexpr double kScheduleWander = 2;

/// Resets aim to land within tolerance by so many standard errors and this part of it.
constexpr double kAimSigmas = 4;
constexpr double kAimPart = 0.1;
/// One whose landing is known to less than this part of it can't be aimed.
constexpr double kAimedPart = 0.2;
/// A rate is believed but for so many standard errors; what drifts through half of the tolerance in longer
/// than this, it will do otherwise by then.
constexpr double kBelievedSigmas = 2;
constexpr Seconds kForeseeable{1800};

/// A camera is reset when less is left of its stay than this part of what a reset would give it, or than so
/// many rounds.
constexpr double kDuePart = 0.08;
constexpr double kDueRounds = 2;
/// One that would leave before the next reset can be needed goes with it if that gives it so much more.
constexpr double kWorthwhile = 1.1;
/// Where resets give more than the shortest take by this factor, they are made for it.
constexpr double kAmple = 1.1;
/// A drift is known when its error (three standard errors) leads through less than this part of the tolerance
/// in the shortest take.
constexpr double kKnownPart = 0.5;
/// However long a take is wanted: longer forecasts are bound by how rates wander, whatever is measured.
constexpr Seconds kKnownFor{60};
/// Rounds after which a renewal isn't one any more.
constexpr int kLongestRenewal = 12;

TimeLeftOptions schedule(const AlignContext& c) {
  return {.tolerance = c.tolerance,
          .period = c.options.period,
          .sigmas = kScheduleSigmas,
          .wander_per_minute = kScheduleWander * c.options.rate_wander};
}

Seconds sure_stay(const Drift& course, const AlignContext& c) {
  return time_left(course, c.round.at, schedule(c)).earliest;
}

/// What a lock has to last for, where a reset would let a camera stay for so long.
Seconds wanted_stay(Seconds fresh, const AlignContext& c) {
  return fresh > kAmple * c.options.shortest_take ? c.options.shortest_take
                                                  : std::min(c.options.shortest_take, 0.5 * fresh);
}

/// How long it would if it stood at this error.
Seconds stay_from(Drift course, Seconds error, Seconds sigma, const AlignContext& c) {
  course.tau = wrap_positive(error, c.options.period);
  course.tau_sigma = sigma;
  return sure_stay(course, c);
}

/// Where a reset lets a camera stand, and how long it then stays.
struct Fresh {
  bool aimed = false;
  Seconds stay;
};

Fresh fresh_of(std::size_t i, const std::vector<Drift>& courses, const AlignContext& c,
               const AlignScene& scene) {
  const auto& landing = scene.landings[i].aim;
  const bool aimed = scene.timed(i) && landing && *landing < kAimedPart * c.tolerance;
  return {aimed, stay_from(courses[i], aimed ? aim_of(courses[i], *landing, c) : Seconds(0),
                           aimed ? *landing : courses[i].tau_sigma, c)};
}

}  // namespace

std::vector<Drift> courses_of(const AlignState& state, const AlignDecision& decision,
                              const std::vector<Drift>& drifts, const AlignContext& c) {
  std::vector<double> rates;
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    const PhaseTrack& phase = state.cameras[i].phase;
    const TimePoint later = c.round.at + Seconds(1e6);  // when all that was ordered is in force
    rates.push_back((drifts[i].rate + decision.cameras[i].trim.value_or(phase.trim(later))).value());
  }
  const auto [slowest, fastest] = std::minmax_element(rates.begin(), rates.end());
  const bool fixed = c.options.policy == AlignPolicy::fixed_reference;
  const double common = state.target ? state.target->rate.value()
                        : fixed      ? rates[c.options.reference]
                                     : (*slowest + *fastest) / 2;
  const double common_sigma = fixed ? drifts[c.options.reference].rate_sigma.value() : 0;
  std::vector<Drift> courses = drifts;
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    Drift& course = courses[i];
    course.tau = wrap_positive(*decision.cameras[i].error, c.options.period);
    course.rate = PartsPerMillion(rates[i] - common);
    course.rate_sigma = PartsPerMillion(std::hypot(drifts[i].rate_sigma.value(), common_sigma));
    if (fixed && i == c.options.reference) course.rate_sigma = PartsPerMillion(0);
  }
  return courses;
}

Seconds aim_of(const Drift& course, Seconds landing, const AlignContext& c) {
  const Seconds room = std::max((1 - kAimPart) * c.tolerance - kAimSigmas * landing, Seconds(0));
  const double believed =
      std::max(std::abs(course.rate.value()) - kBelievedSigmas * course.rate_sigma.value(), 0.0);
  const Seconds before = std::min(room, kForeseeable * (believed * 1e-6));
  return course.rate > PartsPerMillion(0) ? -before : before;
}

bool renew(AlignState& state, AlignDecision& decision, const std::vector<Drift>& courses,
           const AlignContext& c, const AlignScene& scene) {
  std::vector<Seconds> stays;
  std::vector<Seconds> fresh;  // stays after a reset
  std::vector<bool> aimed;
  Seconds soonest(std::numeric_limits<double>::infinity());  // that one which is aimed is needed again
  bool due = false;
  for (std::size_t i = 0; i < courses.size(); ++i) {
    const Fresh after = fresh_of(i, courses, c, scene);
    aimed.push_back(after.aimed);
    stays.push_back(sure_stay(courses[i], c));
    fresh.push_back(after.stay);
    if (aimed[i]) soonest = std::min(soonest, fresh[i]);
    const Seconds rounds = std::max(kDueRounds * c.options.round_time, wanted_stay(fresh[i], c));
    const Seconds least = aimed[i] ? std::max(rounds, kDuePart * fresh[i]) : rounds;
    // Where nothing is surer after a reset than before there is no use in it.
    const bool now = scene.movable(i) && stays[i] < least && fresh[i] > kWorthwhile * stays[i];
    decision.cameras[i].reset = now;
    due = due || now;
  }
  if (!due) return false;
  decision.renews = decision.in_time = true;
  std::vector<std::size_t> who;
  for (std::size_t i = 0; i < courses.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    if (aimed[i] && stays[i] < soonest && fresh[i] > kWorthwhile * stays[i]) camera.reset = true;
    if (!camera.reset) continue;
    // One that is drawn at random may take long to come back.
    decision.renews = decision.renews && scene.timed(i);
    state.cameras[i].renewed = true;
    who.push_back(i);
    camera.reason = {.cause = c.cameras[i].method == ShutterReset::by_hand ? CameraCause::leaving_by_hand
                                                                           : CameraCause::leaving,
                     .stay = stays[i]};
  }
  decision.reason = {AlignCause::leaving, std::move(who)};
  if (decision.renews) state.renewal = 1;
  return true;
}

std::vector<std::size_t> unknown_drifts(const std::vector<Drift>& courses, const AlignContext& c) {
  std::vector<std::size_t> unknown;
  const Seconds take = std::min(c.options.shortest_take, kKnownFor);
  for (std::size_t i = 0; i < courses.size(); ++i) {
    const Seconds errs = kScheduleSigmas * courses[i].rate_sigma.value() * 1e-6 * take;
    if (errs > kKnownPart * c.tolerance && sure_stay(courses[i], c) < take) unknown.push_back(i);
  }
  return unknown;
}

std::vector<std::size_t> leaving_at_once(const std::vector<Drift>& courses, const AlignContext& c) {
  std::vector<std::size_t> leaving;
  if (c.options.shortest_take <= Seconds(0)) return leaving;
  for (std::size_t i = 0; i < courses.size(); ++i)
    if (sure_stay(courses[i], c) < c.options.round_time) leaving.push_back(i);
  return leaving;
}

std::optional<Seconds> renewed_stay(const std::vector<Drift>& courses, const AlignContext& c,
                                    const AlignScene& scene) {
  Seconds soonest(std::numeric_limits<double>::infinity());
  bool aimed = false;  // the first one to leave
  for (std::size_t i = 0; i < courses.size(); ++i) {
    const Fresh after = fresh_of(i, courses, c, scene);
    const Seconds stay = sure_stay(courses[i], c);
    // As wanted_stay() resets for it.
    const Seconds renewed = after.aimed ? std::max(stay, 1 / kAmple * after.stay) : stay;
    if (renewed >= soonest) continue;
    soonest = renewed;
    aimed = after.aimed;
  }
  return aimed && std::isfinite(soonest.value()) ? std::optional(soonest) : std::nullopt;
}

void follow_renewal(AlignState& state, AlignDecision& decision, const AlignContext& c) {
  if (decision.renews) return;  // it has just begun
  bool on = state.renewal > 0 && ++state.renewal <= kLongestRenewal &&
            decision.verdict == AlignVerdict::go_on && decision.jumped.empty();
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const CameraTrack& track = state.cameras[i];
    const std::optional<Seconds>& error = decision.cameras[i].error;
    const bool in = where(track, c) && (!error || abs(*error) <= c.tolerance);
    on = on && !track.away && (track.renewed || in);
  }
  decision.renews = on;
  if (on) return;
  state.renewal = 0;
  for (CameraTrack& track : state.cameras) track.renewed = false;
}

void foresee(const AlignState& state, AlignDecision& decision, const std::vector<Drift>& drifts,
             const AlignContext& c) {
  const std::vector<Drift> courses = courses_of(state, decision, drifts, c);
  Seconds soonest(std::numeric_limits<double>::infinity());
  std::size_t first = 0;
  for (std::size_t i = 0; i < courses.size(); ++i) {
    decision.cameras[i].time_left = time_left(
        courses[i], c.round.at,
        {.tolerance = c.tolerance, .period = c.options.period, .wander_per_minute = c.options.rate_wander});
    const Seconds sure = sure_stay(courses[i], c);
    decision.cameras[i].sure_stay = sure;
    if (sure >= soonest) continue;
    soonest = sure;
    first = i;
  }
  if (decision.verdict != AlignVerdict::aligned) return;
  decision.next_check = soonest;
  if (std::isfinite(soonest.value())) decision.reason.first_out = first;
}

}  // namespace emberlock::smear
