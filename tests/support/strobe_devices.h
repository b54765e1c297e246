// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "drivers/strobe_serial/controller/protocol.h"
#include "drivers/strobe_serial/dialect.h"

// The other end of a strobe's serial line: devices as their manuals describe them, bytes in, bytes out.
namespace emberlock::test {

class StrobeDevice {
 public:
  virtual ~StrobeDevice() = default;
  /// What it says to these bytes.
  std::string take(std::string_view bytes) {
    std::string said;
    for (const char c : bytes) {
      if (c != end_) {
        line_ += c;
        continue;
      }
      said += answer(std::exchange(line_, {}));
    }
    return said;
  }
  /// Beyond these it does less than it is asked for, and says no word of it.
  double silent_most_rate = std::numeric_limits<double>::infinity();
  double silent_widest = std::numeric_limits<double>::infinity();
  virtual std::string noise() const { return "\x81\xfe!?\n\r>"; }

 protected:
  explicit StrobeDevice(char end) : end_(end) {}
  virtual std::string answer(const std::string& line) = 0;

 private:
  char end_;
  std::string line_;
};

inline double number(std::string_view text) {
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}
inline double to_step(double value, double step) { return std::round(value / step) * step; }

/// A generator with SCPI: 1 uHz, 1 ns, 0.001 degrees; a queue of errors.
class ScpiDevice final : public StrobeDevice {
 public:
  ScpiDevice() : StrobeDevice('\n') {}
  std::deque<std::string> errors;
  std::string function = "SIN";
  double rate = 1000, width = 1e-4, phase = 0, most_rate = 25e6;
  bool on = false, takes_settings = true;

 private:
  std::string answer(const std::string& line) override {
    const auto value = [&](std::string_view head) { return std::string_view(line).substr(head.size() + 1); };
    const auto is = [&](std::string_view head) { return line.starts_with(head); };
    if (line == "*IDN?") return "Keysight Technologies,33509B,MY52200021,3.05-1.19-2.00\n";
    if (line == "*CLS") return errors.clear(), "";
    if (line == "SYST:ERR?") {
      if (errors.empty()) return "+0,\"No error\"\n";
      const std::string first = errors.front();
      return errors.pop_front(), first + "\n";
    }
    if (line == ":SOUR1:FUNC?") return function + "\n";
    if (line == ":SOUR1:FREQ?") return fmt::format("{:+.15E}\n", rate);
    if (line == ":SOUR1:FUNC:PULS:WIDT?") return fmt::format("{:+.15E}\n", width);
    if (line == ":SOUR1:PHAS?") return fmt::format("{:+.15E}\n", phase);
    if (line == ":OUTP1?") return on ? "1\n" : "0\n";
    if (line == ":OUTP1 ON" || line == ":OUTP1 OFF") return on = line.ends_with("ON") && takes_settings, "";
    if (line == ":SOUR1:FUNC PULS") return function = "PULS", "";
    if (line == ":SOUR1:FUNC:PULS:WIDT MIN") return width = 1.6e-8, "";
    if (is(":SOUR1:FUNC:PULS:WIDT ")) {
      const double next = to_step(number(value(":SOUR1:FUNC:PULS:WIDT")), 1e-9);
      set_within(width, std::min(next, silent_widest), 1 / rate);
    } else if (is(":SOUR1:FREQ ")) {
      const double next = std::min(to_step(number(value(":SOUR1:FREQ")), 1e-6), silent_most_rate);
      if (width >= 1 / next)
        errors.push_back("-221,\"Settings conflict; pulse width\"");
      else
        set_within(rate, next, most_rate);
    } else if (is(":SOUR1:PHAS ") && line.ends_with(" DEG")) {
      phase = to_step(number(value(":SOUR1:PHAS")), 1e-3);
    } else {
      errors.push_back("-113,\"Undefined header\"");
    }
    return "";
  }
  void set_within(double& what, double next, double below) {
    if (next < below)
      what = next;
    else
      errors.push_back("-222,\"Data out of range\"");
  }
};

/// Siglent's SDG by its programming guide: 1 uHz, 10 ns; says nothing of errors and clips.
class SiglentDevice final : public StrobeDevice {
 public:
  SiglentDevice() : StrobeDevice('\n') {}
  std::string type = "SINE";
  double rate = 1000, width = 2e-4, delay = 0;
  bool on = false, takes_delay = true;

