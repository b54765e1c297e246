// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/file.h"
#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/frame_code_signal.h"
#include "smear_sync/clocks/frame_code.h"

namespace emberlock::cli {
namespace {

struct StrobeArguments {
  DaemonAddress daemon;
  std::optional<int> output;  ///< StrobeState::Output
  std::optional<double> rate_hz, phase_ms, width_us;
  std::optional<std::string> code;
  bool json = false;
  bool frame_code = false;
  bool play = false;
  smear::FrameCode words{};
  std::string csv, wav;
  double wav_rate_hz = 48000;
};

constexpr double kUsualRate = 24.2;          // Hz: about 1 % beside cameras of 23.976
constexpr double kUsualWidth = 20;           // us
constexpr std::size_t kLongestPrinted = 64;  // flashes of a code

/// Applies the arguments; returns whether there are any changes.
bool change(v1::StrobeState& state, const StrobeArguments& arguments) {
  if (arguments.output) state.set_output(static_cast<v1::StrobeState::Output>(*arguments.output));
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
  if (code.size() > kLongestPrinted)
    code = fmt::format("{}... ({} flashes, {} of them skipped)", code.substr(0, kLongestPrinted), code.size(),
                       std::count(code.begin(), code.end(), '0'));
  if (!code.empty()) std::printf("%-8s %s\n", "code", code.c_str());
}

/// The code for people and signal generators, without a daemon.
void print_frame_code(const StrobeArguments& arguments, const std::vector<bool>& pattern) {
  const Hertz rate(arguments.rate_hz.value_or(kUsualRate));
  const Seconds width = microseconds(arguments.width_us.value_or(kUsualWidth));
  if (!arguments.csv.empty()) or_fail(write_file_atomically(arguments.csv, code_csv(pattern, rate, width)));
  if (!arguments.wav.empty()) {
    const std::string wave = or_fail(code_wav(pattern, rate, width, Hertz(arguments.wav_rate_hz)));
    or_fail(write_file_atomically(arguments.wav, wave));
  }
  std::printf("%s", code_text(pattern, arguments.words.spacing).c_str());
  std::fprintf(stderr,
               "emberlock: %zu flashes, then again from the start; 1 gives a flash, 0 skips it. At %.9g Hz a "
               "cycle lasts %.1f s\n",
               pattern.size(), rate.value(), static_cast<double>(pattern.size()) / rate.value());
}

void strobe(StrobeArguments arguments) {
  if (arguments.frame_code) {
    const std::vector<bool> pattern = or_fail(smear::flash_pattern(arguments.words));
    if (arguments.json && !arguments.play)
      fail({ErrorKind::bad_input, "the code is no JSON", "--json", "Leave it out, or add --play"});
    if (!arguments.play) return print_frame_code(arguments, pattern);
    arguments.code = code_text(pattern, static_cast<int>(pattern.size()));
    arguments.code->pop_back();  // the end of the line
    arguments.output = v1::StrobeState::FLASHING;
  }
  Client client = connect_or_leave(arguments.daemon);
  v1::StrobeState state = or_leave(client, client.strobe());
  if (change(state, arguments)) state = or_leave(client, client.apply_strobe(state));
  if (arguments.json) {
    std::printf("%s\n", json_line(state).c_str());
  } else {
    print_state(state);
  }
}

/// The code by which verify and import know frames.
void add_frame_code_options(const Verb& verb, StrobeArguments& a) {
  const Option frame_code = verb.add_flag(
      "--frame-code", a.frame_code,
      "Prints the code of skipped flashes by which verify and import tell which frames belong together");
  const Option play =
      verb.add_flag("--play", a.play, "Lets the daemon's strobe flash with it, at --rate [as it is set]")
          .need(frame_code);
  verb.add_option("--csv", a.csv, "Writes it for a signal generator, a line for each flash, at --rate [24.2]")
      .need(frame_code)
      .exclude(play);
  const Option wav =
      verb.add_option("--wav", a.wav, "Writes one cycle as a sound file, full level during a flash")
          .need(frame_code)
          .exclude(play);
  verb.add_option("--wav-rate", a.wav_rate_hz, "Samples per second of the sound file")
      .check_range(1.0, 1e7)
      .show_default()
      .need(wav);
  verb.add_option("--code-words", a.words.words, "Words of the code, as for verify")
      .check_range(1, 31)
      .show_default()
      .need(frame_code);
  verb.add_option("--code-spacing", a.words.spacing, "Flashes from one word to the next, as for verify")
      .check_range(32, 100000)
      .show_default()
      .need(frame_code);
  frame_code.exclude(verb.find_option("--code")).exclude(verb.find_option("--output"));
}

}  // namespace

void add_strobe(const Verb& app) {
  auto arguments = std::make_shared<StrobeArguments>();
  const Verb verb = app.add_verb(
      "strobe",
      "Prints the strobe's settings; with options sets them, and prints what was read back. With "
      "--frame-code prints the strobe's code, without a daemon");
  StrobeArguments& a = *arguments;
  add_daemon_options(verb, a.daemon);
  verb.add_option("--output", a.output, "off, flashing or steady")
      .set_type("ENUM")
      .check_numbered_choices({{"off", v1::StrobeState::OFF},
                               {"flashing", v1::StrobeState::FLASHING},
                               {"steady", v1::StrobeState::STEADY}});
  verb.add_option("--rate", a.rate_hz, "Flashes per second, Hz").check_positive();
  verb.add_option("--phase", a.phase_ms, "Phase of the flashes, ms");
  verb.add_option("--width", a.width_us, "Duration of a flash, us").check_positive();
  verb.add_option("--code", a.code,
                  "Cyclic pattern of flashes, 0 skips one: 1101; empty: no flash is skipped")
      .check([](const std::string& text) {
        return text.find_first_not_of("01") == std::string::npos ? std::string()
                                                                 : "only 0 and 1 can stand in a code";
      });
  add_frame_code_options(verb, a);
  verb.add_flag("--json", a.json, "StrobeState of emberlock/v1/session.proto, as JSON on one line");
  verb.set_action([arguments] { strobe(*arguments); });
}

}  // namespace emberlock::cli
