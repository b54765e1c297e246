#include <algorithm>
#include <cstdio>
#include <memory>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "daemon/doctor/doctor.h"

namespace emberlock::cli {
namespace {

struct DoctorArguments {
  doctor::CollectOptions options;
  bool json = false;
};

void print_json(const std::vector<doctor::Check>& checks) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const doctor::Check& check : checks) {
    list.push_back({{"what", check.what},
                    {"health", doctor::name(check.health)},
                    {"found", check.found},
                    {"remedy", check.remedy}});
  }
  std::printf("%s\n", nlohmann::ordered_json{{"checks", list}}
                          .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
                          .c_str());
}

void print_lines(const std::vector<doctor::Check>& checks) {
  for (const doctor::Check& check : checks) {
    std::printf("%-4s  %-13s  %s\n", std::string(doctor::name(check.health)).c_str(), check.what.c_str(),
                check.found.c_str());
    if (!check.remedy.empty()) std::printf("%19s  -> %s\n", "", check.remedy.c_str());
  }
}

void examine(const DoctorArguments& arguments) {
  const std::vector<doctor::Check> checks = doctor::judge(doctor::collect(arguments.options));
  if (arguments.json) {
    print_json(checks);
  } else {
    print_lines(checks);
  }
  if (std::any_of(checks.begin(), checks.end(),
                  [](const doctor::Check& check) { return check.health == doctor::Health::fail; })) {
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
