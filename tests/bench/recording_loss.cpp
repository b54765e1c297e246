// SPDX-License-Identifier: Apache-2.0
// What is left of a recording whose recorder is killed, or whose power is cut: at most a second may be lost,
// and nothing that the status called recorded.
//   bench_recording_loss [--kills 100] [--cuts 20] [--cameras 4] [--size 640x480] [--rate 24] [--busy N]
//   [--folder DIR]
// Kills and cuts come at random instants, FFV1 and uncompressed in turn, while N threads (as many as there
// are processors) keep the machine busy. Cuts need root and loop devices: a recording goes to an ext4 in a
// file, which is copied in its midst (tests/support/loop_disk.h), mounted with its journal replayed, and
// salvaged. Prints a line a trial and a summary; exits 1 where more than a second was lost, or something
// called recorded.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "tests/support/loop_disk.h"
#include "tests/support/loss_trial.h"

namespace {

using namespace emberlock;
namespace fs = std::filesystem;

struct Plan {
  int kills = 100;
  int cuts = 20;
  unsigned busy = std::thread::hardware_concurrency();
  std::string size = "640x480";
  std::string folder;
  unsigned seed = 1;
  test::TrialFleet fleet;
};

struct Summary {
  int trials = 0;
  int bad = 0;
  double worst_s = 0;
  double sum_s = 0;
  double oldest_s = 0;
  std::uint64_t recorded_missing = 0;
  std::uint64_t arrived = 0;
  std::uint64_t kept = 0;
  std::uint64_t dropped = 0;
};

constexpr double kMostLost = 1;  // seconds

void count(Summary& summary, const char* what, int number, const test::TrialFleet& fleet, double seconds,
           const test::TrialOutcome& o) {
  ++summary.trials;
  summary.worst_s = std::max(summary.worst_s, o.lost_s);
  summary.sum_s += o.lost_s;
  summary.oldest_s = std::max(summary.oldest_s, o.age_s);
  summary.recorded_missing += o.recorded_missing;
  summary.arrived += o.arrived;
  summary.kept += o.kept;
  summary.dropped += o.dropped;
  const bool bad = !o.wrong.empty() || o.recorded_missing > 0 || o.lost_s > kMostLost;
  if (bad) ++summary.bad;
  std::printf(
      "%s %3d %s after %.2f s: %llu came, %llu kept, %llu told lost, %.3f s lost, the last kept %.2f s old, "
      "%llu called recorded "
      "missing%s%s\n",
      what, number, fleet.encoding == session::Encoding::ffv1 ? "ffv1" : "raw ", seconds,
      static_cast<unsigned long long>(o.arrived), static_cast<unsigned long long>(o.kept),
      static_cast<unsigned long long>(o.dropped), o.lost_s, o.age_s,
      static_cast<unsigned long long>(o.recorded_missing), bad ? "  BAD " : "", o.wrong.c_str());
  std::fflush(stdout);
}

void print(const char* what, const Summary& s) {
  if (s.trials == 0) return;
  std::printf(
      "%d %s: %.3f s lost at most, %.3f s on average, the last kept frame at most %.2f s old; %llu called "
      "recorded missing; %llu frames came, %llu "
      "kept, %llu "
      "told lost meanwhile; %d bad\n",
      s.trials, what, s.worst_s, s.sum_s / s.trials, s.oldest_s,
      static_cast<unsigned long long>(s.recorded_missing), static_cast<unsigned long long>(s.arrived),
      static_cast<unsigned long long>(s.kept), static_cast<unsigned long long>(s.dropped), s.bad);
}

/// Threads that leave no processor idle, while it is on.
class Busy {
 public:
  explicit Busy(unsigned threads) {
    for (unsigned i = 0; i < threads; ++i) {
      threads_.emplace_back([this](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          on_.wait(false);
          while (on_ && !stop.stop_requested()) {
          }
        }
      });
    }
  }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;
  ~Busy() {
    for (std::jthread& thread : threads_) thread.request_stop();
    turn(true);
    for (std::jthread& thread : threads_) thread.join();
  }
  void turn(bool on) {
    on_ = on;
    on_.notify_all();
  }

 private:
  std::atomic<bool> on_{false};
  std::vector<std::jthread> threads_;
};

Summary run(const Plan& plan, const fs::path& folder, bool cut, Busy& busy) {
  Summary summary;
  std::mt19937 random(plan.seed);
  std::uniform_real_distribution<double> length(1.0, 4.0);
  for (int i = 0; i < (cut ? plan.cuts : plan.kills); ++i) {
    test::TrialFleet fleet = plan.fleet;
    fleet.encoding = i % 2 == 0 ? session::Encoding::ffv1 : session::Encoding::raw_nut;
    const double seconds = length(random);
    fs::create_directories(folder);
    if (cut) {
      const test::DiskToCut disk(folder, 384);
      busy.turn(true);
      std::unique_ptr<test::LoopDisk> left;
      const auto outcome = test::lose_a_recording(disk.at() / "sessions" / "s", fleet, seconds, [&](pid_t) {
        left = disk.cut();
        return left->at() / "sessions" / "s";
      });
      count(summary, "cut ", i, fleet, seconds, outcome);
    } else {
      busy.turn(true);
      const auto outcome = test::lose_a_recording(folder / "s", fleet, seconds, [&](pid_t recorder) {
        ::kill(recorder, SIGKILL);
        busy.turn(false);
        return folder / "s";
      });
      count(summary, "kill", i, fleet, seconds, outcome);
    }
    fs::remove_all(folder);
  }
  return summary;
}

}  // namespace

int main(int argc, char** argv) {
  Plan plan;
  CLI::App app("What killed recorders and power cuts leave");
  app.add_option("--kills", plan.kills)->check(CLI::NonNegativeNumber);
  app.add_option("--cuts", plan.cuts)->check(CLI::NonNegativeNumber);
  app.add_option("--cameras", plan.fleet.cameras)->check(CLI::Range(std::size_t{1}, test::kMostCameras));
  app.add_option("--size", plan.size);
  app.add_option("--rate", plan.fleet.rate_hz)->check(CLI::PositiveNumber);
  app.add_option("--busy", plan.busy);
  app.add_option("--seed", plan.seed);
  app.add_option("--folder", plan.folder);
  CLI11_PARSE(app, argc, argv);
  if (std::sscanf(plan.size.c_str(), "%dx%d", &plan.fleet.size.width, &plan.fleet.size.height) != 2) return 2;
  const fs::path base = plan.folder.empty() ? fs::temp_directory_path() : fs::path(plan.folder);
  const fs::path folder = base / ("emberlock-loss-" + std::to_string(::getpid()));
  try {
    if (plan.cuts > 0) test::mount_for_this_process_alone();
  } catch (const std::exception& e) {
    std::printf("%s: run as root, or with --cuts 0\n", e.what());
    return 1;
  }
  Busy busy(plan.busy);
  try {
    const Summary kills = run(plan, folder, false, busy);
    const Summary cuts = run(plan, folder, true, busy);
    print("kills", kills);
    print("power cuts", cuts);
    return kills.bad + cuts.bad == 0 ? 0 : 1;
  } catch (const std::exception& e) {
    std::printf("%s\n", e.what());
    return 1;
  }
}
