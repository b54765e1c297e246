// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/frame_ledger.h"

#include <algorithm>

namespace emberlock::drivers::aravis {
namespace {

constexpr std::uint64_t kLast16 = 65535;

/// Number of steps from one id to a later one; nullopt if it isn't later.
std::optional<std::uint64_t> steps(std::uint64_t from, std::uint64_t to) {
  if (to > from) return to - from;
  if (from > kLast16) return {};
  const std::uint64_t wrapped = kLast16 - from + to;
  // A count that wraps too early was restarted, for example after a power failure.
  return wrapped > 0 && wrapped <= kLast16 / 2 ? std::optional(wrapped) : std::nullopt;
}

}  // namespace

std::uint64_t FrameLedger::record(std::uint64_t id, FrameOutcome outcome, FrameOutcome gap) {
  const auto forward = last_id_ ? steps(*last_id_, id) : std::nullopt;
  if (!forward) {
    begin_anew();
  } else {
    const std::uint64_t skipped = *forward - 1;
    // Additional unnumbered parts belong to the same frames.
    const std::uint64_t explained = std::min<std::uint64_t>(skipped, unnumbered_.size());
    // A frame that begins during an underrun may find a buffer only for its end: count it as an underrun.
    for (std::uint64_t i = 0; i < explained; ++i) count(gap == FrameOutcome::underrun ? gap : unnumbered_[i]);
    count(gap, skipped - explained);
    unnumbered_.clear();
  }
  last_id_ = id;
  const std::uint64_t number = next_;
  count(outcome);
  return number;
}

void FrameLedger::begin_anew() {
  for (const FrameOutcome outcome : unnumbered_) count(outcome);
  unnumbered_.clear();
  last_id_.reset();
}

void FrameLedger::count(FrameOutcome outcome, std::uint64_t frames) {
  next_ += frames;
  switch (outcome) {
    case FrameOutcome::delivered:
      counts_.delivered += frames;
      return;
    case FrameOutcome::damaged:
      counts_.damaged += frames;
      return;
    case FrameOutcome::camera_gap:
      counts_.camera_gap += frames;
      return;
    case FrameOutcome::transport:
      counts_.transport += frames;
      return;
    case FrameOutcome::resend:
      counts_.resend += frames;
      return;
    case FrameOutcome::underrun:
      counts_.underrun += frames;
      return;
    case FrameOutcome::passed_over:
      counts_.passed_over += frames;
      return;
  }
}

}  // namespace emberlock::drivers::aravis
