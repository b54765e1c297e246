// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <utility>
#include <vector>

// As much of an ATmega's timer 1 and of Arduino's core as our controller's sketch uses, in simulated time:
// reading the timer takes a tick, nothing else takes any.
namespace avr {

constexpr std::uint8_t kCom0 = 6, kCom1 = 7;

struct Chip {
  std::uint64_t ticks = 0;
  std::uint16_t compare = 0;
  std::uint8_t action = 0;  // TCCR1A
  bool latch = false, port = false, matched = false, enabled = false, interrupts = true;
  std::vector<std::pair<std::uint64_t, bool>> edges;  // of the pin
  std::deque<char> to_device;
  std::string from_device;
  void (*interrupt)() = nullptr;
  std::uint64_t slow = 0;  // ticks until an interrupt is served

  bool pin() const { return (action & (1 << kCom1)) != 0 ? latch : port; }
  void act() {
    if ((action & (1 << kCom1)) != 0) latch = (action & (1 << kCom0)) != 0;
    look();
  }
  void look() {
    if (edges.empty() ? pin() : edges.back().second != pin()) edges.emplace_back(ticks, pin());
  }
  void tick() {
    ++ticks;
    if (static_cast<std::uint16_t>(ticks) != compare) return;
    matched = true;
    act();
  }
  void run(std::uint64_t count) {
    for (const std::uint64_t end = ticks + count; ticks < end;) {
      tick();
      if (!matched || !enabled || !interrupts) continue;
      for (std::uint64_t i = 0; i < slow; ++i) tick();
      matched = false;
      interrupt();
    }
  }
};
inline Chip chip;

struct Tcnt1 {
  operator std::uint16_t() const { return chip.tick(), static_cast<std::uint16_t>(chip.ticks); }
};
struct Ocr1a {
  void operator=(std::uint16_t value) const { chip.compare = value; }
};
struct Tccr1a {
  void operator=(std::uint8_t value) const { chip.action = value, chip.look(); }
};
struct Tccr1c {
  void operator=(std::uint8_t value) const {
    if (value != 0) chip.act();
  }
};
struct Tifr1 {
  void operator=(std::uint8_t value) const {
    if (value != 0) chip.matched = false;
  }
};
struct Timsk1 {
  void operator=(std::uint8_t value) const { chip.enabled = value != 0; }
};
struct SerialLine {
  void begin(long /*baud*/) const {}
  int available() const { return static_cast<int>(chip.to_device.size()); }
  int read() const {
    const char c = chip.to_device.front();
    return chip.to_device.pop_front(), static_cast<unsigned char>(c);
  }
  void write(const char* text) const { chip.from_device += text; }
};

}  // namespace avr

inline constexpr avr::Tcnt1 TCNT1;
inline constexpr avr::Ocr1a OCR1A;
inline constexpr avr::Tccr1a TCCR1A;
inline constexpr avr::Tccr1c TCCR1C;
inline constexpr avr::Tifr1 TIFR1;
inline constexpr avr::Timsk1 TIMSK1;
inline constexpr avr::SerialLine Serial;
inline std::uint8_t TCCR1B;  // the clock, which runs by itself here
constexpr std::uint8_t COM1A0 = avr::kCom0, COM1A1 = avr::kCom1, FOC1A = 7, OCF1A = 1, OCIE1A = 1, CS11 = 1;
constexpr std::uint8_t OUTPUT = 1, HIGH = 1, LOW = 0;
#define ISR(vector) void vector()

inline void pinMode(std::uint8_t /*pin*/, std::uint8_t /*mode*/) {}
inline void digitalWrite(std::uint8_t /*pin*/, std::uint8_t level) {
  avr::chip.port = level != 0, avr::chip.look();
}
inline void noInterrupts() { avr::chip.interrupts = false; }
inline void interrupts() { avr::chip.interrupts = true; }
inline std::uint32_t millis() { return static_cast<std::uint32_t>(avr::chip.ticks / 2000); }
