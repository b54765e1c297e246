// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include <unistd.h>

#include "cli/commands.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

constexpr const char* kPaperProgram = "emberlock-paper";

/// Replaces this process with the paper's program. That program is built on request, so this one doesn't link
/// it. The search goes through this program's folder (libexec/emberlock), bin/ next to it, and PATH.
[[noreturn]] void start_paper_program(std::vector<std::string> words) {
  words.insert(words.begin(), kPaperProgram);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::error_code unread;
  const fs::path folder = fs::read_symlink("/proc/self/exe", unread).parent_path();
  for (const fs::path& place : {folder, folder.parent_path().parent_path() / "bin"})
    if (const fs::path program = place / kPaperProgram; ::access(program.c_str(), X_OK) == 0)
      ::execv(program.c_str(), argv.data());
  ::execvp(kPaperProgram, argv.data());
  const std::string what = errno == ENOENT ? "this program isn't installed"
                                           : "can't be started: " + std::generic_category().message(errno);
  fail({ErrorKind::refused, what, kPaperProgram,
        "build it with `scripts/build release emberlock-paper`, then put it on PATH or next to emberlock"});
}

}  // namespace

void add_evaluate(const Verb& app) {
  const Verb verb = app.add_verb("evaluate", "Compares methods on flames with known truth");
  verb.require_verb();
  verb.add_verb("paper",
                "Repeats the source paper's tables and figures; emberlock-paper, a program that is built on "
                "request, takes all options. `emberlock evaluate paper --help` lists them.")
      .set_action_on_words(start_paper_program);
}

}  // namespace emberlock::cli
