#pragma once

#include <spdlog/spdlog.h>

namespace emberlock {

/// One category a folder, so that `EMBERLOCK_LOG=session=debug` speaks of one stage alone.
enum class LogCategory { base, smear_sync, session, drivers, recon, daemon, cli };

/// The category's logger: to stderr, level `warn` unless the environment variable EMBERLOCK_LOG
/// ("debug", or "session=debug,recon=info") says otherwise. Thread-safe.
spdlog::logger& log(LogCategory category);

}  // namespace emberlock
