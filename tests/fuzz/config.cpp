// SPDX-License-Identifier: Apache-2.0
#include "rig/config/config.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "tests/fuzz/target.h"

/// Whatever a configuration file holds: problems, each with its place and a remedy, or a configuration that
/// says the same when it is printed and read again.
FUZZ_TARGET(config) {
  using namespace emberlock;
  const std::filesystem::path file = "/fuzz/emberlockd.toml";
  const rig::ConfigReading once = rig::read_config({reinterpret_cast<const char*>(data), size}, file);
  for (const Error& problem : once.problems) {
    if (problem.what.empty() || problem.where.empty() || problem.remedy.empty()) std::abort();
  }
  if (!once.problems.empty()) return 0;
  const std::string printed = rig::print_config(once.config);
  const rig::ConfigReading again = rig::read_config(printed, file);
  if (!again.problems.empty() || rig::print_config(again.config) != printed) std::abort();
  return 0;
}
