// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cli/batch_result.h"
#include "cli/batch_run.h"
#include "cli/batch_slurm.h"
#include "cli/commands.h"
#include "cli/reconstruct_arguments.h"
#include "cli/sequence_state.h"
#include "recon/batch/ledger.h"
#include "recon/batch/plan.h"
#include "recon/batch/pulse.h"
#include "recon/batch/rank.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

/// Options that say how a rank works, or are compared by themselves: results don't depend on them, but for
/// the device, which ranks may have each of its own.
const std::set<std::string>& of_a_run() {
  static const std::set<std::string> names{"SESSION",   "--out",    "--frames",   "--every", "--chunk",
                                           "--threads", "--device", "--patience", "--help"};
  return names;
}

void add_batch_options(const Verb& verb, BatchArguments& b) {
  ReconstructArguments& a = b.reconstruct;
  verb.add_option("SESSION", a.input, "A recorded session's folder");
  add_range_options(verb, a);
  verb.add_option("--out", a.out, "Folder for the volumes, on a file system that all ranks share");
  verb.add_option("--chunk", b.chunk,
                  "Frames that one rank does in turn, the first from darkness, each further one from where "
                  "the one before ended [a 64th of all, 5 to 20]")
      .check_range(1, 1000000);
  verb.add_option("--patience", b.patience_s,
                  "Seconds until a rank of another machine that isn't heard of counts as dead")
      .check_range(1.0, 86400.0)
      .show_default();
  add_volume_options(verb, a);
  add_solve_options(verb, a);
  for (const char* name : {"--budget", "--target-rmse"})  // what a clock ends never repeats
    verb.remove_option(name);
  add_picture_options(verb, a);
  add_quantity_options(verb, a);
  add_certificate_options(verb, a.certificate);
}

void check_given(const BatchArguments& b) {
  if (b.reconstruct.input.empty()) throw UsageError("SESSION is required");
  if (!b.reconstruct.last_frame) throw UsageError("--frames is required");
  if (b.reconstruct.out.empty()) throw UsageError("--out is required");
}

std::string absolute(const std::string& path) {
  std::error_code ec;
  return fs::absolute(path, ec).lexically_normal().string();
}

// --- submit

struct SubmitArguments {
  BatchArguments batch;
  SlurmJob job;
};

/// A rank's command line, which runs in another folder.
std::vector<std::string> words_of(const SubmitArguments& s, const Verb& verb,
                                  const std::set<std::string>& of_slurm) {
  std::error_code ec;
  std::vector<std::string> words{fs::read_symlink("/proc/self/exe", ec).string(), "batch",
                                 absolute(s.batch.reconstruct.input)};
  for (const Option& option : verb.given_options()) {
    const std::string name = option.name();
    if (name == "SESSION" || of_slurm.contains(name)) continue;
    words.push_back(name);
    if (option.takes_value()) words.push_back(value_of(option));  // else a flag
  }
  return words;
}

void submit_command(SubmitArguments& s, const Verb& verb) {
  static const std::set<std::string> kOfSlurm{"--nodes", "--ranks", "--gpus", "--cpus", "--time", "--sbatch"};
  check_given(s.batch);
  s.batch.options = given_options(verb, of_a_run());
  for (const std::string& name : kOfSlurm) s.batch.options.erase(name);
  or_fail(asked_plan(s.batch));
  const fs::path out = absolute(s.batch.reconstruct.out);
  const std::vector<std::string> words = words_of(s, verb, kOfSlurm);
  const std::string job = or_fail(submit(sbatch_script(s.job, words, out), out));
  std::printf("%-16s %s\n", "job", job.c_str());
  std::printf("%-16s emberlock batch status %s\n", "look at", out.c_str());
}

void add_submit(const Verb& batch) {
  auto arguments = std::make_shared<SubmitArguments>();
  const Verb verb = batch.add_verb("submit", "Writes a script for Slurm's sbatch, and submits it");
  add_batch_options(verb, arguments->batch);
  SlurmJob& job = arguments->job;
  verb.add_option("--nodes", job.nodes, "Machines").check_range(1, 100000).show_default();
  verb.add_option("--ranks", job.ranks, "Ranks on each of them").check_range(1, 1024).show_default();
  verb.add_option("--gpus", job.gpus, "GPUs of each of them: one a rank, ranks beyond them use the CPU")
      .check_range(0, 1024)
      .show_default();
  verb.add_option("--cpus", job.cpus, "CPU threads of each rank [Slurm's rule]").check_range(1, 1024);
  verb.add_option("--time", job.time, "Time limit, as sbatch takes it, such as 2:00:00 [the partition's]");
  verb.add_option("--sbatch", job.further,
                  "A further option of sbatch's, such as --sbatch=--partition=NAME; may be given again")
      .take_all_values();
  verb.set_action([arguments, verb] { submit_command(*arguments, verb); });
}

// --- status

void status_command(const std::string& folder) {
  const fs::path out = folder;
  const fs::path place = ledger_of(out);
  const auto text = or_fail(recon::Ledger::read_plan(place));
  const std::string state = [&] {
    if (text) return std::string();
    return or_fail(job_state(out));
  }();
  if (!text && state.empty())
    fail({ErrorKind::bad_input, "holds no batch", folder, "Name the --out of `emberlock batch`"});
  if (text) {
    const recon::BatchPlan plan = or_fail(recon::parse_plan(*text, (place / "plan.json").string()));
    std::vector<std::string> names;
    for (const recon::Chunk& chunk : recon::chunks_of(plan)) names.push_back(chunk.name);
    const recon::Ledger ledger(place, names, "");
    for (const std::string& words : batch_words(or_fail(told_of(ledger, plan))))
      std::printf("%-16s %s\n", "batch", words.c_str());
    std::printf("%-16s %zu of %zu\n", "frames tried", frames_done(ledger, plan), plan.frames.size());
    for (const auto& [name, worker] : recon::workers_in(place / "workers")) {
      const auto runs = recon::runs_here(worker);
      std::printf("%-16s %d on %s, %s%s\n", "rank", worker.rank, worker.host.c_str(), worker.device.c_str(),
                  runs && !*runs ? ": has died" : "");
    }
  }
  const std::string job = text ? or_fail(job_state(out)) : state;
  if (!job.empty()) std::printf("%-16s %s\n", "job", job.c_str());
}

void add_batch_status(const Verb& batch) {
  auto folder = std::make_shared<std::string>();
  const Verb verb =
      batch.add_verb("status", "How far a batch is, who works on it, and what Slurm says of its job");
  verb.add_option("DIR", *folder, "The batch's --out").require();
  verb.set_action([folder] { status_command(*folder); });
}

}  // namespace

void add_batch(const Verb& app) {
  auto arguments = std::make_shared<BatchArguments>();
  const Verb verb = app.add_verb(
      "batch",
      "Reconstructs a session's frames on many ranks, which mpirun or Slurm starts; goes on where it ended");
  add_batch_options(verb, *arguments);
  add_submit(verb);
  add_batch_status(verb);
  verb.allow_verb();
  verb.set_action([arguments, verb, app] {
    arguments->reconstruct.certificate.program = app.version();
    if (verb.verb_is_given()) return;
    check_given(*arguments);
    arguments->options = given_options(verb, of_a_run());
    run_batch_rank(*arguments,
                   recon::rank_from([](const char* name) -> const char* { return std::getenv(name); }));
  });
}

}  // namespace emberlock::cli
