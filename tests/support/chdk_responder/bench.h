// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "drivers/ptp/chdk.h"
#include "drivers/ptp/session.h"
#include "drivers/virtual/virtual_clock.h"
#include "tests/support/chdk_responder/fake_transport.h"

namespace emberlock::chdk_responder {

/// A camera, a cable and a session, in virtual time.
struct Bench {
  explicit Bench(DeviceOptions options = {})
      : clock(std::make_shared<drivers::VirtualClock>()),
        cable(std::make_shared<Cable>(Cable{clock, Device(std::move(options))})),
        session(std::make_unique<FakeTransport>(cable), "camera E1", clock),
        chdk(session) {}
  Device& device() { return cable->device; }
  Seconds elapsed() { return clock->now() - TimePoint{}; }
  void pass(Seconds time) { clock->sleep_until(clock->now() + time); }
  void record() {
    ASSERT_TRUE(chdk.change_mode(drivers::ChdkMode::record).ok());
    pass(Seconds(1));
  }

  std::shared_ptr<drivers::VirtualClock> clock;
  std::shared_ptr<Cable> cable;
  drivers::PtpSession session;
  drivers::Chdk chdk;
};

/// With its session open.
struct OpenBench : Bench {
  explicit OpenBench(DeviceOptions options = {}) : Bench(std::move(options)) {
    EXPECT_TRUE(session.open().ok());
  }
};

}  // namespace emberlock::chdk_responder
