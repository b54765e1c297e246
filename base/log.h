// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <spdlog/spdlog.h>

namespace emberlock {

/// One category a folder that logs, so that `EMBERLOCK_LOG=session=debug` speaks of one stage alone.
enum class LogCategory { base, smear_sync, session, drivers, recon, rig, films, daemon, cli };

/// The category's logger: to stderr, level `warn` unless the environment variable EMBERLOCK_LOG
/// ("debug", or "session=debug,recon=info") says otherwise. Thread-safe.
spdlog::logger& log(LogCategory category);

enum class LogFormat {
  text,     ///< "[2026-11-22 03:00:00.000] [daemon] [warning] ...", in colour on a terminal
  json,     ///< one object a line: {"time": (ISO 8601, UTC), "level", "category", "thread", "message"}
  journal,  ///< "<4>[daemon] ...": the journal knows the time, and reads the priority
};

/// How every category writes from now on; text until then. Thread-safe.
void set_log_format(LogFormat format);
/// Whether stderr is the system's journal (JOURNAL_STREAM, as systemd sets it).
bool logs_to_journal();
std::unique_ptr<spdlog::formatter> log_formatter(LogFormat format);

}  // namespace emberlock
