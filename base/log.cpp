// SPDX-License-Identifier: Apache-2.0
#include "base/log.h"

#include <array>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <spdlog/cfg/helpers.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/utc.h"

namespace emberlock {
namespace {

constexpr std::array<const char*, 9> kNames{"base", "smear_sync", "session", "drivers", "recon",
                                            "rig",  "films",      "daemon",  "cli"};

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

void append_escaped(std::string_view text, spdlog::memory_buf_t& out) {
  for (const char c : text) {
    if (c == '"' || c == '\\')
      fmt::format_to(std::back_inserter(out), "\\{}", c);
    else if (static_cast<unsigned char>(c) < 0x20)
      fmt::format_to(std::back_inserter(out), "\\u{:04x}", static_cast<unsigned>(c));
    else
      out.push_back(c);
  }
}

std::string_view view(spdlog::string_view_t text) { return {text.data(), text.size()}; }

class JsonFormatter final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const auto since_1970 =
        std::chrono::duration_cast<std::chrono::nanoseconds>(message.time.time_since_epoch());
    fmt::format_to(std::back_inserter(out), R"({{"time":"{}","level":"{}","category":")",
                   utc_text({since_1970.count()}), view(spdlog::level::to_string_view(message.level)));
    append_escaped(view(message.logger_name), out);
    fmt::format_to(std::back_inserter(out), R"(","thread":{},"message":")", message.thread_id);
    append_escaped(view(message.payload), out);
    fmt::format_to(std::back_inserter(out), "\"}}\n");
  }
  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>();
  }
};

/// Formats lines as sd-daemon(3) asks: each line of a message begins with its syslog priority.
class JournalFormatter final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const std::string head = fmt::format("<{}>[{}] ", priority(message.level), view(message.logger_name));
    out.append(head);
    for (const char c : view(message.payload)) {
      out.push_back(c);
      if (c == '\n') out.append(head);
    }
    out.push_back('\n');
  }
  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JournalFormatter>();
  }

 private:
  static int priority(spdlog::level::level_enum level) {
    switch (level) {
      case spdlog::level::critical:
        return 2;
      case spdlog::level::err:
        return 3;
      case spdlog::level::warn:
        return 4;
      case spdlog::level::info:
        return 6;
      default:
        return 7;
    }
  }
};

}  // namespace

spdlog::logger& log(LogCategory category) {
  static const auto loggers = make_loggers();
  return *loggers[static_cast<std::size_t>(category)];
}

std::unique_ptr<spdlog::formatter> log_formatter(LogFormat format) {
  switch (format) {
    case LogFormat::json:
      return std::make_unique<JsonFormatter>();
    case LogFormat::journal:
      return std::make_unique<JournalFormatter>();
    case LogFormat::text:
      break;
  }
  return std::make_unique<spdlog::pattern_formatter>();
}

void set_log_format(LogFormat format) {
  // All categories share one sink.
  for (const auto& sink : log(LogCategory::base).sinks()) sink->set_formatter(log_formatter(format));
}

bool logs_to_journal() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing of ours changes the environment.
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat error_stream {};
  if (stream == nullptr || ::fstat(STDERR_FILENO, &error_stream) != 0) return false;
  return fmt::format("{}:{}", error_stream.st_dev, error_stream.st_ino) == stream;
}

}  // namespace emberlock
