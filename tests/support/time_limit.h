// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

namespace emberlock::test {

/// Returns the processor time of this process and of every child that it has waited for, over all their
/// threads, s.
inline double processor_seconds() {
  double seconds = 0;
  for (const auto whose : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(whose, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime})
      seconds += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  }
  return seconds;
}

/// Fails a test of the fast tier that takes more processor time than the limit. Waiting costs none, so that a
/// busy machine fails no test; a test on two threads reaches the limit in half of the time. A suite's set-up
/// counts with its first test.
class TimeLimit final : public testing::EmptyTestEventListener {
 public:
  /// @param limit in seconds; 0 is no limit.
  explicit TimeLimit(double limit) : limit_(limit) {}

  void OnTestSuiteStart(const testing::TestSuite& /*suite*/) override { start_ = processor_seconds(); }
  void OnTestEnd(const testing::TestInfo& test) override {
    const double end = processor_seconds();
    const double taken = end - start_;
    start_ = end;
    if (limit_ <= 0 || taken <= limit_ || is_slow(test.test_suite_name())) return;
    ADD_FAILURE() << fmt::format(
        "{}.{} took {:.1f} s of processor time; a test of the fast tier has {:g}. Make it smaller or end its "
        "suite's name in Slow.",
        test.test_suite_name(), test.name(), taken, limit_);
  }

  /// Suites whose names end in Slow or Nightly run in release only; a typed suite's name goes on with "/" and
  /// the type.
  static bool is_slow(const std::string& suite) {
    for (const std::string tier : {"Slow", "Nightly"})
      if (suite.ends_with(tier) || suite.find(tier + "/") != std::string::npos) return true;
    return false;
  }

 private:
  double limit_;
  double start_ = 0;
};

}  // namespace emberlock::test
