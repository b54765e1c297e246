// SPDX-License-Identifier: Apache-2.0
#include "cli/batch_slurm.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/file.h"
#include "base/output_folder.h"
#include "base/unique_fd.h"
#include "cli/shell_word.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

struct Ran {
  int status = 0;
  std::string output;  ///< stdout and stderr
};

/// Error: it isn't there.
Result<Ran> run_program(const std::vector<std::string>& words) {
  const auto failed = [&](int error) {
    const std::string cause = error == ENOENT ? "isn't installed here" : std::strerror(error);
    return Error{ErrorKind::refused, cause, words.front(), "Run this where Slurm's commands are installed"};
  };
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return failed(errno);
  const UniqueFd read_end(ends[0]);
  UniqueFd write_end(ends[1]);
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO})
    ::posix_spawn_file_actions_adddup2(&actions, write_end.get(), fd);
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return failed(error);
  write_end = UniqueFd();
  Ran ran;
  char text[4096];
  for (;;) {
    const ssize_t count = ::read(read_end.get(), text, sizeof text);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    ran.output.append(text, static_cast<std::size_t>(count));
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  ran.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  while (!ran.output.empty() && ran.output.back() == '\n') ran.output.pop_back();
  return ran;
}

fs::path folder_of(const fs::path& out) { return out / "slurm"; }

/// Where sbatch fills in the job's number, it takes a "%" of the folder's name for more of that.
std::string pattern_of_output(const fs::path& out) {
  std::string pattern;
  for (const char c : folder_of(out).string()) pattern += c == '%' ? std::string("%%") : std::string(1, c);
  return pattern + "/job-%j.txt";
}

}  // namespace

std::string sbatch_script(const SlurmJob& job, const std::vector<std::string>& words, const fs::path& out) {
  std::string script =
      "#!/bin/bash\n"
      "# Made by `emberlock batch submit`. The same job may be submitted again: it goes on where it ended.\n"
      "#SBATCH --job-name=emberlock\n";
  const auto ask = [&](const std::string& option) { script += "#SBATCH " + option + "\n"; };
  ask(fmt::format("--nodes={}", job.nodes));
  ask(fmt::format("--ntasks-per-node={}", job.ranks));
  if (job.gpus > 0) ask(fmt::format("--gpus-per-node={}", job.gpus));
  if (job.cpus > 0) ask(fmt::format("--cpus-per-task={}", job.cpus));
  if (!job.time.empty()) ask("--time=" + job.time);
  for (const std::string& option : job.further) ask(option);
  ask("--output=" + shell_word(pattern_of_output(out)));
  ask("--open-mode=append");
  ask("--requeue");
  ask("--no-kill");
  ask("--signal=TERM@60");  // before its time is over, so that frames which are done are kept
  script += "exec srun --mpi=none --no-kill --kill-on-bad-exit=0 --wait=0";
  for (const std::string& word : words) script += " " + shell_word(word);
  return script + "\n";
}

Result<std::string> submit(const std::string& script, const fs::path& out) {
  const fs::path folder = folder_of(out);
  EMBERLOCK_ASSIGN_OR_RETURN(const MadeFolders made, MadeFolders::create(folder));
  const fs::path file = folder / "batch.sbatch";
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(file, script));
  EMBERLOCK_ASSIGN_OR_RETURN(const Ran ran, run_program({"sbatch", "--parsable", file.string()}));
  if (ran.status != 0)
    return Error{ErrorKind::refused, "sbatch refused it: " + ran.output, file.string(),
                 "Give what it misses, such as --time or --sbatch=--partition=NAME"};
  const std::string job = ran.output.substr(0, ran.output.find_first_of(";\n"));  // "ID;CLUSTER"
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "job", job + "\n"));
  return job;
}

Result<std::string> job_state(const fs::path& out) {
  std::error_code ec;
  const fs::path file = folder_of(out) / "job";
  if (!fs::exists(file, ec)) return std::string();
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file));
  const std::string job = text.substr(0, text.find('\n'));
  EMBERLOCK_ASSIGN_OR_RETURN(const Ran ran, run_program({"squeue", "--noheader", "--jobs=" + job,
                                                         "--format=%T for %M, %L left, on %D nodes %R"}));
  const bool unknown = ran.output.find("Invalid job id") != std::string::npos;
  if (ran.status != 0 && !unknown)
    return Error{ErrorKind::refused, "squeue failed: " + ran.output, "job " + job};
  if (unknown || ran.output.empty())
    return fmt::format("{} has left the queue; what it said is in {}", job,
                       (folder_of(out) / ("job-" + job + ".txt")).string());
  return job + " " + ran.output;
}

}  // namespace emberlock::cli
