// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::drivers {

/// How a received piece ends.
enum class PtpPieceEnd {
  more,          ///< as long as requested: more may follow
  short_packet,  ///< with a short packet, which ends the device's transfer
};

struct PtpPiece {
  std::span<const std::byte>
      bytes;  ///< owned by the transport, valid until the next call; empty for an empty packet
  PtpPieceEnd end = PtpPieceEnd::more;
};

/// The two bulk pipes to a PTP device, without knowledge of their content. One owner thread. Error `device`,
/// from any call: the device is gone, or its pipe is unusable until recover().
class PtpTransport {
 public:
  virtual ~PtpTransport() = default;

  /// The packet size of the pipes: lengths passed to receive() must be multiples of it.
  [[nodiscard]] virtual std::size_t packet_bytes() const = 0;
  /// Sends one transfer, with an empty packet behind it if its size requires one. Error timed_out: a part may
  /// have been sent.
  virtual Status send(std::span<const std::byte> transfer, Seconds deadline) = 0;
  /// The next bytes from the device, at most `most`. Error timed_out: none yet; nothing is lost, and the next
  /// call must pass the same `most`.
  virtual Result<PtpPiece> receive(std::size_t most, Seconds deadline) = 0;
  /// Makes both pipes usable again after an error or during a transaction. Takes up to 1.6 s, or longer if
  /// the device doesn't even allow a halt to be cleared (the kernel waits 5 s for that). The device may have
  /// closed its session.
  virtual Status recover(std::uint32_t transaction) = 0;
};

}  // namespace emberlock::drivers
