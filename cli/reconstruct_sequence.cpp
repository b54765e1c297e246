// SPDX-License-Identifier: Apache-2.0
#include "cli/reconstruct_sequence.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <mutex>
#include <new>
#include <numeric>
#include <optional>
#include <string>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "base/output_folder.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "session/frame_range.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

/// The frames of a sequence that are still to be done, handed out to workers; tells what came out of each.
class SequenceOfFrames {
 public:
  SequenceOfFrames(const std::vector<std::uint64_t>& frames, const fs::path& out, const EachFrame& each,
                   bool alone)
      : frames_(frames), out_(out), each_(each), fractions_(frames.size()) {
    if (!alone) bar_ = progress_bar("reconstruct");
  }

  /// What a worker does.
  void work() {
    while (const std::optional<std::size_t> next = take()) {
      const fs::path folder = out_ / fmt::format("frame-{}", frames_[*next]);
      const Progress progress = bar_ ? together(*next) : progress_bar("reconstruct");
      tell(*next, folder, reconstruct(frames_[*next], folder, progress));
    }
  }

  [[nodiscard]] Status finding() const {
    if (failed_ == 0 && tried_ == frames_.size()) return {};
    return Error{ErrorKind::refused,
                 fmt::format("of {} frames {} failed and {} were not tried", frames_.size(), failed_,
                             frames_.size() - tried_),
                 out_.string(), "Each of them is told above"};
  }
  [[nodiscard]] std::size_t done() const { return told_ - failed_; }

 private:
  [[nodiscard]] std::string name(std::size_t i) const {
    return fmt::format("frame {} ({} of {})", frames_[i], i + 1, frames_.size());
  }
  [[nodiscard]] bool hopeless() const { return failed_ == told_ && failed_ >= session::kFailuresAtStart; }

  [[nodiscard]] Result<Written> reconstruct(std::uint64_t frame, const fs::path& folder,
                                            const Progress& progress) const try {
    return each_.reconstruct(frame, folder, progress);
  } catch (const std::bad_alloc&) {
    return Error{ErrorKind::refused, "not enough memory", folder.string(),
                 "Give a smaller --at-once, or fewer --voxels"};
  } catch (const std::exception& e) {  // one frame's failure ends neither the others nor the program
    return Error{ErrorKind::refused, e.what(), folder.string()};
  }

  std::optional<std::size_t> take() {
    const std::lock_guard lock(mutex_);
    if (tried_ == frames_.size() || Interrupt::asked() || hopeless()) return std::nullopt;
    if (!bar_) std::fprintf(stderr, "%s\n", name(tried_).c_str());
    return tried_++;
  }

  Progress together(std::size_t i) {
    return [this, i](double fraction, std::string_view doing) {
      const std::lock_guard lock(mutex_);
      fractions_[i] = fraction;
      show(fmt::format("{}: {}", name(i), doing));
    };
  }
  void show(const std::string& doing) const {
    const double sum = std::accumulate(fractions_.begin(), fractions_.end(), 0.0);
    bar_(sum / static_cast<double>(fractions_.size()), doing);
  }

  void tell(std::size_t i, const fs::path& folder, const Result<Written>& written) {
    const std::lock_guard lock(mutex_);
    if (bar_) std::fprintf(stderr, "\n%s\n", name(i).c_str());
    const Status done = written ? each_.tell(*written, folder) : Status(written.error());
    ++told_;
    if (done.ok()) return;
    ++failed_;
    std::fprintf(stderr, "emberlock: %s: %s\n", name(i).c_str(), done.error().message().c_str());
  }

  const std::vector<std::uint64_t>& frames_;
  const fs::path& out_;
  const EachFrame& each_;
  std::mutex mutex_;  // guards what follows, and what is printed
  Progress bar_;      // of all frames; without it each has its own
  std::vector<double> fractions_;
  std::size_t tried_ = 0, told_ = 0, failed_ = 0;
};

int all_threads(int threads) {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace

int threads_of_each(int threads, int at_once) { return std::max(1, all_threads(threads) / at_once); }

void reconstruct_sequence(const std::vector<std::uint64_t>& frames, const fs::path& out, int at_once,
                          const EachFrame& each) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  SequenceOfFrames sequence(frames, out, each, at_once == 1);
  // A frame that fails takes away the folders that it made: they must not be another frame's.
  std::error_code ec;
  const MadeFolders parents = or_fail(MadeFolders::create(fs::absolute(out, ec)));
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < at_once; ++i) others.emplace_back([&] { sequence.work(); });
    sequence.work();
  }
  if (sequence.done() > 0) {
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    std::fprintf(stderr, "%zu frames in %.1f s, %d at once: %.2f s a frame\n", sequence.done(), seconds,
                 at_once, seconds / static_cast<double>(sequence.done()));
  }
  or_fail(sequence.finding());
}

}  // namespace emberlock::cli
