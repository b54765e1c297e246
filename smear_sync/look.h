#pragma once

#include <optional>

#include "smear_sync/background.h"
#include "smear_sync/lamp.h"

namespace emberlock::detail {

/// What a frame shows before its columns are read.
struct Look {
  Background background;
  LampSearch search;
};

/// Over all of the frame.
Look whole_look(const Plane& plane, const DetectOptions& options);

/// Where the one lamp of the look before was, and at every 16th row of all of the frame, from row `turn`
/// modulo 16 on. Nothing when something isn't as it was: a lamp gone, moved or joined by another, other
/// noise.
std::optional<Look> look_again(const Plane& plane, const Look& before, unsigned turn,
                               const DetectOptions& options);

}  // namespace emberlock::detail
