// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

// Device side of the protocol of Emberlock's strobe controller: ../PROTOCOL.md. Plain C++11 without libraries
// or allocation, for a microcontroller with 2 kB. Tests on the host run it against the driver.
namespace emberlock_controller {

constexpr uint16_t kVersion = 1;
constexpr uint16_t kLongestCode = 4096;                                     // flashes
constexpr uint8_t kLongestLine = 128;                                       // bytes, without its end
constexpr uint8_t kCodeDigits = 64;                                         // hexadecimal digits per line
constexpr uint32_t kShortestPeriod = 3000000, kLongestPeriod = 2000000000;  // ns
constexpr uint32_t kShortestDog = 100, kLongestDog = 600000;                // ms

// CRC-16/CCITT-FALSE: x^16 + x^12 + x^5 + 1 from 0xFFFF; "123456789" gives 0x29B1.
inline uint16_t crc16(const char* bytes, size_t count, uint16_t crc = 0xFFFF) {
  for (size_t i = 0; i < count; ++i) {
    crc = static_cast<uint16_t>(crc ^ (static_cast<uint16_t>(static_cast<uint8_t>(bytes[i])) << 8));
    for (uint8_t bit = 0; bit < 8; ++bit) {
      const bool carry = (crc & 0x8000) != 0;
      crc = static_cast<uint16_t>(crc << 1);
      if (carry) crc = static_cast<uint16_t>(crc ^ 0x1021);
    }
  }
  return crc;
}

inline char hex_digit(uint8_t value) {
  return static_cast<char>(value < 10 ? '0' + value : 'A' + value - 10);
}
// 0..15; 16 if the character isn't a hexadecimal digit.
inline uint8_t hex_value(char c) {
  if (c >= '0' && c <= '9') return static_cast<uint8_t>(c - '0');
  if (c >= 'A' && c <= 'F') return static_cast<uint8_t>(c - 'A' + 10);
  return 16;
}

enum class Output : uint8_t { off, flash, steady };

struct Settings {
  Output output = Output::off;
  uint32_t period = 41708375;  // ns
  uint32_t phase = 0;          // ns, < period
  uint32_t width = 20000;      // ns, < period
  uint16_t code_length = 0;    // flashes; 0: no flash is skipped
};

// The controller's identity and limits.
struct Board {
  const char* model;        // no spaces
  const char* serial;       // no spaces
  uint32_t tick;            // ns: resolution of phase and width
  uint32_t shortest_width;  // ns
};

class Controller {
 public:
  explicit Controller(const Board& board) : board_(board) {}

  // Takes a byte from the line. Returns true when reply() is to be sent.
  bool take(char c, uint32_t now_ms) {
    if (c == '\r') return false;
    if (c != '\n') {
      if (length_ < kLongestLine) line_[length_] = c;
      if (length_ <= kLongestLine) ++length_;
      return false;
    }
    const bool answered =
        length_ <= kLongestLine && line_is_whole() ? (answer(now_ms), true) : (count_bad(), false);
    length_ = 0;
    return answered;
  }
  const char* reply() const { return reply_; }  // with its end

  // Call it often. Switches the light off when no command came for the watchdog time. Returns true when it
  // just did.
  bool watch(uint32_t now_ms) {
    if (dog_ == 0 || settings_.output == Output::off || now_ms - heard_ms_ < dog_) return false;
    settings_.output = Output::off;
    ++changes_;
    return true;
  }

  const Settings& settings() const { return settings_; }
  uint8_t changes() const { return changes_; }  // number of `set` commands applied plus watchdog events
  bool flashes(uint16_t place) const { return (active()[place >> 3] >> (7 - (place & 7)) & 1) != 0; }
  void set_flashes(uint32_t given) { flashes_ = given; }

 private:
  // Whether the line is complete: ":NN text*CCCC".
  bool line_is_whole() {
    if (length_ < 10 || line_[0] != ':' || line_[3] != ' ' || line_[length_ - 5] != '*') return false;
    const uint8_t high = hex_value(line_[1]), low = hex_value(line_[2]);
    if (high > 15 || low > 15) return false;
    uint16_t told = 0;
    for (uint8_t i = 0; i < 4; ++i) {
      const uint8_t digit = hex_value(line_[length_ - 4 + i]);
      if (digit > 15) return false;
      told = static_cast<uint16_t>(told << 4 | digit);
    }
    return crc16(line_, static_cast<size_t>(length_ - 5)) == told;
  }
  void count_bad() {
    if (length_ > 0 && bad_ < 0xFFFF) ++bad_;
  }

