// SPDX-License-Identifier: Apache-2.0
// What a batch costs beside its frames, and what becomes of it on a thousand ranks.
//   bench_batch ledger [--chunks N] [--folder FOLDER]   threads, as ranks, take and finish empty chunks
//   bench_batch ranks --first S --next S [--frames N] [--chunk N] [--start S] [--tell S] [--request S]
// `ranks` needs what was measured: seconds of a chunk's first frame and of each further one (frames.csv), of
// a rank's start and of the report at the end (the same command again on a batch that is done), and of one
// request to the shared folder (`ledger`, or the file server's own). It prints a table for the guide.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "recon/batch/ledger.h"
#include "recon/batch/plan.h"
#include "recon/batch/rank.h"
#include "report/batch_report.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;

double clock_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

recon::Life all_live(const std::string& /*worker*/) { return recon::Life::alive; }

/// Seconds until `ranks` threads have taken and finished all chunks, begun at places of their own or all at
/// the first.
double time_of_ledger(const fs::path& folder, const std::vector<std::string>& chunks, int ranks,
                      bool places) {
  fs::remove_all(folder);
  if (!recon::Ledger::create(folder, "made", "{}", chunks).ok())
    throw CLI::RuntimeError("can't write there", 1);
  const double begin = clock_seconds();
  std::vector<std::thread> threads;
  for (int r = 0; r < ranks; ++r)
    threads.emplace_back([&, r] {
      recon::Ledger ledger(folder, chunks, "rank-" + std::to_string(r));
      for (;;) {
        const auto claim = ledger.take(all_live, static_cast<std::size_t>(places ? r : 0));
        if (!claim || !*claim || !ledger.finish(**claim)) break;
      }
    });
  for (std::thread& thread : threads) thread.join();
  const double took = clock_seconds() - begin;
  fs::remove_all(folder);
  return took;
}

void print_ledger(const fs::path& folder, int chunks) {
  std::vector<std::string> names;
  for (int c = 0; c < chunks; ++c) names.push_back(fmt::format("{:07}", c));
  std::printf("ranks   ms a chunk   all asking for the first ones\n");
  for (const int ranks : {1, 2, 8, 64, 512}) {
    const double apart = time_of_ledger(folder, names, ranks, true);
    const double same = time_of_ledger(folder, names, ranks, false);
    std::printf("%5d   %10.3f   %10.3f\n", ranks, 1e3 * apart / chunks, 1e3 * same / chunks);
  }
}

struct Parts {
  double first = 0, next = 0, start = 0, tell = 0;
  int frames = 1440, chunk = 0;
  double requests = 0;  ///< to the shared folder, a frame
  double server = 1e9;  ///< requests a second that it answers
};

void print_ranks(const Parts& parts) {
  const int chunk =
      parts.chunk > 0 ? parts.chunk : recon::usual_chunk(static_cast<std::size_t>(parts.frames));
  std::vector<Seconds> chunks;
  for (int left = parts.frames; left > 0; left -= chunk)
    chunks.emplace_back(parts.first + (std::min(left, chunk) - 1) * parts.next);
  const double frames = report::time_on(1, chunks).value();
  const double requests = parts.frames * parts.requests;
  const double alone = parts.start + std::max(frames, requests / parts.server) + parts.tell;
  std::printf("%d frames in %zu chunks of %d\n", parts.frames, chunks.size(), chunk);
  std::printf(
      "| ranks | seconds | times as fast | requests a second, at work | idle |\n|---|---|---|---|---|\n");
  for (const std::size_t ranks : {1, 2, 8, 32, 64, 128, 256, 512, 1000}) {
    recon::Rank rank;
    rank.count = static_cast<int>(ranks);
    const double work = std::max(report::time_on(ranks, chunks).value(), requests / parts.server);
    const double total = parts.start + work + parts.tell;
    // An idle rank lists four folders, and asks twice for each chunk's owner.
    const double idle = ranks > chunks.size() ? static_cast<double>(ranks - chunks.size()) : 0;
    const double looks = idle / recon::idle_wait(rank, Seconds(60)).value();
    std::printf("| %zu | %.1f | %.1f | %.0f | %.0f |\n", ranks, total, alone / total, requests / work,
                looks * (4 + 2 * static_cast<double>(chunks.size())));
  }
}

}  // namespace
}  // namespace emberlock

int main(int argc, char** argv) {
  using namespace emberlock;
  CLI::App app("What a batch costs beside its frames");
  app.require_subcommand(1);
  std::string folder = "out/batch-bench";
  int chunks = 288;
  CLI::App* ledger = app.add_subcommand("ledger", "Takes and finishes empty chunks");
  ledger->add_option("--folder", folder)->capture_default_str();
  ledger->add_option("--chunks", chunks)->check(CLI::Range(1, 100000))->capture_default_str();
  Parts parts;
  CLI::App* ranks = app.add_subcommand("ranks", "Up to a thousand ranks, from measured parts");
  ranks->add_option("--first", parts.first)->required();
  ranks->add_option("--next", parts.next)->required();
  ranks->add_option("--frames", parts.frames)->check(CLI::Range(1, 100000))->capture_default_str();
  ranks->add_option("--chunk", parts.chunk);
  ranks->add_option("--start", parts.start);
  ranks->add_option("--tell", parts.tell);
  ranks->add_option("--requests", parts.requests)->check(CLI::NonNegativeNumber);
  ranks->add_option("--server", parts.server)->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  if (*ledger) {
    fs::create_directories(fs::path(folder).parent_path());
    print_ledger(folder, chunks);
  } else {
    print_ranks(parts);
  }
}
