// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <memory>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "rig/doctor/doctor.h"

namespace emberlock::cli {
namespace {

struct DoctorArguments {
  rig::doctor::CollectOptions options;
  bool json = false;
};

void print_json(const std::vector<rig::doctor::Check>& checks) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const rig::doctor::Check& check : checks) {
    list.push_back({{"what", check.what},
                    {"health", rig::doctor::name(check.health)},
                    {"found", check.found},
                    {"remedy", check.remedy}});
  }
  std::printf("%s\n", nlohmann::ordered_json{{"checks", list}}
                          .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
                          .c_str());
}

void print_lines(const std::vector<rig::doctor::Check>& checks) {
  for (const rig::doctor::Check& check : checks) {
    std::printf("%-4s  %-13s  %s\n", std::string(rig::doctor::name(check.health)).c_str(), check.what.c_str(),
                check.found.c_str());
    if (!check.remedy.empty()) std::printf("%19s  -> %s\n", "", check.remedy.c_str());
  }
}

void examine(const DoctorArguments& arguments) {
  const std::vector<rig::doctor::Check> checks = rig::doctor::judge(rig::doctor::collect(arguments.options));
  if (arguments.json) {
    print_json(checks);
  } else {
    print_lines(checks);
  }
  if (std::any_of(checks.begin(), checks.end(), [](const rig::doctor::Check& check) {
        return check.health == rig::doctor::Health::fail;
      })) {
    throw CLI::RuntimeError(1);
  }
}

}  // namespace

void add_doctor(CLI::App& app) {
  auto a = std::make_shared<DoctorArguments>();
  CLI::App* verb = app.add_subcommand("doctor",
                                      "Checks groups, rules, limits, network, disk, clock and configuration, "
                                      "and says what to do. Writes to the "
                                      "recordings' disk for two seconds.");
  verb->add_option("--config", a->options.config_file, "The daemon's configuration")->capture_default_str();
  verb->add_flag("--json", a->json, "One JSON object");
  verb->callback([a] { examine(*a); });
}

}  // namespace emberlock::cli
