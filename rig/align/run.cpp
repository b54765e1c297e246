// SPDX-License-Identifier: Apache-2.0
#include "rig/align/run.h"

#include <algorithm>

#include <fmt/format.h>

#include "rig/align/alignment.h"
#include "smear_sync/align/align_words.h"

namespace emberlock::rig {
namespace {

/// After a round that found the cameras aligned: keeps them so for `time`, or until it is stopped, and as
/// long as they can be.
Status hold(Alignment& alignment, Seconds time, const Progress& progress) {
  const TimePoint began = alignment.at();
  const auto left = [&] { return time - (alignment.at() - began); };
  while (left() > Seconds(0) && !alignment.stop_asked()) {
    const smear::AlignVerdict verdict = alignment.last().verdict;
    if (verdict == smear::AlignVerdict::refused || verdict == smear::AlignVerdict::given_up) break;
    if (verdict == smear::AlignVerdict::aligned) {
      const Seconds pause = std::min(alignment.next_check(alignment.at()), left());
      tell(progress, std::min((alignment.at() - began) / time, kNearlyDone),
           fmt::format("held for {} by {} checks and {} resets, checks again in {}",
                       smear::words(alignment.at() - began), alignment.checks(), alignment.resets(),
                       smear::words(pause)));
      alignment.wait(alignment.at() + pause);
      if (alignment.stopped()) break;
    }
    EMBERLOCK_RETURN_IF_ERROR(alignment.round());
  }
  return {};
}

}  // namespace

Result<AlignRunResult> run_align(const AlignRig& rig, const AlignRunOptions& options,
                                 const AlignObserver& observer, const Progress& progress,
                                 const StopAsked& stop) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto alignment, Alignment::create(rig, options, observer, progress, stop));
  EMBERLOCK_RETURN_IF_ERROR(alignment->start());
  do {
    EMBERLOCK_RETURN_IF_ERROR(alignment->round());
  } while (alignment->last().verdict == smear::AlignVerdict::go_on && !alignment->stop_asked());
  if (options.hold && alignment->last().verdict == smear::AlignVerdict::aligned)
    EMBERLOCK_RETURN_IF_ERROR(hold(*alignment, *options.hold, progress));
  tell(progress, 1, alignment->last().verdict == smear::AlignVerdict::aligned ? "aligned" : "not aligned");
  return alignment->result();
}

}  // namespace emberlock::rig