  void answer(uint32_t now_ms) {
    heard_ms_ = now_ms;
    // The command was repeated because our reply was lost (same number and checksum): the reply is sent
    // again, and the command isn't executed twice.
    char identity[6] = {line_[1], line_[2]};
    memcpy(identity + 2, line_ + length_ - 4, 4);
    if (memcmp(identity, last_, sizeof last_) == 0) return;
    memcpy(last_, identity, sizeof last_);
    used_ = 0;
    put('=');
    put(line_[1]);
    put(line_[2]);
    put(' ');
    line_[length_ - 5] = '\0';
    at_ = line_ + 4;
    if (word("hi") && ends()) {
      say_hello();
    } else if (restart() && word("get") && ends()) {
      say_settings();
    } else if (restart() && word("set")) {
      set();
    } else if (restart() && word("code")) {
      stage();
    } else if (restart() && word("bits")) {
      say_bits();
    } else {
      put("err 1 command");
    }
    const uint16_t crc = crc16(reply_, used_);
    put('*');
    for (int8_t shift = 12; shift >= 0; shift = static_cast<int8_t>(shift - 4))
      put(hex_digit(static_cast<uint8_t>(crc >> shift & 15)));
    put('\n');
    reply_[used_] = '\0';
  }

  void say_hello() {
    put("ok emberlock ");
    put(uint32_t{kVersion});
    put(' ');
    put(board_.model);
    put(' ');
    put(board_.serial);
    put_field(" tick=", board_.tick);
    put_field(" wid=", board_.shortest_width);
    put_field(" code=", kLongestCode);
  }

  void say_settings() {
    static const char* const kNames[] = {"off", "flash", "steady"};
    put("ok ");
    put(kNames[static_cast<uint8_t>(settings_.output)]);
    put_field(" per=", settings_.period);
    put_field(" pha=", settings_.phase);
    put_field(" wid=", settings_.width);
    put_field(" len=", settings_.code_length);
    put_field(" sum=", sum(active(), settings_.code_length));
    put_field(" dog=", dog_);
    put_field(" n=", flashes_);
    put_field(" bad=", bad_);
  }

  void set() {
    Settings next;
    uint32_t length = 0, told = 0, dog = 0;
    if (word("off")) {
      next.output = Output::off;
    } else if (word("flash")) {
      next.output = Output::flash;
    } else if (word("steady")) {
      next.output = Output::steady;
    } else {
      put("err 2 syntax");
      return;
    }
    if (!field("per", next.period) || !field("pha", next.phase) || !field("wid", next.width) ||
        !field("len", length) || !field("sum", told) || !field("dog", dog) || !ends()) {
      put("err 2 syntax");
      return;
    }
    if (outside("per", next.period, kShortestPeriod, kLongestPeriod) ||
        outside("pha", next.phase, 0, next.period - 1) ||
        outside("wid", next.width, board_.shortest_width, next.period - board_.shortest_width) ||
        outside("len", length, 0, kLongestCode)) {
      return;
    }
    if (dog != 0 && outside("dog", dog, kShortestDog, kLongestDog)) return;
    if (told != sum(staged(), static_cast<uint16_t>(length))) {
      put("err 4 code");
      return;
    }
    next.phase = rounded(next.phase, 0, next.period);
    next.width = rounded(next.width, board_.shortest_width, next.period);
    next.code_length = static_cast<uint16_t>(length);
    which_ ^= 1;
    memcpy(staged(), active(), sizeof codes_[0]);
    settings_ = next;
    dog_ = dog;
    ++changes_;
    say_settings();
  }

