// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// How far a long step has come: fraction in 0..1 and a few words. May be empty. Called by a thread that
/// works, one at a time.
using Progress = std::function<void(double fraction, std::string_view what)>;

/// The most that is reported before the end.
inline constexpr double kNearlyDone = 0.999;

inline void tell(const Progress& progress, double fraction, std::string_view what) {
  if (progress) progress(fraction, what);
}

/// As Progress, of a step that can be ended early: false says that nobody wants the rest.
using Observer = std::function<bool(double fraction, std::string_view what)>;

/// Error `refused` where the observer wants no more.
inline Status observe(const Observer& observer, double fraction, std::string_view what) {
  if (!observer || observer(fraction, what)) return {};
  return Error{ErrorKind::refused, "ended early, as asked", std::string(what)};
}

/// The part of a step from `from` to `to` of it, as a step of its own.
inline Observer part_of(const Observer& whole, double from, double to) {
  if (!whole) return {};
  return [&whole, from, to](double fraction, std::string_view what) {
    return whole(from + fraction * (to - from), what);
  };
}

}  // namespace emberlock
