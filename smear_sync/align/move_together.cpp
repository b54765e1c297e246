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

std::string when_moved(const DotMove& move) {
  return fmt::format("when the strobe's flashes were moved by {:.2f} ms", in_milliseconds(move.strobe));
}

/// Of a camera that shows this while another's dot did move.
std::string doubt_of(DotMotion motion, const DotMove& move) {
  const std::string moved = when_moved(move);
  switch (motion) {
    case DotMotion::untold:
    case DotMotion::with_all:
      break;
    case DotMotion::none:
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

/// The cameras whose dots haven't been seen to move: those that nothing was seen of, and those seen too
/// roughly.
struct Unmoved {
  std::string unseen;
  std::string rough;
  Seconds sigma;  ///< of the roughest

  [[nodiscard]] std::string all() const {
    return unseen + (unseen.empty() || rough.empty() ? "" : ", ") + rough;
  }
};

Unmoved unmoved_of(const AlignState& state, const std::vector<AlignCamera>& cameras) {
  Unmoved unmoved;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraTrack& track = state.cameras[i];
    if (track.moved) continue;
    std::string& list = track.rough ? unmoved.rough : unmoved.unseen;
    list += (list.empty() ? "" : ", ") + cameras[i].id;
    unmoved.sigma = std::max(unmoved.sigma, track.rough.value_or(Seconds(0)));
  }
  return unmoved;
}

/// Why a run ends whose cameras lie in tolerance as far as anybody can tell.
std::string why_untold(const Unmoved& unmoved, const AlignOptions& options, int looks) {
  std::string why;
  if (!unmoved.unseen.empty()) {
    why = "no dot of " + unmoved.unseen + " was seen at two places of the strobe in " +
          plural(static_cast<std::size_t>(looks), "look") +
          ": check that the lamp is in view and not over-exposed";
  }
  if (unmoved.rough.empty()) return why;
  if (!why.empty()) why += "; ";
  return why + fmt::format(
                   "the phase of {} is known to {:.2f} ms, too roughly to see it follow the "
                   "strobe by {:.2f} ms: ask for a finer tolerance, or give it more of the flash",
                   unmoved.rough, in_milliseconds(unmoved.sigma), in_milliseconds(options.strobe_step));
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
    CameraTrack& track = state.cameras[i];
    if (motions[i] == DotMotion::untold) {
      if (moves[i] && moves[i]->strobe != Seconds(0)) track.rough = moves[i]->sigma;
      continue;
    }
    track.moved = motions[i] == DotMotion::with_all;
    track.rough.reset();
    track.doubt = all_stand ? "no camera's dot moved " + when_moved(*moves[i]) +
                                  ": see whether the strobe does as it is told"
                            : doubt_of(motions[i], *moves[i]);
  }
}

void ask_for_moves(AlignState& state, AlignDecision& decision, const std::vector<AlignCamera>& cameras,
                   const AlignOptions& options, Seconds stepped, int looks) {
  const bool resets = std::any_of(decision.cameras.begin(), decision.cameras.end(),
                                  [](const CameraDecision& camera) { return camera.reset; });
  const bool open = decision.verdict == AlignVerdict::go_on || decision.verdict == AlignVerdict::aligned;
  if (options.strobe_step == Seconds(0) || resets || !open) return;
  const Unmoved unmoved = unmoved_of(state, cameras);
  const std::string all = unmoved.all();
  if (all.empty()) return;
  if (!decision.strobe_phase) decision.strobe_phase = stepped;
  if (decision.verdict == AlignVerdict::go_on) return;
  state.looks = looks + 1;
  if (state.looks > options.max_looks) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason = why_untold(unmoved, options, state.looks);
    return;
  }
  decision.verdict = AlignVerdict::go_on;
  decision.reason += fmt::format("; the strobe is moved by {:.2f} ms, which the dot of {} must follow",
                                 in_milliseconds(options.strobe_step), all);
}

}  // namespace emberlock
