// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdint.h>

namespace emberlock_controller {

struct PulseTrain {
  uint32_t period, phase, width;  // ns
  uint16_t code_length;           // flashes; 0: no flash is skipped
};

// Computes when the light goes on and off, in ticks of a timer that counts modulo 2^32.
class Flashes {
 public:
  enum class Kind : uint8_t { on, off, skip };  // skip: no action, but the next edge must be computed
  struct Edge {
    uint32_t at;
    Kind kind;
  };

  // `lead`: ticks needed to prepare an edge.
  Flashes(uint32_t tick_ns, uint32_t lead) : tick_ns_(tick_ns), lead_(lead) {}

  // Starts at `now`; or continues with the same period and another phase, width or code.
  void begin(const PulseTrain& train, uint32_t now) {
    const bool goes_on = running_ && train.period == period_;
    if (!goes_on) {
      base_ = now + lead_;
      rest_ns_ = 0;
    }
    running_ = true;
    period_ = train.period;
    phase_ = train.phase / tick_ns_;
    width_ = train.width / tick_ns_;
    code_length_ = train.code_length;
    place_ = 0;
    lit_ = past_ = false;
    while (static_cast<int32_t>(base_ + phase_ - now - lead_) < 0) next_period();
  }
  void stop() { running_ = false; }

  // Computes the next edge. Fast after `on`, since the flash may be short. `given(place)`: whether the code
  // gives that flash.
  template <class Given>
  Edge next(const Given& given) {
    if (lit_) {
      lit_ = false;
      return {base_ + phase_ + width_, Kind::off};
    }
    if (past_) {
      next_period();
      if (++place_ >= code_length_) place_ = 0;
    }
    past_ = true;
    lit_ = code_length_ == 0 || given(place_);
    return {base_ + phase_, lit_ ? Kind::on : Kind::skip};
  }

 private:
  // The fraction of a tick is carried to the next period, so that the mean rate is exact.
  void next_period() {
    const uint32_t ns = period_ + rest_ns_;
    base_ += ns / tick_ns_;
    rest_ns_ = ns % tick_ns_;
  }

  uint32_t tick_ns_, lead_;
  uint32_t base_ = 0, rest_ns_ = 0;  // start of this period
  uint32_t period_ = 0;              // ns
  uint32_t phase_ = 0, width_ = 0;   // ticks
  uint16_t code_length_ = 0, place_ = 0;
  bool running_ = false;
  bool lit_ = false;   // the next edge ends the flash
  bool past_ = false;  // this period's flash has been given or skipped
};

}  // namespace emberlock_controller
