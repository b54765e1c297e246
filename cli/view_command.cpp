// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/file.h"
#include "base/kind_of_file.h"
#include "base/result.h"
#include "cli/commands.h"
#include "cli/result_files.h"
#include "cli/viewer_file.h"

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

/// In a browser, where there is a display.
void open_page(const fs::path& page) {
  std::printf("%s\n", page.c_str());
  std::fflush(stdout);
  if (!is_set("DISPLAY") && !is_set("WAYLAND_DISPLAY")) return;
  const Result<int> ended = start("xdg-open", page.string());
  if (!ended.ok() || *ended != 0)
    fail({ErrorKind::io, "no browser could be started", page.string(), "Open this file in one"});
}

struct ViewArguments {
  std::string result, out;
  ViewerOptions options;
  bool report = false;
};

/// The volumes that a result has; none of a page, and of what is only a report.
Result<std::vector<ResultVolume>> volumes_to_view(const fs::path& result) {
  std::error_code ec;
  if (fs::is_regular_file(result, ec) && lower_extension(result) != ".vdb")
    return std::vector<ResultVolume>();
  Result<std::vector<ResultVolume>> volumes = volumes_of(result);
  if (!volumes.ok() && page_of(result).ok()) return std::vector<ResultVolume>();
  return volumes;
}

Status check_used(const ViewArguments& a, const Verb& verb, bool viewer) {
  if (viewer) return {};
  for (const char* option : {"--out", "--float32", "--input", "--rig"})
    if (verb.is_given(option))
      return Error{ErrorKind::bad_input, "changes nothing here: there is no volume to show", option,
                   a.report ? "Leave --report away" : "Name the folder of a reconstruction"};
  return {};
}

/// Where the viewer's page goes unasked: into the result's folder.
fs::path viewer_place(const ViewArguments& a) {
  if (!a.out.empty()) return fs::absolute(a.out);
  std::error_code ec;
  const fs::path folder =
      fs::is_directory(a.result, ec) ? fs::path(a.result) : fs::path(a.result).parent_path();
  return fs::absolute(folder / "view.html");
}

Status view(const ViewArguments& a, const Verb& verb) try {
  std::vector<ResultVolume> volumes;
  if (!a.report) {
    EMBERLOCK_ASSIGN_OR_RETURN(volumes, volumes_to_view(a.result));
  }
  EMBERLOCK_RETURN_IF_ERROR(check_used(a, verb, !volumes.empty()));
  const Result<report::ViewerProgram> program = viewer_program();
  const bool instead = !program.ok() && a.out.empty() && page_of(a.result).ok();
  if (!volumes.empty() && instead)
    std::fprintf(stderr, "%-16s %s: this is the report\n", "note", program.error().what.c_str());
  if (volumes.empty() || instead) {
    EMBERLOCK_ASSIGN_OR_RETURN(const fs::path page, page_of(a.result));
    open_page(page);
    return {};
  }
  if (!program.ok()) return program.error();
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string html, viewer_html(a.result, volumes, a.options, *program));
  const fs::path page = viewer_place(a);
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(page, html));
  if (a.out.empty())
    open_page(page);
  else
    std::printf("%s\n", page.c_str());
  return {};
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory for all its volumes", a.result,
               "Give one frame's folder"};
}

}  // namespace

void add_view(const Verb& app) {
  auto arguments = std::make_shared<ViewArguments>();
  ViewArguments& a = *arguments;
  const Verb verb = app.add_verb(
      "view",
      "Shows a result in the browser: the volume to turn, in slices and over time, its cameras and errors; "
      "of results without a volume the report. Without a display it only says where the page is");
  verb.add_option("RESULT", a.result, "The folder of a result, a volume.vdb, or a page").require();
  verb.add_option("--out", a.out,
                  "HTML file for the page, which needs no other file; it isn't opened then [view.html in "
                  "the result's folder]");
  verb.add_flag("--report", a.report, "Opens the report page instead");
  verb.add_flag_function(
      "--float32", [&a] { a.options.stored = report::Stored::float32; },
      "Holds the values bit for bit; otherwise as halves, to 0.05 %, in a smaller page");
  verb.add_option("--input", a.options.input,
                  "Session or transforms.json whose cameras are shown [what was reconstructed]");
  verb.add_option("--rig", a.options.rig, "rig.json that stands before a session's own calibration");
  verb.set_action([arguments, verb] { or_fail(view(*arguments, verb)); });
}

}  // namespace emberlock::cli
