// SPDX-License-Identifier: Apache-2.0
#include "cli/strobe_choice.h"

#include <sstream>
#include <utility>

namespace emberlock::cli {

Result<StrobeChoice> parse_strobe(const std::string& text) {
  const auto refuse = [&](std::string what) {
    return Error{
        ErrorKind::bad_input, std::move(what), "--strobe " + text,
        "give virtual, manual, manual:step=1 (flashes a minute), or virtual-dial:error=300,at=1510.5 "
        "(ppm by which the dial is off, flashes a minute where it stands at first)"};
  };
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  if (text == "virtual") return StrobeChoice{};
  if (kind != "manual" && kind != "virtual-dial") return refuse("there is no such strobe");
  StrobeChoice choice{drivers::VirtualDialOptions{}, std::nullopt};
  std::istringstream options(colon == std::string::npos ? "" : text.substr(colon + 1));
  for (std::string option; std::getline(options, option, ',');) {
    const std::size_t equals = option.find('=');
    const std::string key = option.substr(0, equals);
    double value = 0;
    std::istringstream number(equals == std::string::npos ? "" : option.substr(equals + 1));
    if (!(number >> value) || number.peek() != std::char_traits<char>::eof())
      return refuse("\"" + option + "\" is no option with its number");
    if (key == "step") {
      choice.dial->dial.step = Hertz(value / 60);
    } else if (key == "error" && kind == "virtual-dial") {
      choice.dial->error = PartsPerMillion(value);
    } else if (key == "at" && kind == "virtual-dial") {
      choice.at = Hertz(value / 60);
      if (!(value >= 30 && value <= 20000)) return refuse("the dial goes from 30 to 20000 flashes a minute");
    } else {
      return refuse("there is no option \"" + key + "\"");
    }
  }
  if (const Status fits = check(choice.dial->dial); !fits.ok()) return refuse(fits.error().what);
  return choice;
}

rig::AlignObserver operated(drivers::VirtualDial* dial, std::optional<Hertz> at,
                            rig::AlignObserver observer) {
  if (dial == nullptr) return observer;
  return [dial, at, observer = std::move(observer)](const rig::AlignRoundReport& report) {
    observer(report);
    const auto& advice = report.decision.dial;
    if (!advice || !advice->act) return;
    if (dial->shown() == Hertz(0)) {
      dial->turn(at.value_or(advice->set));
    } else if (advice->measured) {
      dial->turn(dial->dial()->nearest(dial->shown() + advice->set - *advice->measured));
    } else {
      dial->turn(advice->set);
    }
  };
}

}  // namespace emberlock::cli