 private:
  std::string answer(const std::string& line) override {
    if (line == "*IDN?") return "Siglent Technologies,SDG2042X,SDG2XCAD1R2393,2.01.01.35R3B2\n";
    if (line == "C1:OUTP?") return fmt::format("C1:OUTP {},LOAD,HZ,PLRT,NOR\n", on ? "ON" : "OFF");
    if (line == "C1:OUTP ON" || line == "C1:OUTP OFF") return on = line.ends_with("ON"), "";
    if (line == "C1:BSWV?") return wave();
    constexpr std::string_view kSet = "C1:BSWV ";
    if (!line.starts_with(kSet)) return "";
    std::string key;
    for (std::size_t at = kSet.size(); at <= line.size();) {
      const std::size_t end = std::min(line.find(',', at), line.size());
      const std::string field = line.substr(at, end - at);
      at = end + 1;
      if (key.empty()) {
        key = field;
        continue;
      }
      set(std::exchange(key, {}), field);
    }
    return "";
  }
  std::string wave() const {
    if (type != "PULSE")
      return fmt::format("C1:BSWV WVTP,{},FRQ,{:.12g}HZ,PERI,{:.9g}S,AMP,4V,OFST,0V,PHSE,0\n", type, rate,
                         1 / rate);
    return fmt::format(
        "C1:BSWV "
        "WVTP,PULSE,FRQ,{:.12g}HZ,PERI,{:.9g}S,AMP,4V,OFST,0V,HLEV,2V,LLEV,-2V,DUTY,{:.6g},WIDTH,{:.9g},"
        "RISE,8.4e-09S,FALL,8.4e-09S,DLY,{:.9g}\n",
        rate, 1 / rate, 100 * width * rate, width, delay);
  }
  void set(const std::string& key, const std::string& text) {
    if (key == "WVTP") type = text;
    if (key == "FRQ") rate = std::min(to_step(number(text), 1e-6), silent_most_rate);
    if (key == "WIDTH") width = std::min({to_step(number(text), 1e-8), 0.999 / rate, silent_widest});
    if (key == "DLY" && takes_delay) delay = std::min(to_step(number(text), 1e-8), 1 / rate - 1e-8);
  }
};

/// Gardasoft's RT with one channel of interest: 10 us; echoes what it hears.
class GardasoftDevice final : public StrobeDevice {
 public:
  GardasoftDevice() : StrobeDevice('\r') {}
  int mode = 1, trigger = 0, event = 0;
  double every = 20, width = 1, delay = 0.01, brightness = 50, widest = 999;
  bool echoes = false, lamp_fails = false;

 private:
  std::string answer(const std::string& line) override {
    return (echoes ? line : "") + reply(line) + "\r\n>";
  }
  std::string reply(const std::string& line) {
    if (line == "VR") return "\r\nRT260F-20 (HW02) V031";
    if (line == "GR") return event == 0 ? "" : fmt::format("Evt1,{}", std::exchange(event, 0));
    if (line == "ST0") return fmt::format("TM {}, TP {:.2f}ms", trigger, every);
    if (line == "ST1") {
      return fmt::format(
          "CH 1, MD {}, S {:.1f},0.0, DL {:.3f}ms, PU {:.0f}us, RT 0.0ms, IP 1, FL 0, CS 0.500A, RA 1.0A",
          mode, brightness, delay, width * 1000);
    }
    if (line == "TT0") return trigger = 0, "";
    if (line.starts_with("TT1,")) {
      trigger = 1;
      every = std::max(to_step(number(line.substr(4)), 0.01), 1000 / silent_most_rate);
      return "";
    }
    if (line.starts_with("RS1,")) return mode = 0, brightness = number(line.substr(4)), "";
    if (line.starts_with("RT1,")) {
      const auto second = line.find(',', 4), third = line.find(',', second + 1);
      const double asked = number(line.substr(4, second - 4));
      mode = 1;
      if (lamp_fails) event = 34;
      width = std::clamp(to_step(asked, 0.001), 0.01, std::min(widest, 1000 * silent_widest));
      delay = std::max(to_step(number(line.substr(second + 1, third - second - 1)), 0.01), 0.01);
      brightness = number(line.substr(third + 1));
      return asked > widest ? "Err 5" : "";
    }
    return "Err 2";
  }
};

/// Schott's CV-LS: whole Hertz, thousandths of the period.
class SchottDevice final : public StrobeDevice {
 public:
  SchottDevice() : StrobeDevice('\r') {}
  int light = 0, triggered = 1, strobing = 0, rate = 100, duty = 500;

