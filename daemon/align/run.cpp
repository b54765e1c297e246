#include "daemon/align/run.h"

#include <algorithm>

#include <fmt/format.h>

#include "daemon/align/alignment.h"
#include "smear_sync/align/align_words.h"

namespace emberlock {
namespace {

/// After a round that found the cameras aligned: keeps them so for `time`, or until it is stopped, and as
/// long as they can be.
Status hold(Alignment& alignment, Seconds time, const Progress& progress) {
  const TimePoint began = alignment.at();
  const auto left = [&] { return time - (alignment.at() - began); };
  while (left() > Seconds(0) && !alignment.stop_asked()) {
    const AlignVerdict verdict = alignment.last().verdict;
    if (verdict == AlignVerdict::refused || verdict == AlignVerdict::given_up) break;
    if (verdict == AlignVerdict::aligned) {
      const Seconds pause = std::min(alignment.next_check(alignment.at()), left());
      report(
          progress, std::min((alignment.at() - began) / time, kNearlyDone),
          fmt::format("held for {} by {} checks and {} resets, checks again in {}",
                      words(alignment.at() - began), alignment.checks(), alignment.resets(), words(pause)));
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
  } while (alignment->last().verdict == AlignVerdict::go_on && !alignment->stop_asked());
  if (options.hold && alignment->last().verdict == AlignVerdict::aligned)
    EMBERLOCK_RETURN_IF_ERROR(hold(*alignment, *options.hold, progress));
  report(progress, 1, alignment->last().verdict == AlignVerdict::aligned ? "aligned" : "not aligned");
  return alignment->result();
}

}  // namespace emberlock
