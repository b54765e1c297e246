// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "base/clock.h"
#include "drivers/ptp/transport.h"
#include "tests/support/chdk_responder/chdk_device.h"

namespace emberlock::chdk_responder {

/// The cable between a session and a Device, in process: waits pass on the clock, which a test lets run by
/// itself.
struct Cable {
  std::shared_ptr<Clock> clock;
  Device device;
  bool plugged = true;
  int recoveries = 0;
  int transports = 0;  ///< open now
};

class FakeTransport final : public drivers::PtpTransport {
 public:
  explicit FakeTransport(std::shared_ptr<Cable> cable) : cable_(std::move(cable)) { ++cable_->transports; }
  ~FakeTransport() override { --cable_->transports; }
  FakeTransport(const FakeTransport&) = delete;
  FakeTransport& operator=(const FakeTransport&) = delete;

  [[nodiscard]] std::size_t packet_bytes() const override { return cable_->device.options().packet_bytes; }

  Status send(std::span<const std::byte> transfer, Seconds /*deadline*/) override {
    if (!cable_->plugged || halted_) return gone();
    cable_->device.receive(transfer, cable_->clock->now());
    return {};
  }

  Result<drivers::PtpPiece> receive(std::size_t most, Seconds deadline) override {
    if (!cable_->plugged || halted_) return gone();
    const TimePoint until = cable_->clock->now() + deadline;
    const auto ready = cable_->device.next_ready();
    cable_->clock->sleep_until(std::min(until, ready.value_or(until)));
    auto piece = cable_->device.take(most, until);
    if (!piece) return Error{ErrorKind::timed_out, "nothing came"};
    halted_ = piece->stalls;
    if (halted_) return gone();
    bytes_ = std::move(piece->bytes);
    return drivers::PtpPiece{
        bytes_, bytes_.size() < most ? drivers::PtpPieceEnd::short_packet : drivers::PtpPieceEnd::more};
  }

  Status recover(std::uint32_t /*transaction*/) override {
    if (!cable_->plugged) return gone();
    ++cable_->recoveries;
    halted_ = false;
    cable_->device.reset();
    return {};
  }

 private:
  static Error gone() { return {ErrorKind::device, "it is unplugged, or its pipe stalls"}; }

  std::shared_ptr<Cable> cable_;
  std::vector<std::byte> bytes_;
  bool halted_ = false;
};

}  // namespace emberlock::chdk_responder
