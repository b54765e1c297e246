// SPDX-License-Identifier: Apache-2.0
// The sketch of our controller on a simulated ATmega: what the driver asks for is what the pin does, to the
// tick of 0.5 us.
#include "tests/support/avr/Arduino.h"
// The sketch, which Arduino's builder gives that header.
#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "drivers/strobe_serial/controller/controller.ino"
#include "drivers/strobe_serial/serial_strobe.h"
#include "drivers/virtual/virtual_clock.h"

namespace emberlock::drivers {
namespace {

constexpr double kTicks = 2e6;  // a second

/// The sketch's serial line.
class SketchWire final : public Wire {
 public:
  Status write(std::string_view bytes, Seconds /*deadline*/) override {
    avr::chip.to_device.insert(avr::chip.to_device.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<std::string> read(Seconds deadline) override {
    if (deadline > Seconds(0)) {
      for (int i = 0; i < 100 && avr::chip.from_device.empty(); ++i) {
        avr::chip.run(20);
        loop();
      }
    }
    if (avr::chip.from_device.empty()) return Error{ErrorKind::timed_out, "silent"};
    return std::exchange(avr::chip.from_device, {});
  }
};

class StrobeSketchThreads : public testing::Test {
 protected:
  StrobeSketchThreads() {
    avr::chip = {};
    avr::chip.interrupt = TIMER1_COMPA_vect;
    ::controller = emberlock_controller::Controller({kModel, kSerial, kTick, kShortestWidth});
    ::flashes = emberlock_controller::Flashes(kTick, kLead);
    ::given = 0;
    setup();
  }
  void apply(const StrobeSettings& settings) {
    const Status status = strobe_.apply(settings);
    ASSERT_TRUE(status.ok()) << status.error().message();
  }
  struct Flash {
    double at, width;  // ticks
  };
  /// The flashes that begin in the next so many seconds.
  std::vector<Flash> film(double seconds) {
    avr::chip.edges.clear();
    avr::chip.edges.emplace_back(avr::chip.ticks, avr::chip.pin());
    for (const auto end = avr::chip.ticks + static_cast<std::uint64_t>(seconds * kTicks);
         avr::chip.ticks < end;) {
      avr::chip.run(2000);
      loop();
    }
    std::vector<Flash> flashes;
    for (std::size_t i = 1; i + 1 < avr::chip.edges.size(); ++i) {
      const auto& [at, on] = avr::chip.edges[i];
      if (on)
        flashes.push_back({static_cast<double>(at), static_cast<double>(avr::chip.edges[i + 1].first - at)});
    }
    return flashes;
  }

  std::shared_ptr<VirtualClock> clock_ = std::make_shared<VirtualClock>();
  SerialStrobe strobe_{"sketch", make_dialect(StrobeDialect::emberlock).value(),
                       [] { return Result<std::unique_ptr<Wire>>(std::make_unique<SketchWire>()); }, clock_};
};

TEST_F(StrobeSketchThreads, FlashesAtTheRateAndWidthAskedForWithoutDrift) {
  for (const double rate : {0.7, 23.976, 24000.0 / 1001, 100.0, 333.3}) {
    for (const double width : {20e-6, 1e-3, 0.9 / rate}) {
      const StrobeSettings s{.output = StrobeOutput::flashing, .rate = Hertz(rate), .width = Seconds(width)};
      apply(s);
      const auto flashes = film(std::max(0.5, 8 / rate));
      ASSERT_GE(flashes.size(), 3U) << rate;
      const double period = kTicks / strobe_.read_back().value().rate.value();
      for (std::size_t i = 0; i < flashes.size(); ++i) {
        EXPECT_NEAR(flashes[i].at, flashes[0].at + period * static_cast<double>(i), 1.001)
            << rate << " " << i;
        EXPECT_NEAR(flashes[i].width, width * kTicks, 0.51) << rate;
      }
    }
  }
}

TEST_F(StrobeSketchThreads, APhaseMovesTheFlashesAgainstTheSameTimeBase) {
  StrobeSettings s{.output = StrobeOutput::flashing, .rate = Hertz(50)};
  apply(s);
  const double base = film(0.2).at(0).at, period = kTicks / 50;
  for (const double ms : {0.0, 0.0005, 3.0, 19.9, 12.0, 1.0}) {
    s.phase = milliseconds(ms);
    apply(s);
    for (const Flash& flash : film(0.2))
      EXPECT_EQ(wrap_symmetric(flash.at - base - ms * kTicks / 1000, period), 0) << ms;
  }
}

TEST_F(StrobeSketchThreads, PlaysItsCodeFromTheFirstFlashAfterTheSettings) {
  StrobeSettings s{.output = StrobeOutput::flashing, .rate = Hertz(100)};
  apply(s);
  const double base = film(0.1).at(0).at, period = kTicks / 100;
  s.code = {true, true, false, true, false, false, true, false, false};
  apply(s);
  const auto flashes = film(0.5);
  ASSERT_GE(flashes.size(), 16U);
  // Which flash of the base is the first is the controller's choice; from there the code says all.
  const double first = std::round((flashes[0].at - base) / period);
  std::size_t at = 0;
  for (std::size_t place = 0; at < flashes.size(); ++place) {
    if (!s.code[place % s.code.size()]) continue;
    EXPECT_NEAR(flashes[at++].at, base + (first + static_cast<double>(place)) * period, 1.001);
  }
}

TEST_F(StrobeSketchThreads, GivesSteadyLightAndDarkness) {
  apply({.output = StrobeOutput::steady});
  EXPECT_TRUE(avr::chip.pin());
  apply({.output = StrobeOutput::flashing, .rate = Hertz(10)});
  EXPECT_EQ(film(1).size(), 10U);
  apply({.output = StrobeOutput::off});
  EXPECT_FALSE(avr::chip.pin());
  EXPECT_TRUE(film(1).empty());
}

TEST_F(StrobeSketchThreads, AnInterruptThatComesTooLateLosesNoFlashAndLeavesNoLightOn) {
  apply({.output = StrobeOutput::flashing, .rate = Hertz(200), .width = microseconds(20)});
  avr::chip.slow = 60;  // 30 us: another interrupt was first
  const auto flashes = film(0.5);
  EXPECT_NEAR(static_cast<double>(flashes.size()), 100, 1);
  for (const Flash& flash : flashes) EXPECT_LT(flash.width, 70);
}

TEST_F(StrobeSketchThreads, CountsTheFlashesThatItGave) {
  apply({.output = StrobeOutput::flashing, .rate = Hertz(100), .code = {true, false}});
  const std::uint32_t before = ::given;
  const auto flashes = film(1);
  EXPECT_EQ(::given - before, flashes.size());
  EXPECT_NEAR(static_cast<double>(flashes.size()), 50, 1);
}

}  // namespace
}  // namespace emberlock::drivers
