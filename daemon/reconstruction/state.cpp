// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/state.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "session/frame_range.h"

namespace emberlock::daemon {
namespace {

std::string signal_name(int signal) {
  const char* const name = ::sigabbrev_np(signal);
  return name == nullptr ? fmt::format("signal {}", signal) : fmt::format("SIG{}", name);
}

}  // namespace

bool is_sound(const v1::VolumePreview& volume) {
  constexpr std::uint32_t kMost = 256;  // along an edge
  const std::size_t size = volume.voxels().size();
  return volume.nx() <= kMost && volume.ny() <= kMost && volume.nz() <= kMost &&
         size == std::size_t{volume.nx()} * volume.ny() * volume.nz() && volume.box().center_size() == 3 &&
         volume.box().size_size() == 3 &&
         std::all_of(volume.layers().begin(), volume.layers().end(), [&](const v1::VolumeLayer& layer) {
           return layer.voxels().size() == size && std::isfinite(layer.low()) && std::isfinite(layer.high());
         });
}

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
    if (preview.has_stylization()) {
      *status_.mutable_stylization() = preview.stylization();
      preview.mutable_stylization()->clear_views();  // which the status has
    }
    auto& iterations = *status_.mutable_iterations();
    if (iterations.size() == kIterations) iterations.DeleteSubrange(0, 1);
    // The picture of the iteration that was kept comes once more, with numbers that are known.
    const bool known = std::any_of(iterations.begin(), iterations.end(), [&](const v1::Iteration& earlier) {
      return earlier.iteration() == preview.iteration().iteration() &&
             earlier.seconds() == preview.iteration().seconds();
    });
    if (!known) *iterations.Add() = preview.iteration();
    return std::move(preview);
  } else if (message.has_edited()) {
    if (message.edited().has_taken()) *status_.mutable_stylization() = message.edited().taken();
  } else if (message.has_done()) {
    v1::ChildMessage::Done& done = *message.mutable_done();
    *status_.mutable_effects() = std::move(*done.mutable_effects());
    *status_.mutable_advice() = std::move(*done.mutable_advice());
    status_.mutable_advice()->MergeFrom(done.warnings());
    *status_.mutable_temperature() = std::move(*done.mutable_temperature());
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

SequenceState::SequenceState(v1::ReconstructionStatus begun, const std::vector<std::uint64_t>& frames,
                             std::string folder)
    : begun_(std::move(begun)), folder_(std::move(folder)), child_(begun_) {
  for (const std::uint64_t frame : frames) frames_.emplace_back().set_frame(frame);
}

bool SequenceState::next() {
  if (cancelled_ || given_up_ || begun_frames_ == std::max<std::size_t>(1, frames_.size())) return false;
  ++begun_frames_;
  if (is_sequence()) {
    child_ = ReconstructionState(begun_);
    frames_[begun_frames_ - 1].set_state(v1::ReconstructionStatus::RUNNING);
  }
  return true;
}

std::optional<std::uint64_t> SequenceState::frame() const {
  if (!is_sequence() || begun_frames_ == 0) return std::nullopt;
  return frames_[begun_frames_ - 1].frame();
}

std::optional<v1::IterationPreview> SequenceState::take(v1::ChildMessage&& message) {
  auto preview = child_.take(std::move(message));
  if (preview && frame()) {
    preview->set_frame(*frame());
    // The last one is that of the iteration that was kept.
    v1::SequenceFrame& at_hand = frames_[begun_frames_ - 1];
    at_hand.set_input_rmse(preview->iteration().input_rmse());
    if (preview->iteration().has_heldout_rmse())
      at_hand.set_heldout_rmse(preview->iteration().heldout_rmse());
  }
  return preview;
}

void SequenceState::end(const ChildEnd& end, const std::string& last_words) {
  child_.end(end, last_words);
  cancelled_ = end.why == ChildEnd::Why::cancelled;
  if (!frame()) return;
  v1::SequenceFrame& at_hand = frames_[begun_frames_ - 1];
  at_hand.set_state(child_.status().state());
  at_hand.set_error(child_.status().error());
  if (child_.status().temperature_size() > 0) at_hand.set_temperature(child_.status().temperature(0));
  given_up_ = end.why == ChildEnd::Why::not_started ||
              (count(v1::ReconstructionStatus::DONE) == 0 && begun_frames_ == session::kFailuresAtStart);
}

SequenceState::State SequenceState::state() const {
  if (!is_sequence()) return child_.status().state();
  if (count(v1::ReconstructionStatus::DONE) == frames_.size()) return v1::ReconstructionStatus::DONE;
  if (cancelled_) return v1::ReconstructionStatus::CANCELLED;
  const bool tried =
      begun_frames_ == frames_.size() && child_.status().state() != v1::ReconstructionStatus::RUNNING;
  return given_up_ || tried ? v1::ReconstructionStatus::FAILED : v1::ReconstructionStatus::RUNNING;
}

std::size_t SequenceState::count(State state) const {
  return static_cast<std::size_t>(
      std::count_if(frames_.begin(), frames_.end(),
                    [state](const v1::SequenceFrame& frame) { return frame.state() == state; }));
}

double SequenceState::fraction() const {
  const double of_child = child_.status().fraction();
  if (!is_sequence()) return of_child;
  const std::size_t ended = count(v1::ReconstructionStatus::DONE) + count(v1::ReconstructionStatus::FAILED);
  const bool works = child_.status().state() == v1::ReconstructionStatus::RUNNING;
  return (static_cast<double>(ended) + (works ? of_child : 0)) / static_cast<double>(frames_.size());
}

std::string SequenceState::doing() const {
  const std::string& of_child = child_.status().doing();
  if (!frame()) return of_child;
  switch (state()) {
    case v1::ReconstructionStatus::RUNNING:
      return fmt::format("frame {} ({} of {}): {}", *frame(), begun_frames_, frames_.size(), of_child);
    case v1::ReconstructionStatus::CANCELLED:
      return fmt::format("cancelled, with {} of {} frames done", count(v1::ReconstructionStatus::DONE),
                         frames_.size());
    case v1::ReconstructionStatus::DONE:
      return "done";
    default:
      return fmt::format("{} of {} frames failed", count(v1::ReconstructionStatus::FAILED), frames_.size());
  }
}

v1::ReconstructionStatus SequenceState::status() const {
  v1::ReconstructionStatus status = child_.status();
  if (!is_sequence()) return status;
  status.set_state(state());
  status.set_fraction(fraction());
  status.set_doing(doing());
  status.set_error(error());
  status.set_result(count(v1::ReconstructionStatus::DONE) > 0 ? folder_ : "");
  *status.mutable_frames() = {frames_.begin(), frames_.end()};
  return status;
}

std::string SequenceState::error() const {
  if (state() != v1::ReconstructionStatus::FAILED) return {};
  constexpr std::size_t kNamed = 10;
  std::vector<std::uint64_t> named;
  const v1::SequenceFrame* first = nullptr;
  for (const v1::SequenceFrame& frame : frames_) {
    if (frame.state() != v1::ReconstructionStatus::FAILED) continue;
    if (first == nullptr) first = &frame;
    if (named.size() < kNamed) named.push_back(frame.frame());
  }
  const std::size_t failed = count(v1::ReconstructionStatus::FAILED);
  std::string text =
      fmt::format("{} of {} frames failed: {}", failed, frames_.size(), fmt::join(named, ", "));
  if (failed > named.size()) text += fmt::format(" and {} more", failed - named.size());
  if (count(v1::ReconstructionStatus::DONE) > 0) text += ". The others are in " + folder_;
  if (begun_frames_ < frames_.size())
    text += fmt::format(". The other {} were not tried", frames_.size() - begun_frames_);
  return text + fmt::format(". Frame {}: {}", first->frame(), first->error());
}

}  // namespace emberlock::daemon
