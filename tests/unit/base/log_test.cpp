// SPDX-License-Identifier: Apache-2.0
// What a line of the log looks like to a person, a program and systemd's journal.
#include "base/log.h"

#include <chrono>
#include <cstdlib>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/formatter.h>
#include <sys/stat.h>
#include <unistd.h>

namespace emberlock {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::string line_of(LogFormat format, spdlog::level::level_enum level, const std::string& text) {
  const spdlog::details::log_msg message(spdlog::log_clock::time_point(std::chrono::milliseconds(1'500)), {},
                                         "daemon", level, text);
  spdlog::memory_buf_t line;
  log_formatter(format)->format(message, line);
  return fmt::to_string(line);
}

TEST(Log, AJsonLineIsOneObjectWhateverTheMessageHolds) {
  const std::string line = line_of(LogFormat::json, spdlog::level::warn, "a \"quoted\\\nline\"");
  EXPECT_THAT(
      line,
      StartsWith(R"({"time":"1970-01-01T00:00:01.500Z","level":"warning","category":"daemon","thread":)"));
  EXPECT_THAT(line, HasSubstr(R"("message":"a \"quoted\\\u000aline\""})"));
  EXPECT_EQ(line.find('\n'), line.size() - 1);
}

TEST(Log, TheJournalReadsEachLinesPriority) {
  EXPECT_EQ(line_of(LogFormat::journal, spdlog::level::err, "disk full"), "<3>[daemon] disk full\n");
  EXPECT_EQ(line_of(LogFormat::journal, spdlog::level::info, "a\nb"), "<6>[daemon] a\n<6>[daemon] b\n");
}

TEST(Log, TheJournalIsKnownByTheStreamThatSystemdNames) {
  struct stat error_stream {};
  ASSERT_EQ(::fstat(STDERR_FILENO, &error_stream), 0);
  ::setenv("JOURNAL_STREAM", fmt::format("{}:{}", error_stream.st_dev, error_stream.st_ino).c_str(), 1);
  EXPECT_TRUE(logs_to_journal());
  ::setenv("JOURNAL_STREAM", "1:1", 1);
  EXPECT_FALSE(logs_to_journal());
  ::unsetenv("JOURNAL_STREAM");
  EXPECT_FALSE(logs_to_journal());
}

}  // namespace
}  // namespace emberlock
