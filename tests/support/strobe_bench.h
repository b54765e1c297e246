// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "drivers/strobe_serial/serial_strobe.h"
#include "drivers/virtual/virtual_clock.h"
#include "tests/support/strobe_devices.h"

// A SerialStrobe and a device's simulation at the ends of a wire on which things go wrong, in virtual time.
namespace emberlock::test {

enum class Fault { none, silent, garbled, truncated, flipped, late, twice, renumbered, chatter };

struct StrobeBench {
  explicit StrobeBench(drivers::StrobeDialect spoken, const drivers::DialectOptions& options = {})
      : StrobeBench(drivers::make_dialect(spoken, options).value(), make_device(spoken)) {}
  StrobeBench(std::unique_ptr<const drivers::Dialect> dialect, std::unique_ptr<StrobeDevice> simulated)
      : device(std::move(simulated)),
        strobe(
            "bench", std::move(dialect), [this] { return open(); }, clock) {}

  Result<std::unique_ptr<drivers::Wire>> open();
  template <class Device>
  Device& as() {
    return dynamic_cast<Device&>(*device);
  }
  /// What happens to the device's answers from now on, one each; none after those.
  void spoil(std::initializer_list<Fault> next) { faults = next; }
  void spoil_all(Fault fault) { always = fault; }
  double seconds() const { return (clock->now() - TimePoint{}).value(); }

  std::shared_ptr<drivers::VirtualClock> clock = std::make_shared<drivers::VirtualClock>();
  std::unique_ptr<StrobeDevice> device;
  std::deque<Fault> faults;
  Fault always = Fault::none;
  bool plugged = true;
  int opened = 0;
  int heard = 0;  ///< writes
  drivers::SerialStrobe strobe;
};

class BenchWire final : public drivers::Wire {
 public:
  explicit BenchWire(StrobeBench& bench) : bench_(bench) {}

  Status write(std::string_view bytes, Seconds /*deadline*/) override {
    if (!bench_.plugged) return gone();
    ++bench_.heard;
    std::string said = bench_.device->take(bytes);
    if (said.empty()) return {};
    Fault fault = bench_.always;
    if (!bench_.faults.empty())
      fault = std::exchange(bench_.faults.front(), Fault::none), bench_.faults.pop_front();
    Seconds delay = milliseconds(2);
    switch (fault) {
      case Fault::none:
        break;
      case Fault::silent:
        return {};
      case Fault::garbled:
        said = bench_.device->noise() + said.back();
        break;
      case Fault::truncated:
        said = said.substr(0, said.size() / 2);
        break;
      case Fault::flipped:
        said[said.size() / 2] = static_cast<char>(said[said.size() / 2] ^ 0x15);
        break;
      case Fault::late:
        delay = milliseconds(600);
        break;
      case Fault::twice:
        said += said;
        break;
      case Fault::renumbered:
        said[2] = said[2] == '7' ? '8' : '7';
        break;
      case Fault::chatter:
        said = std::string(5000, 'U');
        break;
    }
    pending_.emplace_back(bench_.clock->now() + delay, said);
    return {};
  }

  Result<std::string> read(Seconds deadline) override {
    if (!bench_.plugged) return gone();
    const TimePoint until = bench_.clock->now() + deadline;
    if (pending_.empty() || pending_.front().first > until) {
      bench_.clock->sleep_until(until);
      return Error{ErrorKind::timed_out, "nothing came"};
    }
    bench_.clock->sleep_until(pending_.front().first);
    constexpr std::size_t kPiece = 7;  // lines come in pieces
    std::string& text = pending_.front().second;
    std::string piece = text.substr(0, kPiece);
    text.erase(0, piece.size());
    if (text.empty()) pending_.pop_front();
    return piece;
  }

 private:
  static Error gone() { return {ErrorKind::device, "the port is gone"}; }

  StrobeBench& bench_;
  std::deque<std::pair<TimePoint, std::string>> pending_;
};

inline Result<std::unique_ptr<drivers::Wire>> StrobeBench::open() {
  if (!plugged) return Error{ErrorKind::device, "it isn't plugged in"};
  ++opened;
  return std::unique_ptr<drivers::Wire>(std::make_unique<BenchWire>(*this));
}

}  // namespace emberlock::test
