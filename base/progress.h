#pragma once

#include <functional>
#include <string_view>

namespace emberlock {

/// How far a long step has come: fraction in 0..1 and a few words. May be empty. Called from the thread that
/// works.
using Progress = std::function<void(double fraction, std::string_view what)>;

inline void report(const Progress& progress, double fraction, std::string_view what) {
  if (progress) progress(fraction, what);
}

}  // namespace emberlock