 private:
  std::string answer(const std::string& line) override {
    if (line == "&Q") return "&qSCHOTT ColdVision Light Source\r\n";
    const struct {
      std::string_view head;
      int& value;
      int least, most;
    } all[] = {{"&L1,", light, 0, 1},
               {"&PM", triggered, 0, 1},
               {"&RM", strobing, 0, 1},
               {"&RF", rate, 6, 20000},
               {"&RD1,", duty, 0, 1000}};
    for (const auto& [head, value, least, most] : all) {
      if (!line.starts_with(head)) continue;
      const std::string_view text = std::string_view(line).substr(head.size());
      if (text != "?") {
        const double asked = number(text);
        if (asked < least || asked > most) return fmt::format("&n{}p{}\r\n", line.substr(1, 2), text);
        value = static_cast<int>(asked);
        rate = static_cast<int>(std::min<double>(rate, silent_most_rate));
        duty = static_cast<int>(std::min(duty * 1.0, 1000 * rate * silent_widest));
      }
      std::string name(head);
      for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      return fmt::format("{}{}\r\n", name, value);
    }
    return fmt::format("&np{}\r\n", line);
  }
};

/// Our own controller: the code that runs on the microcontroller.
class ControllerDevice final : public StrobeDevice {
 public:
  ControllerDevice() : StrobeDevice('\n') {}
  emberlock_controller::Controller controller{
      {.model = "uno", .serial = "E7531", .tick = 500, .shortest_width = 10000}};
  std::uint32_t now_ms = 0;

 private:
  std::string answer(const std::string& line) override {
    for (const char c : clamped(line)) controller.take(c, now_ms);
    return controller.take('\n', now_ms) ? controller.reply() : "";
  }
  /// The line as a controller understands it that clamps.
  std::string clamped(const std::string& line) const {
    if (std::isinf(silent_most_rate) && std::isinf(silent_widest)) return line;
    const auto value_of = [&](std::string_view key) { return line.find(key) + key.size(); };
    const std::size_t per = value_of(" per="), pha = line.find(" pha="), wid = value_of(" wid="),
                      len = line.find(" len="), sum = line.rfind('*');
    if (pha == std::string::npos) return line;
    const std::string text =
        fmt::format("{}{:.0f}{}{:.0f}{}", line.substr(0, per),
                    std::max(number(std::string_view(line).substr(per)), 1e9 / silent_most_rate),
                    line.substr(pha, wid - pha),
                    std::min(number(std::string_view(line).substr(wid)), 1e9 * silent_widest),
                    line.substr(len, sum - len));
    return fmt::format("{}*{:04X}", text, emberlock_controller::crc16(text.data(), text.size()));
  }
};

inline std::unique_ptr<StrobeDevice> make_device(drivers::StrobeDialect dialect) {
  switch (dialect) {
    case drivers::StrobeDialect::emberlock:
      return std::make_unique<ControllerDevice>();
    case drivers::StrobeDialect::scpi:
      return std::make_unique<ScpiDevice>();
    case drivers::StrobeDialect::siglent_bswv:
      return std::make_unique<SiglentDevice>();
    case drivers::StrobeDialect::gardasoft_rt:
      return std::make_unique<GardasoftDevice>();
    case drivers::StrobeDialect::schott_cv_ls:
      return std::make_unique<SchottDevice>();
  }
  return nullptr;
}

inline const std::vector<drivers::StrobeDialect> kAllDialects{
    drivers::StrobeDialect::emberlock, drivers::StrobeDialect::scpi, drivers::StrobeDialect::siglent_bswv,
    drivers::StrobeDialect::gardasoft_rt, drivers::StrobeDialect::schott_cv_ls};

}  // namespace emberlock::test
