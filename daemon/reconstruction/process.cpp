// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/process.h"

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <system_error>

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace emberlock::daemon {
namespace {

Error system_error(int code, const std::string& action, const std::string& program) {
  return {ErrorKind::io, action + ": " + std::generic_category().message(code), program,
          "Check that the program is there and may be run"};
}

struct Pipe {
  UniqueFd read;  ///< doesn't block
  UniqueFd write;
};

Result<Pipe> make_pipe(const std::string& program) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return system_error(errno, "cannot make a pipe", program);
  Pipe pipe{UniqueFd(ends[0]), UniqueFd(ends[1])};
  ::fcntl(pipe.read.get(), F_SETFL, O_NONBLOCK);
  return pipe;
}

/// A file in memory that holds these bytes.
Result<UniqueFd> make_input(std::string_view bytes, const std::string& program) {
  UniqueFd file(::memfd_create("input", MFD_CLOEXEC));
  if (!file) return system_error(errno, "cannot be given its input", program);
  while (!bytes.empty()) {
    const ssize_t n = ::write(file.get(), bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error(errno, "cannot be given its input", program);
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  ::lseek(file.get(), 0, SEEK_SET);
  return file;
}

/// glibc 2.36 declares its own for C alone.
int pidfd_open(pid_t pid) { return static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)); }

/// posix_spawn's two parameters, destroyed as they must be.
class SpawnSettings {
 public:
  SpawnSettings(const UniqueFd& input, const Pipe& messages, const Pipe& errors) {
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, input.get(), STDIN_FILENO);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions, errors.write.get(), STDERR_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, messages.write.get(), ChildProcess::kMessagesFd);
    ::posix_spawn_file_actions_addclosefrom_np(&actions, ChildProcess::kMessagesFd + 1);
    ::posix_spawnattr_init(&attributes);
    sigset_t none;
    sigset_t all;
    ::sigemptyset(&none);
    ::sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes, &none);
    ::posix_spawnattr_setsigdefault(&attributes, &all);
    ::posix_spawnattr_setpgroup(&attributes, 0);
    ::posix_spawnattr_setflags(&attributes,
                               POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSettings() {
    ::posix_spawnattr_destroy(&attributes);
    ::posix_spawn_file_actions_destroy(&actions);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  posix_spawn_file_actions_t actions{};
  posix_spawnattr_t attributes{};
};

}  // namespace

Result<ChildProcess> ChildProcess::spawn(const std::vector<std::string>& command, int niceness,
                                         std::string_view input) {
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd held, make_input(input, command[0]));
  return spawn(command, niceness, held);
}

Result<ChildProcess> ChildProcess::spawn_fed(const std::vector<std::string>& command, int niceness) {
  int ends[2];  // of a socket, which tells of a child that is gone without a signal
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    return system_error(errno, "cannot be fed", command[0]);
  UniqueFd ours(ends[0]);
  const UniqueFd its(ends[1]);
  ::fcntl(ours.get(), F_SETFL, O_NONBLOCK);
  EMBERLOCK_ASSIGN_OR_RETURN(ChildProcess process, spawn(command, niceness, its));
  process.input_ = std::move(ours);
  return process;
}

Result<ChildProcess> ChildProcess::spawn(const std::vector<std::string>& command, int niceness,
                                         const UniqueFd& input) {
  EMBERLOCK_ASSIGN_OR_RETURN(Pipe messages, make_pipe(command[0]));
  EMBERLOCK_ASSIGN_OR_RETURN(Pipe errors, make_pipe(command[0]));
  std::vector<char*> words;
  words.reserve(command.size() + 1);
  for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const SpawnSettings settings(input, messages, errors);
  pid_t pid = -1;
  const int code =
      ::posix_spawnp(&pid, words[0], &settings.actions, &settings.attributes, words.data(), environ);
  if (code != 0) return system_error(code, "cannot be started", command[0]);
  ::setpriority(PRIO_PGRP, static_cast<id_t>(pid), niceness);
  ChildProcess process(pid, UniqueFd(pidfd_open(pid)), std::move(messages.read), std::move(errors.read));
  if (!process.exited_) return system_error(errno, "cannot be watched", command[0]);
  return process;
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) reap();
}

void ChildProcess::signal(int signal) const { ::kill(-pid_, signal); }

ChildProcess::Exit ChildProcess::reap() {
  signal(SIGKILL);  // until it is waited for, its number is nobody else's
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  Exit exit;
  if (WIFEXITED(status)) exit.code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) exit.signal = WTERMSIG(status);
  return exit;
}

}  // namespace emberlock::daemon
