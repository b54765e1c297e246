// SPDX-License-Identifier: Apache-2.0
#include "cli/reconstruct_sequence.h"

#include <cstdio>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "session/frame_range.h"

namespace emberlock::cli {

void reconstruct_sequence(const std::vector<std::uint64_t>& frames, const std::filesystem::path& out,
                          const ReconstructFrame& reconstruct) {
  std::size_t tried = 0;
  std::size_t failed = 0;
  for (const std::uint64_t frame : frames) {
    const std::string name = fmt::format("frame {} ({} of {})", frame, ++tried, frames.size());
    std::fprintf(stderr, "%s\n", name.c_str());
    if (const Status done = reconstruct(frame, out / fmt::format("frame-{}", frame)); !done.ok()) {
      ++failed;
      std::fprintf(stderr, "emberlock: %s: %s\n", name.c_str(), done.error().message().c_str());
    }
    if (Interrupt::asked() || (failed == tried && failed == session::kFailuresAtStart)) break;
  }
  if (failed == 0 && tried == frames.size()) return;
  fail({ErrorKind::refused,
        fmt::format("of {} frames {} failed and {} were not tried", frames.size(), failed,
                    frames.size() - tried),
        out.string(), "Each of them is told above"});
}

}  // namespace emberlock::cli
