// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/state.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace emberlock::daemon {
namespace {

/// Whether what is shown of an iteration holds together: it comes from another process.
bool is_sound(const v1::VolumePreview& volume) {
  constexpr std::uint32_t kMost = 256;  // along an edge
  return volume.nx() <= kMost && volume.ny() <= kMost && volume.nz() <= kMost &&
         volume.voxels().size() == std::size_t{volume.nx()} * volume.ny() * volume.nz() &&
         volume.box().center_size() == 3 && volume.box().size_size() == 3;
}

std::string signal_name(int signal) {
  const char* const name = ::sigabbrev_np(signal);
  return name == nullptr ? fmt::format("signal {}", signal) : fmt::format("SIG{}", name);
}

}  // namespace

ReconstructionState::ReconstructionState(v1::ReconstructionStatus begun) : status_(std::move(begun)) {
  status_.set_state(v1::ReconstructionStatus::RUNNING);
  status_.set_doing("starting");
}

std::optional<v1::IterationPreview> ReconstructionState::take(v1::ChildMessage&& message) {
  if (message.has_progress()) {
    v1::ChildMessage::Progress& progress = *message.mutable_progress();
    if (std::isfinite(progress.fraction())) status_.set_fraction(std::clamp(progress.fraction(), 0.0, 1.0));
    status_.set_doing(std::move(*progress.mutable_doing()));
    if (!progress.device().empty()) status_.set_device(progress.device());
  } else if (message.has_iteration()) {
    v1::IterationPreview& preview = *message.mutable_iteration();
    preview.set_reconstruction(status_.id());
    if (preview.has_volume() && !is_sound(preview.volume())) preview.clear_volume();
    auto& iterations = *status_.mutable_iterations();
    if (iterations.size() == kIterations) iterations.DeleteSubrange(0, 1);
    // The picture of the iteration that was kept comes once more, with numbers that are known.
    const bool known = std::any_of(iterations.begin(), iterations.end(), [&](const v1::Iteration& earlier) {
      return earlier.iteration() == preview.iteration().iteration() &&
             earlier.seconds() == preview.iteration().seconds();
    });
    if (!known) *iterations.Add() = preview.iteration();
    return std::move(preview);
  } else if (message.has_done()) {
    v1::ChildMessage::Done& done = *message.mutable_done();
    *status_.mutable_effects() = std::move(*done.mutable_effects());
    *status_.mutable_advice() = std::move(*done.mutable_advice());
    status_.mutable_advice()->MergeFrom(done.warnings());
    status_.set_result(std::move(*done.mutable_result()));
    done_ = true;
  } else if (message.has_failure()) {
    told_ = message.failure().message();
  }
  return std::nullopt;
}

void ReconstructionState::end(const ChildEnd& end, const std::string& last_words) {
  if (done_ && end.signal == 0 && end.code == 0) {
    status_.set_state(v1::ReconstructionStatus::DONE);
    status_.set_fraction(1);
    status_.set_doing("done");
  } else if (end.why == ChildEnd::Why::cancelled) {
    status_.set_state(v1::ReconstructionStatus::CANCELLED);
    status_.set_doing("cancelled");
  } else {
    status_.set_error(failure(end, last_words));
    status_.set_state(v1::ReconstructionStatus::FAILED);
    status_.set_doing("failed");
  }
}

std::string ReconstructionState::failure(const ChildEnd& end, const std::string& last_words) const {
  const bool maybe_gpu = status_.device() != "cpu";
  const std::string cpu = maybe_gpu ? " Try device cpu" : " Try fewer voxels";
  const std::string words = last_words.empty() ? "" : " It said: " + last_words + ".";
  const std::string while_ = status_.doing().empty() ? "" : fmt::format(" (it was at: {})", status_.doing());
  switch (end.why) {
    case ChildEnd::Why::silent:
    case ChildEnd::Why::unreadable:
      return end.words + while_ + "." + words + cpu;
    case ChildEnd::Why::not_started:
      return end.words;
    default:
      break;
  }
  if (end.signal == SIGKILL) {
    return fmt::format("it was killed by SIGKILL{}: most likely the memory ran out.{} Try fewer voxels",
                       while_, words);
  }
  if (end.signal != 0)
    return fmt::format("it crashed by {}{}.{}{}", signal_name(end.signal), while_, words, cpu);
  if (!told_.empty()) return told_;
  if (end.code == 0) return fmt::format("it ended without a result{}.{} Start it again", while_, words);
  return fmt::format("it ended with exit code {}{}.{}{}", end.code, while_, words, cpu);
}

}  // namespace emberlock::daemon
