#include "base/log.h"

#include <array>
#include <cstdlib>
#include <memory>
#include <string>

#include <spdlog/cfg/helpers.h>
#include <spdlog/sinks/stdout_color_sinks.h>

namespace emberlock {
namespace {

constexpr std::array<const char*, 7> kNames{"base",  "smear_sync", "session", "drivers",
                                            "recon", "daemon",     "cli"};

std::array<std::shared_ptr<spdlog::logger>, kNames.size()> make_loggers() {
  const auto sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  std::array<std::shared_ptr<spdlog::logger>, kNames.size()> loggers;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    loggers[i] = std::make_shared<spdlog::logger>(kNames[i], sink);
    loggers[i]->set_level(spdlog::level::warn);
    spdlog::register_logger(loggers[i]);
  }
  // NOLINTNEXTLINE(concurrency-mt-unsafe): runs once, before any thread of ours starts.
  if (const char* levels = std::getenv("EMBERLOCK_LOG")) spdlog::cfg::helpers::load_levels(levels);
  return loggers;
}

}  // namespace

spdlog::logger& log(LogCategory category) {
  static const auto loggers = make_loggers();
  return *loggers[static_cast<std::size_t>(category)];
}

}  // namespace emberlock
