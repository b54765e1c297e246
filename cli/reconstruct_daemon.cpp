// SPDX-License-Identifier: Apache-2.0
#include "cli/reconstruct_daemon.h"

#include <algorithm>
#include <cstdio>
#include <string>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/interrupt.h"

namespace emberlock::cli {
namespace {

using State = v1::ReconstructionStatus;

/// Those after the time `shown`, which it moves on: numbers may restart, times don't.
void print_iterations(const v1::ReconstructionStatus& status, double& shown, bool json) {
  for (const v1::Iteration& iteration : status.iterations()) {
    if (iteration.seconds() > shown)
      std::printf("%s\n", (json ? json_line(iteration) : iteration_line(iteration)).c_str());
    shown = std::max(shown, iteration.seconds());
  }
  std::fflush(stdout);
}

/// The frames that ended after the first `told`, which it counts on.
void print_frames(const v1::ReconstructionStatus& status, int& told, bool json) {
  for (; told < status.frames_size(); ++told) {
    const v1::SequenceFrame& frame = status.frames(told);
    if (frame.state() != State::DONE && frame.state() != State::FAILED) return;
    std::printf("%s\n",
                json
                    ? json_line(frame).c_str()
                    : fmt::format("{} of {}: {}", told + 1, status.frames_size(), frame_line(frame)).c_str());
    std::fflush(stdout);
  }
}

void print_advice(const v1::ReconstructionStatus& status) {
  for (const std::string& effect : status.effects()) std::printf("%-10s %s\n", "effect", effect.c_str());
  for (const std::string& found : status.temperature())
    std::printf("%-10s %s\n", "temperature", found.c_str());
  for (const std::string& advice : status.advice()) std::printf("%-10s %s\n", "next step", advice.c_str());
}

void conclude(const v1::ReconstructionStatus& status, bool json) {
  if (json) {
    std::printf("%s\n", json_line(status).c_str());
  } else {
    if (status.frames().empty()) print_advice(status);
    if (status.state() == State::DONE)
      std::printf("%-10s %s after %s\n", "written to", status.result().c_str(),
                  seconds_in_words(status.seconds()).c_str());
  }
  if (status.state() == State::DONE) return;
  std::fprintf(stderr, "emberlock: %s: %s\n", status.session().c_str(),
               status.error().empty() ? status.doing().c_str() : status.error().c_str());
  throw Exit(1);
}

}  // namespace

void reconstruct_by_daemon(const DaemonReconstruction& wanted) {
  Client client = connect_or_leave(wanted.daemon);
  if (wanted.cancel) {
    or_leave(client, client.cancel_reconstruction());
    return;
  }
  const v1::ReconstructionStatus begun = or_leave(client, client.reconstruct(wanted.request));
  const Interrupt interrupt;
  const Progress progress = wanted.json ? Progress() : progress_bar(begun.session());
  v1::ReconstructionStatus last = begun;
  int frames_told = 0;
  double shown = 0;
  or_leave(client, client.watch_status(
                       [&](const v1::DaemonStatus& status) {
                         if (status.reconstruction().id() != begun.id()) return true;
                         last = status.reconstruction();
                         if (last.frames().empty())
                           print_iterations(last, shown, wanted.json);
                         else
                           print_frames(last, frames_told, wanted.json);
                         tell(progress, last.fraction(), last.doing());
                         return last.state() == State::RUNNING;
                       },
                       Interrupt::asked));
  if (last.state() != State::RUNNING) return conclude(last, wanted.json);
  if (Interrupt::asked()) {
    std::fprintf(stderr, "the daemon goes on; `emberlock reconstruct --cancel --daemon` ends it\n");
    throw Exit(1);
  }
  leave(client, {ErrorKind::io, "the daemon ended before it was done"});
}

}  // namespace emberlock::cli
