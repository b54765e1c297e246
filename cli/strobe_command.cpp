// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"

namespace emberlock::cli {
namespace {

struct StrobeArguments {
  DaemonAddress daemon;
  std::optional<v1::StrobeState::Output> output;
  std::optional<double> rate_hz, phase_ms, width_us;
  std::optional<std::string> code;
  bool json = false;
};

/// Whether anything was to be changed.
bool change(v1::StrobeState& state, const StrobeArguments& arguments) {
  if (arguments.output) state.set_output(*arguments.output);
  if (arguments.rate_hz) state.set_rate_hz(*arguments.rate_hz);
  if (arguments.phase_ms) state.set_phase_s(*arguments.phase_ms * 1e-3);
  if (arguments.width_us) state.set_width_s(*arguments.width_us * 1e-6);
  if (arguments.code) {
    state.clear_code();
    for (const char c : *arguments.code) state.add_code(c == '1');
  }
  return arguments.output || arguments.rate_hz || arguments.phase_ms || arguments.width_us || arguments.code;
}

void print_state(const v1::StrobeState& state) {
  std::printf("%-8s %s\n", "output", in_words(v1::StrobeState::Output_Name(state.output())).c_str());
  std::printf("%-8s %.9g Hz\n", "rate", state.rate_hz());
  std::printf("%-8s %.6g ms\n", "phase", state.phase_s() * 1e3);
  std::printf("%-8s %.6g us\n", "width", state.width_s() * 1e6);
  std::string code;
  for (const bool flash : state.code()) code += flash ? '1' : '0';
  if (!code.empty()) std::printf("%-8s %s\n", "code", code.c_str());
}

void strobe(const StrobeArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  v1::StrobeState state = or_leave(client, client.strobe());
  if (change(state, arguments)) state = or_leave(client, client.apply_strobe(state));
  if (arguments.json) {
    std::printf("%s\n", json_line(state).c_str());
  } else {
    print_state(state);
  }
}

}  // namespace

void add_strobe(CLI::App& app) {
  auto arguments = std::make_shared<StrobeArguments>();
  CLI::App* verb = app.add_subcommand(
      "strobe", "Says how the strobe is set; with options sets it, and says what it read back");
  StrobeArguments& a = *arguments;
  add_daemon_options(*verb, a.daemon);
  const std::map<std::string, v1::StrobeState::Output> outputs = {{"off", v1::StrobeState::OFF},
                                                                  {"flashing", v1::StrobeState::FLASHING},
                                                                  {"steady", v1::StrobeState::STEADY}};
  verb->add_option("--output", a.output, "off, flashing or steady")
      ->transform(CLI::CheckedTransformer(outputs));
  verb->add_option("--rate", a.rate_hz, "Flashes a second, Hz")->check(CLI::PositiveNumber);
  verb->add_option("--phase", a.phase_ms, "Of the flashes, ms");
  verb->add_option("--width", a.width_us, "Of a flash, us")->check(CLI::PositiveNumber);
  verb->add_option("--code", a.code, "Which flashes come, over and over: 1101; empty: all")
      ->check([](const std::string& text) {
        return text.find_first_not_of("01") == std::string::npos ? std::string()
                                                                 : "only 0 and 1 can stand in a code";
      });
  verb->add_flag("--json", a.json, "StrobeState of emberlock/v1/session.proto, as JSON on one line");
  verb->callback([arguments] { strobe(*arguments); });
}

}  // namespace emberlock::cli