  // code OFFSET HEX: flashes from OFFSET on; takes effect with the next `set`.
  void stage() {
    uint32_t offset = 0;
    if (!number(offset) || offset % 8 != 0) {
      put("err 2 syntax");
      return;
    }
    uint8_t digits = 0;
    while (hex_value(at_[digits]) < 16) ++digits;
    if (digits == 0 || digits > kCodeDigits || digits % 2 != 0 || at_[digits] != '\0') {
      put("err 2 syntax");
      return;
    }
    if (outside("code", offset, 0, kLongestCode - uint32_t{digits} * 4)) return;
    for (uint8_t i = 0; i < digits; i = static_cast<uint8_t>(i + 2)) {
      staged()[(offset >> 3) + (i >> 1)] = static_cast<char>(hex_value(at_[i]) << 4 | hex_value(at_[i + 1]));
    }
    put("ok");
  }

  // bits OFFSET: the code in force from OFFSET on.
  void say_bits() {
    uint32_t offset = 0;
    if (!number(offset) || offset % 8 != 0 || *at_ != '\0') {
      put("err 2 syntax");
      return;
    }
    if (outside("bits", offset, 0, kLongestCode - 8)) return;
    put_field("ok ", offset);
    put(' ');
    for (uint8_t i = 0; i < kCodeDigits / 2 && (offset >> 3) + i < sizeof codes_[0]; ++i) {
      const uint8_t bits = static_cast<uint8_t>(active()[(offset >> 3) + i]);
      put(hex_digit(static_cast<uint8_t>(bits >> 4)));
      put(hex_digit(bits & 15));
    }
  }

  uint32_t rounded(uint32_t ns, uint32_t least, uint32_t below) const {
    uint32_t ticks = ns / board_.tick + (ns % board_.tick * 2 >= board_.tick ? 1 : 0);
    while (ticks * board_.tick >= below) --ticks;
    return ticks * board_.tick < least ? least : ticks * board_.tick;
  }
  bool outside(const char* name, uint32_t value, uint32_t least, uint32_t most) {
    if (value >= least && value <= most) return false;
    put("err 3 ");
    put(name);
    put_field(" ", least);
    put_field(" ", most);
    return true;
  }
  // Checksum of the first `length` flashes, eight per byte; unused bits of the last byte as received.
  static uint16_t sum(const char* code, uint16_t length) {
    return crc16(code, static_cast<size_t>((length + 7) >> 3));
  }

  bool restart() {
    at_ = line_ + 4;
    return true;
  }
  bool ends() const { return *at_ == '\0'; }
  // Reads the next word and the space after it.
  bool word(const char* text) {
    const size_t size = strlen(text);
    if (strncmp(at_, text, size) != 0 || (at_[size] != ' ' && at_[size] != '\0')) return false;
    at_ += size;
    if (*at_ == ' ') ++at_;
    return true;
  }
  bool number(uint32_t& value) {
    value = 0;
    uint8_t digits = 0;
    for (; *at_ >= '0' && *at_ <= '9'; ++at_, ++digits) {
      const uint32_t digit = static_cast<uint32_t>(*at_ - '0');
      if (value > (0xFFFFFFFF - digit) / 10) return false;
      value = value * 10 + digit;
    }
    if (digits == 0 || (*at_ != ' ' && *at_ != '\0')) return false;
    if (*at_ == ' ') ++at_;
    return true;
  }
  bool field(const char* name, uint32_t& value) {
    const size_t size = strlen(name);
    if (strncmp(at_, name, size) != 0 || at_[size] != '=') return false;
    at_ += size + 1;
    return number(value);
  }

  void put(char c) {
    if (used_ < sizeof reply_ - 1) reply_[used_++] = c;
  }
  void put(const char* text) {
    while (*text != '\0') put(*text++);
  }
  void put(uint32_t value) {
    char digits[10];
    uint8_t count = 0;
    do {
      digits[count++] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value != 0);
    while (count > 0) put(digits[--count]);
  }
  void put_field(const char* name, uint32_t value) {
    put(name);
    put(value);
  }

  const char* active() const { return codes_[which_]; }
  char* staged() { return codes_[which_ ^ 1]; }

  Board board_;
  Settings settings_;
  uint32_t dog_ = 0, heard_ms_ = 0, flashes_ = 0;
  uint16_t bad_ = 0;
  uint8_t changes_ = 0, which_ = 0;
  char last_[6] = {};
  char codes_[2][kLongestCode / 8] = {};
  const char* at_ = nullptr;
  uint8_t length_ = 0;
  uint8_t used_ = 0;
  char line_[kLongestLine + 1] = {};
  char reply_[kLongestLine + 8] = {};
};

}  // namespace emberlock_controller
