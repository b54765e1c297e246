// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "daemon/live/state.h"
#include "daemon/reconstruction/state.h"
#include "session/child_messages.h"
#include "tests/fuzz/target.h"

// What a reconstruction's child, or that of live volumes, sends the daemon, in two pieces.
FUZZ_TARGET(child_message) {
  using namespace emberlock;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  daemon::ReconstructionState state{v1::ReconstructionStatus()};
  daemon::LiveState live("session", {});
  const auto take = [&](v1::ChildMessage&& message) {
    const bool of_live = message.has_live_frame();
    const auto shown = of_live ? live.take(std::move(message), {}) : state.take(std::move(message));
    if (!(live.status().takes_s() >= 0 && live.status().delay_s() >= 0)) std::abort();
    if (!shown || !shown->has_volume()) return;
    const v1::VolumePreview& volume = shown->volume();
    if (volume.voxels().size() != std::size_t{volume.nx()} * volume.ny() * volume.nz()) std::abort();
    for (const v1::VolumeLayer& layer : volume.layers())
      if (layer.voxels().size() != volume.voxels().size()) std::abort();
  };
  session::ChildMessageParser parser;
  if (parser.add(bytes.substr(0, size / 2), take))
    static_cast<void>(parser.add(bytes.substr(size / 2), take).ok());
  state.end({}, "");
  const double fraction = state.status().fraction();
  if (!(fraction >= 0 && fraction <= 1)) std::abort();
  return 0;
}
