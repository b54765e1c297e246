// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/result.h"
#include "cli/commands.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

/// The page of a result's folder, or the page itself.
Result<fs::path> page_of(const fs::path& result) {
  std::error_code ec;
  if (fs::is_regular_file(result, ec)) return fs::absolute(result);
  for (const char* name : {"report.html", "index.html", "import.html"})
    if (fs::is_regular_file(result / name, ec)) return fs::absolute(result / name);
  if (!fs::exists(result, ec))
    return Error{ErrorKind::bad_input, "there is no such file or folder", result.string()};
  return Error{ErrorKind::bad_input, "there is no report page in it", result.string(),
               "Give the folder that --out named, or a page"};
}

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): nothing sets variables here
  return value != nullptr && *value != '\0';
}

/// The exit code of a program that ends at once; 0 of one that goes on.
Result<int> start(const char* program, const std::string& argument) {
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO})
    ::posix_spawn_file_actions_addopen(&actions, fd, "/dev/null", O_WRONLY, 0);
  std::string name = program;
  std::string word = argument;
  char* const words[] = {name.data(), word.data(), nullptr};
  pid_t child = -1;
  const int failed = ::posix_spawnp(&child, program, &actions, nullptr, words, environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return Error{ErrorKind::io, std::generic_category().message(failed), program};
  constexpr auto kPause = std::chrono::milliseconds(20);
  for (auto waited = kPause; waited < std::chrono::seconds(2); waited += kPause) {
    int status = 0;
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended == child) return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
    if (ended < 0 && errno != EINTR) return 0;
    std::this_thread::sleep_for(kPause);
  }
  return 0;
}

void view(const fs::path& result) {
  const fs::path page = or_fail(page_of(result));
  std::printf("%s\n", page.c_str());
  std::fflush(stdout);
  if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY")) return;
  const Result<int> ended = start("xdg-open", page.string());
  if (!ended.ok() || *ended != 0)
    fail({ErrorKind::io, "no browser could be started", page.string(), "Open this file in one"});
}

}  // namespace

void add_view(CLI::App& app) {
  auto result = std::make_shared<std::string>();
  CLI::App* verb = app.add_subcommand(
      "view", "Opens a result's report page in the browser; without a display it only says where it is");
  verb->add_option("RESULT", *result, "The folder of a result, or a page")->required();
  verb->callback([result] { view(*result); });
}

}  // namespace emberlock::cli
