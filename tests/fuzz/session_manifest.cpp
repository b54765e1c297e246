// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "session/events.h"
#include "session/files.h"
#include "session/layout.h"
#include "session/shutter_times.h"
#include "tests/fuzz/target.h"

// The protobuf files of a session: manifest and shutter times as JSON, and the events on the wire.
FUZZ_TARGET(session_manifest) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto manifest = emberlock::session::parse_manifest(bytes, "input"); manifest.ok()) {
    for (const auto& camera : manifest->cameras()) {
      if (!emberlock::session::layout_of(camera).ok()) std::abort();
    }
  }
  if (const auto times = emberlock::session::parse_shutter_times(bytes, "input"); times.ok()) {
    for (const auto& camera : times->cameras()) {
      for (const double late : camera.late_s()) {
        if (!std::isfinite(late)) std::abort();
      }
      if (!(camera.sigma_s() >= 0)) std::abort();
    }
  }
  if (emberlock::session::parse_events(bytes).valid_bytes > size) std::abort();
  return 0;
}
