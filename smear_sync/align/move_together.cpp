#include "smear_sync/align/move_together.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "smear_sync/align/align.h"
#include "smear_sync/align/align_words.h"

namespace emberlock {
namespace {

constexpr double kAlike = 5;  // standard errors

/// What the cameras' dots moved by beyond what was expected of all: the middle of what they say and of the
/// strobe's own word, the smaller of two.
Seconds common_excess(std::span<const std::optional<DotMove>> cameras, Seconds period) {
  std::vector<Seconds> excess{Seconds(0)};
  for (const auto& move : cameras) {
    if (move) excess.push_back(wrap_symmetric(move->seen - move->expected, period));
  }
  std::sort(excess.begin(), excess.end());
  const Seconds low = excess[(excess.size() - 1) / 2];
  const Seconds high = excess[excess.size() / 2];
  return abs(low) < abs(high) ? low : high;
}

std::string doubt_of(DotMotion motion, const DotMove& move, bool all_stand) {
  const std::string moved =
      fmt::format("when the strobe's flashes were moved by {:.2f} ms", in_milliseconds(move.strobe));
  switch (motion) {
    case DotMotion::untold:
    case DotMotion::with_all:
      break;
    case DotMotion::none:
      if (all_stand) return "no camera's dot moved " + moved + ": see whether the strobe does as it is told";
      return "its dot stood still " + moved +
             ": look for a reflection of the lamp in the lamp's own columns, shade it, or turn the camera";
    case DotMotion::against:
      return "its dot moved the other way " + moved + ": set its read direction the other way round";
    case DotMotion::otherwise:
      return fmt::format("its dot moved by {:.2f} ms ", in_milliseconds(move.seen)) + moved +
             ": see whether its row time is right, its shutter was reset, or a reflection stands in its "
             "columns";
  }
  return {};
}

}  // namespace

std::vector<DotMotion> move_together(std::span<const std::optional<DotMove>> cameras, Seconds period) {
  const Seconds common = common_excess(cameras, period);
  std::vector<DotMotion> motions(cameras.size(), DotMotion::untold);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!cameras[i]) continue;
    const DotMove& move = *cameras[i];
    const Seconds allowed = kAlike * move.sigma;
    const auto moved_by = [&](Seconds way) {
      return abs(wrap_symmetric(move.seen - way, period)) <= allowed;
    };
    if (abs(wrap_symmetric(move.strobe, period)) <= 2 * allowed) continue;
    if (moved_by(Seconds(0))) {
      motions[i] = DotMotion::none;
    } else if (moved_by(move.expected + common)) {
      motions[i] = DotMotion::with_all;
    } else if (moved_by(-(move.expected + common))) {
      motions[i] = DotMotion::against;
    } else {
      motions[i] = DotMotion::otherwise;
    }
  }
  return motions;
}

void watch_moves(AlignState& state, const AlignRound& round, const AlignOptions& options) {
  std::vector<std::optional<DotMove>> moves(state.cameras.size());
  for (std::size_t i = 0; i < moves.size(); ++i) {
    CameraTrack& track = state.cameras[i];
    const Phase& phase = round.cameras[i].phase;
    if (phase.state != PhaseState::known) continue;
    if (track.sighted && track.phase.phase_known()) {
      const Drift drift = track.phase.at(round.at, track_options(options));
      const Seconds before = track.sighted->tau;
      moves[i] = DotMove{round.strobe_phase - track.sighted->strobe_phase,
                         wrap_symmetric(drift.tau + round.strobe_phase - before, options.period),
                         wrap_symmetric(phase.tau - before, options.period),
                         Seconds(std::hypot(drift.tau_sigma.value(), phase.sigma.value()))};
    }
    track.sighted = Sighting{phase.tau, round.strobe_phase};
  }
  const std::vector<DotMotion> motions = move_together(moves, options.period);
  const auto stands = std::count(motions.begin(), motions.end(), DotMotion::none);
  const bool all_stand =
      stands > 1 && std::count(motions.begin(), motions.end(), DotMotion::untold) + stands ==
                        static_cast<std::ptrdiff_t>(motions.size());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    if (motions[i] == DotMotion::untold) continue;
    CameraTrack& track = state.cameras[i];
    track.moved = motions[i] == DotMotion::with_all;
    track.doubt = doubt_of(motions[i], *moves[i], all_stand);
  }
}

void ask_for_moves(AlignState& state, AlignDecision& decision, const std::vector<AlignCamera>& cameras,
                   const AlignOptions& options, Seconds nodded, int looks) {
  const bool resets = std::any_of(decision.cameras.begin(), decision.cameras.end(),
                                  [](const CameraDecision& camera) { return camera.reset; });
  const bool open = decision.verdict == AlignVerdict::go_on || decision.verdict == AlignVerdict::aligned;
  if (options.nod == Seconds(0) || resets || !open) return;
  std::string unmoved;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!state.cameras[i].moved) unmoved += (unmoved.empty() ? "" : ", ") + cameras[i].id;
  }
  if (unmoved.empty()) return;
  if (!decision.strobe_phase) decision.strobe_phase = nodded;
  if (decision.verdict == AlignVerdict::go_on) return;
  state.looks = looks + 1;
  if (state.looks > options.max_looks) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason = "no dot of " + unmoved + " was seen at two places of the strobe in " +
                      plural(static_cast<std::size_t>(state.looks), "look") +
                      ": check that the lamp is in view and not over-exposed";
    return;
  }
  decision.verdict = AlignVerdict::go_on;
  decision.reason += fmt::format("; the strobe is moved by {:.2f} ms, which the dot of {} must follow",
                                 in_milliseconds(options.nod), unmoved);
}

}  // namespace emberlock
