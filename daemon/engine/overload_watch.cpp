// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/overload_watch.h"

#include <algorithm>
#include <string>
#include <utility>

namespace emberlock::daemon {
namespace {

std::size_t place(Bottleneck what) { return static_cast<std::size_t>(what); }

FaultKey key_of(std::size_t cause) {
  static const std::array<const char*, 3> kSubjects{"processor", "disk", "bus"};
  return {v1::Fault::OVERLOADED, kSubjects.at(cause)};
}

/// Counts that begin anew, as of another recording, have grown by what they are.
std::uint64_t grown(std::uint64_t after, std::uint64_t before) {
  return after >= before ? after - before : after;
}

std::uint64_t lost_of(const drivers::FrameCounts& counts) { return counts.lost() + counts.damaged; }

}  // namespace

std::vector<MachineEvent> OverloadWatch::look(const WorkCounts& counts, TimePoint now) {
  if (!samples_.empty() && now - samples_.back().at < kInterval) return {};
  Sample next{now, counts};
  if (!samples_.empty()) {
    const Sample& last = samples_.back();
    next.lost = last.lost;
    for (std::size_t i = 0; i < counts.cameras.size(); ++i) {
      const drivers::FrameCounts& after = counts.cameras[i];
      const drivers::FrameCounts& before = last.counts.cameras[i];
      next.lost[place(Bottleneck::processor)] +=
          grown(after.underrun, before.underrun) + grown(after.queue, before.queue);
      next.lost[place(Bottleneck::bus)] +=
          grown(after.transport, before.transport) + grown(after.resend, before.resend);
    }
    const session::WriterLoad began =
        counts.writer.worked < last.counts.writer.worked ? session::WriterLoad{} : last.counts.writer;
    const bool disk = (counts.writer - began).waits_for_disk();
    next.lost[place(disk ? Bottleneck::disk : Bottleneck::processor)] +=
        grown(counts.no_room, last.counts.no_room);
  }
  samples_.push_back(std::move(next));
  while (samples_.size() > 2 && now - samples_[1].at >= kSpan) samples_.pop_front();

  const Sample& first = samples_.front();
  const Sample& last = samples_.back();
  std::uint64_t made = 0;
  for (std::size_t i = 0; i < counts.cameras.size(); ++i) {
    lately_[i] = grown(lost_of(last.counts.cameras[i]), lost_of(first.counts.cameras[i]));
    made += grown(last.counts.cameras[i].made(), first.counts.cameras[i].made());
  }
  std::vector<MachineEvent> events;
  for (std::size_t cause = 0; cause < kCauses; ++cause) {
    const auto what = static_cast<Bottleneck>(cause);
    const std::uint64_t lost = last.lost[cause] - first.lost[cause];
    const bool works_on = what == Bottleneck::processor && counts.overworked > 0;
    const bool many = lost >= kFewest && static_cast<double>(lost) >= kLeastPart * static_cast<double>(made);
    if (many || works_on || (told_[cause] && lost > 0)) {
      const Overload overload{what, lost, std::max(made, lost), last.at - first.at};
      events.emplace_back(FaultRaised{key_of(cause), v1::AMBER, overload});
      told_[cause] = true;
    } else if (std::exchange(told_[cause], false)) {
      events.emplace_back(FaultMended{key_of(cause)});
    }
  }
  return events;
}

}  // namespace emberlock::daemon
