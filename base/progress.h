// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// Receives the progress of a long step: a fraction in 0..1 and a few words. May be empty. Called from a
/// working thread, never by two at a time.
using Progress = std::function<void(double fraction, std::string_view what)>;

/// The largest fraction that is reported before the end.
inline constexpr double kNearlyDone = 0.999;

inline void tell(const Progress& progress, double fraction, std::string_view what) {
  if (progress) progress(fraction, what);
}

/// Like Progress, for a step that can be cancelled: false asks the step to stop.
using Observer = std::function<bool(double fraction, std::string_view what)>;

/// Reports progress. Error `refused` when the observer asks to stop.
inline Status observe(const Observer& observer, double fraction, std::string_view what) {
  if (!observer || observer(fraction, what)) return {};
  return Error{ErrorKind::refused, "ended early, as asked", std::string(what)};
}

/// An observer for a part of a step: maps its 0..1 to from..to of the whole.
inline Observer part_of(const Observer& whole, double from, double to) {
  if (!whole) return {};
  return [&whole, from, to](double fraction, std::string_view what) {
    return whole(from + fraction * (to - from), what);
  };
}

}  // namespace emberlock
