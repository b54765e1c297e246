// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/frame_ledger.h"

#include <algorithm>

namespace emberlock::drivers::aravis {
namespace {

constexpr std::uint64_t kLast16 = 65535;

/// Steps from one id to a later one; none where it isn't later.
std::optional<std::uint64_t> steps(std::uint64_t from, std::uint64_t to) {
  if (to > from) return to - from;
  if (from > kLast16) return {};
  const std::uint64_t wrapped = kLast16 - from + to;
  // What wraps early has begun anew, as after a lost power supply.
  return wrapped > 0 && wrapped <= kLast16 / 2 ? std::optional(wrapped) : std::nullopt;
}

}  // namespace

std::uint64_t FrameLedger::record(std::uint64_t id, Fate fate, Fate gap) {
  const auto forward = last_id_ ? steps(*last_id_, id) : std::nullopt;
  if (!forward) {
    begin_anew();
  } else {
    const std::uint64_t skipped = *forward - 1;
    // More unnumbered than skipped were pieces of one frame.
    const std::uint64_t explained = std::min<std::uint64_t>(skipped, unnumbered_.size());
    // Of a frame at the edge of a want of buffers only the end finds one.
    for (std::uint64_t i = 0; i < explained; ++i) count(gap == Fate::underrun ? gap : unnumbered_[i]);
    count(gap, skipped - explained);
    unnumbered_.clear();
  }
  last_id_ = id;
  const std::uint64_t number = next_;
  count(fate);
  return number;
}

void FrameLedger::begin_anew() {
  for (const Fate fate : unnumbered_) count(fate);
  unnumbered_.clear();
  last_id_.reset();
}

void FrameLedger::count(Fate fate, std::uint64_t frames) {
  next_ += frames;
  switch (fate) {
    case Fate::delivered:
      counts_.delivered += frames;
      return;
    case Fate::damaged:
      counts_.damaged += frames;
      return;
    case Fate::camera_gap:
      counts_.camera_gap += frames;
      return;
    case Fate::transport:
      counts_.transport += frames;
      return;
    case Fate::resend:
      counts_.resend += frames;
      return;
    case Fate::underrun:
      counts_.underrun += frames;
      return;
    case Fate::passed_over:
      counts_.passed_over += frames;
      return;
  }
}

}  // namespace emberlock::drivers::aravis
