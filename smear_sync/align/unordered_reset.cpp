// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/unordered_reset.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace emberlock::smear {
namespace {

constexpr double kBeyond = 6;  // standard errors
constexpr double kPart = 0.1;  // of the tolerance

Seconds allowed(Seconds sigma, const AlignContext& c) {
  return std::max(kBeyond * sigma, kPart * c.tolerance);
}

/// A camera's phase beside what was foretold of it.
struct Surprise {
  Seconds by;       ///< seen less expected; zero where nothing was seen
  Seconds allowed;  ///< what errors account for
  bool seen = false;
  bool vanished = false;
};

std::optional<Surprise> surprise_of(const CameraTrack& track, const CameraView& view, const AlignContext& c) {
  if (!track.phase.phase_known() || track.doubt || view.away) return std::nullopt;
  const Drift drift = track.phase.at(c.round.at, c.track);
  Surprise surprise;
  surprise.allowed = allowed(Seconds(std::hypot(drift.tau_sigma.value(), view.phase.sigma.value())), c);
  const auto apart = [&](Seconds a, Seconds b) { return wrap_symmetric(a - b, c.options.period); };
  if (view.phase.state == PhaseState::known) {
    surprise.seen = true;
    surprise.by = apart(view.phase.tau, drift.tau);
    // What stood still, or moved the other way, is another matter.
    const Seconds strobe =
        track.sighted ? apart(c.round.strobe_phase, track.sighted->strobe_phase) : Seconds(0);
    const auto explained = [&](Seconds way) {
      return strobe != Seconds(0) && abs(apart(surprise.by, way)) <= surprise.allowed;
    };
    if (explained(-strobe) || explained(-2.0 * strobe)) return std::nullopt;
  } else if (view.phase.state == PhaseState::blind && track.sighted) {
    // Seen at this very place a round ago.
    surprise.vanished = c.round.strobe_phase == track.sighted->strobe_phase &&
                        abs(apart(drift.tau, track.sighted->tau)) <= surprise.allowed;
  }
  return surprise;
}

/// What most of the cameras are surprised by; zero where no such thing is.
Seconds common_surprise(const std::vector<std::optional<Surprise>>& surprises, Seconds period) {
  const auto seen = [](const std::optional<Surprise>& s) { return s && s->seen; };
  const auto all = std::count_if(surprises.begin(), surprises.end(), seen);
  for (const auto& one : surprises) {
    if (!seen(one) || abs(one->by) <= one->allowed) continue;
    const auto alike = std::count_if(surprises.begin(), surprises.end(), [&](const auto& other) {
      return seen(other) && abs(wrap_symmetric(other->by - one->by, period)) <= other->allowed;
    });
    if (alike > 1 && 2 * alike > all) return one->by;
  }
  return Seconds(0);
}

}  // namespace

std::vector<std::size_t> unordered_resets(const AlignState& state, const AlignContext& c) {
  std::vector<std::optional<Surprise>> surprises(state.cameras.size());
  for (std::size_t i = 0; i < surprises.size(); ++i) {
    const bool ordered = std::any_of(c.round.resets.begin(), c.round.resets.end(),
                                     [&](const ResetDone& done) { return done.camera == i; });
    if (!ordered) surprises[i] = surprise_of(state.cameras[i], c.round.cameras[i], c);
  }
  const Seconds common = common_surprise(surprises, c.options.period);
  std::vector<std::size_t> jumped;
  for (std::size_t i = 0; i < surprises.size(); ++i) {
    const auto& s = surprises[i];
    if (!s) continue;
    const bool moved = s->seen && abs(wrap_symmetric(s->by - common, c.options.period)) > s->allowed;
    // Where the strobe began anew, what was known of a camera that isn't seen is void as well.
    if (moved || s->vanished || (!s->seen && common != Seconds(0))) jumped.push_back(i);
  }
  return jumped;
}

bool same_phase(Seconds shift, Seconds sigma, const AlignContext& c) {
  return abs(wrap_symmetric(shift, c.options.period)) <= allowed(sigma, c);
}

}  // namespace emberlock::smear
