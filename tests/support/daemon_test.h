// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock::test {

/// A folder for an emberlockd and what it records, and `emberlock` as its client on the socket run/d.sock.
class DaemonTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path sessions() const { return temp_ / "sessions"; }
  [[nodiscard]] std::string config() const { return (temp_ / "d.toml").string(); }
  [[nodiscard]] Shell client(const std::string& words) const {
    return shell(std::string(EMBERLOCK_PROGRAM) + " " + words +
                 " --daemon unix:" + (temp_ / "run" / "d.sock").string());
  }
  /// Asks until the answer has `words`, for two minutes: the machine may be busy.
  [[nodiscard]] bool answers(const std::string& question, const std::string& words) const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (std::chrono::steady_clock::now() < end) {
      if (client(question).output.find(words) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return false;
  }
  TempFolder temp_;
};

}  // namespace emberlock::test
