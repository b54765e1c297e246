// SPDX-License-Identifier: Apache-2.0
// What is said of live volumes.
#include <csignal>

#include <fmt/format.h>

#include "daemon/engine/words.h"

namespace emberlock::daemon {
namespace {

std::string way_out(const TooSlow& slow) {
  if (slow.holds_voxels == 0) return fmt::format("--every {}", slow.holds_every);
  return fmt::format("--every {} or --voxels {}", slow.holds_every, slow.holds_voxels);
}

struct LiveSentence {
  std::string operator()(std::monostate /*well*/) const { return {}; }
  std::string operator()(const NoVolumeYet& it) const { return "no volume yet: " + it.why; }
  std::string operator()(const QueueFills& it) const {
    return fmt::format("the recording goes first: its fullest queue is at {:.0f} %", 100 * it.share);
  }
  std::string operator()(const DiskBehind& it) const {
    return fmt::format("the recording goes first: its frames have waited {:.1f} s for the disk",
                       it.waits.value());
  }
  std::string operator()(const CamerasOverworked& /*it*/) const {
    return "the recording goes first: its cameras' threads need the processor";
  }
  std::string operator()(const FramesLostBeside& it) const {
    return fmt::format("stopped for the rest of the recording, which lost {} frame{} to too much work",
                       it.frames, it.frames == 1 ? "" : "s");
  }
  std::string operator()(const PausedTooOften& it) const {
    return fmt::format("stopped for the rest of the recording, which needed the machine more than {} times",
                       it.times);
  }
  std::string operator()(const TooSlow& it) const {
    return fmt::format(
        "doesn't keep up: a volume of {} voxels takes {:.2f} s, and each {} frames are asked "
        "for. {} would hold",
        it.voxels, it.takes.value(), it.every, way_out(it));
  }
  std::string operator()(const LiveChildFailed& it) const {
    if (it.end.why == ChildEnd::Why::not_started) return it.end.words;
    if (it.end.why == ChildEnd::Why::silent) return "its process told nothing any more and was killed";
    if (it.end.why == ChildEnd::Why::unreadable)
      return "its process sent what can't be understood, " + it.end.words +
             ". Install emberlock and emberlockd of one version";
    if (!it.told.empty()) return it.told;
    const std::string said = it.last_words.empty() ? "" : " It said: " + it.last_words + ".";
    if (it.end.signal == SIGKILL)
      return fmt::format("its process was killed: most likely the memory ran out.{} Try fewer voxels", said);
    if (it.end.signal != 0) return fmt::format("its process crashed by signal {}.{}", it.end.signal, said);
    return fmt::format("its process ended with exit code {}.{}", it.end.code, said);
  }
};

}  // namespace

std::string words(const LiveReason& reason) { return std::visit(LiveSentence{}, reason); }

std::string live_notice(const std::string& why) {
  return fmt::format("the recording goes on without live volumes: {}", why);
}

Error not_calibrated(const std::string& camera) {
  return {
      ErrorKind::bad_input, "isn't calibrated, so no volume can be made while it films", camera,
      "Calibrate the rig (`emberlock calibrate cameras` writes a rig.json and beside it a transforms.json), "
      "name "
      "that transforms.json as calibration in [rig] and restart emberlockd, or record without live volumes"};
}

}  // namespace emberlock::daemon
