// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "rig/doctor/doctor.h"
#include "rig/doctor/words.h"

namespace emberlock::cli {
namespace {

struct DoctorArguments {
  rig::doctor::CollectOptions options;
  bool json = false;
};

void print_json(const std::vector<rig::doctor::Finding>& findings, const rig::doctor::Facts& facts) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const rig::doctor::Finding& finding : findings) {
    const rig::doctor::FindingWords said = words(finding, facts);
    list.push_back({{"what", said.what},
                    {"health", name(finding.health)},
                    {"found", said.found},
                    {"remedy", said.remedy}});
  }
  std::printf("%s\n", nlohmann::ordered_json{{"checks", list}}
                          .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
                          .c_str());
}

void print_lines(const std::vector<rig::doctor::Finding>& findings, const rig::doctor::Facts& facts) {
  for (const rig::doctor::Finding& finding : findings) {
    const rig::doctor::FindingWords said = words(finding, facts);
    std::printf("%-4s  %-13s  %s\n", std::string(name(finding.health)).c_str(), said.what.c_str(),
                said.found.c_str());
    if (!said.remedy.empty()) std::printf("%19s  -> %s\n", "", said.remedy.c_str());
  }
}

void examine(const DoctorArguments& arguments) {
  const rig::doctor::Facts facts = rig::doctor::collect(arguments.options);
  const std::vector<rig::doctor::Finding> findings = rig::doctor::diagnose(facts);
  if (arguments.json) {
    print_json(findings, facts);
  } else {
    print_lines(findings, facts);
  }
  if (std::any_of(findings.begin(), findings.end(), [](const rig::doctor::Finding& finding) {
        return finding.health == rig::doctor::Health::fail;
      })) {
    throw Exit(1);
  }
}

}  // namespace

void add_doctor(const Verb& app) {
  auto a = std::make_shared<DoctorArguments>();
  const Verb verb = app.add_verb("doctor",
                                 "Checks groups, rules, limits, network, disk, clock and configuration, "
                                 "and says what to do. Writes to the "
                                 "recordings' disk for two seconds.");
  verb.add_option("--config", a->options.config_file, "The daemon's configuration").show_default();
  verb.add_flag("--json", a->json, "One JSON object");
  verb.set_action([a] { examine(*a); });
}

}  // namespace emberlock::cli
