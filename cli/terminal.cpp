// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <unistd.h>

#include "cli/commands.h"
#include "cli/help.h"
#include "cli/progress_lines.h"

namespace emberlock::cli {

int run(const CommandLine& line, int argc, char** argv) {
  try {
    line.parse({argv + 1, argv + argc});
  } catch (const Exit& e) {
    return e.code;
  } catch (const UsageError& e) {
    const std::string wrong = usage_error(line.program(), e);
    if (wrong.empty()) {
      std::printf("%s", help_of_missing_verb(line.program()).c_str());
    } else {
      std::fprintf(stderr, "emberlock: %s\n", wrong.c_str());
    }
    return 2;
  }
  return 0;
}

void fail(const Error& error) {
  std::fprintf(stderr, "emberlock: %s\n", error.message().c_str());
  throw Exit(error.kind == ErrorKind::bad_input ? 2 : 1, error.message());
}

Progress progress_bar(const std::string& title) {
  using Clock = std::chrono::steady_clock;
  struct State {
    Clock::time_point start = Clock::now();
    ProgressLines lines;
    bool drawn = false;
  };
  const bool terminal = ::isatty(STDERR_FILENO) != 0;
  return [title, terminal, state = std::make_shared<State>()](double fraction, std::string_view what) {
    const double seconds = std::chrono::duration<double>(Clock::now() - state->start).count();
    const bool done = fraction >= 1;
    if (seconds < 2 && !(done && state->drawn)) return;
    state->drawn = true;
    const std::string words(what);
    if (terminal) {
      constexpr int kWidth = 30;
      const int filled = static_cast<int>(fraction * kWidth);
      const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                              std::string(static_cast<std::size_t>(kWidth - filled), '.');
      std::fprintf(stderr, "\r\033[K%s [%s] %3.0f %% %s%s", title.c_str(), bar.c_str(), 100 * fraction,
                   words.c_str(), done ? "\n" : "");
    } else {
      static std::mutex mutex;
      static std::optional<double> last_line;
      const std::lock_guard lock(mutex);
      const double now = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
      if (state->lines.due(fraction, now, last_line))
        std::fprintf(stderr, "%s %3.0f %% %s\n", title.c_str(), 100 * fraction, words.c_str());
    }
    std::fflush(stderr);
  };
}

}  // namespace emberlock::cli
