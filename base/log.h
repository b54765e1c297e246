// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <spdlog/spdlog.h>

namespace emberlock {

/// One category for each folder that logs, so that `EMBERLOCK_LOG=session=debug` shows one stage alone.
enum class LogCategory { base, smear_sync, session, drivers, recon, rig, films, daemon, cli };

/// The category's logger. It writes to stderr. Its level is `warn` unless the environment variable
/// EMBERLOCK_LOG ("debug", or "session=debug,recon=info") sets another. Thread-safe.
spdlog::logger& log(LogCategory category);

enum class LogFormat {
  text,     ///< "[2026-11-22 03:00:00.000] [daemon] [warning] ...", in colour on a terminal
  json,     ///< one object per line: {"time": (ISO 8601, UTC), "level", "category", "thread", "message"}
  journal,  ///< "<4>[daemon] ...": no time, since the journal adds it; the priority in front
};

/// Sets the format of all categories from now on. The default is text. Thread-safe.
void set_log_format(LogFormat format);
/// Whether stderr is connected to the system's journal (by JOURNAL_STREAM, which systemd sets).
bool logs_to_journal();
std::unique_ptr<spdlog::formatter> log_formatter(LogFormat format);

}  // namespace emberlock
