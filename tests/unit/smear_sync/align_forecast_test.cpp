// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_forecast.h"

#include <string>

#include <gtest/gtest.h>

namespace emberlock::smear {
namespace {

/// Eight cameras that reset on command, spread over the period; nothing is known of where that lands.
Prospect untaught(const std::vector<std::string>& models) {
  Prospect prospect;
  prospect.scene.policy = AlignPolicy::timed;
  prospect.scene.period = milliseconds(40);
  prospect.scene.tolerance = milliseconds(8);
  for (std::size_t i = 0; i < models.size(); ++i) {
    prospect.scene.tau.push_back(milliseconds(5 * static_cast<double>(i)));
    prospect.scene.landings.push_back({ShutterReset::on_command, std::nullopt, {}, models[i]});
  }
  prospect.drifts.resize(models.size());
  prospect.trims.resize(models.size());
  prospect.jitter = milliseconds(0.1);
  return prospect;
}

TEST(AlignForecast, EachModelIsTaughtByAResetOfItsOwn) {
  AlignOptions options;
  options.period = milliseconds(40);
  options.limits = AlignLimits{};
  options.limits->resets = 100;
  options.limits->time = Seconds(1e6);
  const auto resets = [&](const std::vector<std::string>& models) {
    return foretell(untaught(models), AlignPolicy::timed, milliseconds(8), options).resets;
  };
  const double one = resets({"A", "A", "A", "A", "A", "A", "A", "A"});
  const double two = resets({"A", "B", "A", "B", "A", "B", "A", "B"});
  const double four = resets({"A", "B", "C", "D", "A", "B", "C", "D"});
  // What teaches lands anywhere, and is reset once more.
  EXPECT_GT(two, one + 0.3);
  EXPECT_GT(four, two + 0.6);
  EXPECT_LT(four, one + 6);
}

}  // namespace
}  // namespace emberlock::smear
