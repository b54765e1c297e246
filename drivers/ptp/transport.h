// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::drivers {

/// How a piece that was received ends.
enum class PtpPieceEnd {
  more,          ///< it is as long as was asked for: more may follow
  short_packet,  ///< the device ended its transfer with it
};

struct PtpPiece {
  std::span<const std::byte>
      bytes;  ///< the transport's, valid until it is called again; empty is an empty packet
  PtpPieceEnd end = PtpPieceEnd::more;
};

/// The two bulk pipes to one PTP device, which knows nothing of what they carry. One owner thread. Error
/// `device`, from any call: the device is gone, or its pipe is broken until recover().
class PtpTransport {
 public:
  virtual ~PtpTransport() = default;

  /// The size of the pipes' packets: what receive() is asked for must be a multiple.
  [[nodiscard]] virtual std::size_t packet_bytes() const = 0;
  /// Sends one transfer, with an empty packet behind it where its size asks for one. Error timed_out: a part
  /// may have been sent.
  virtual Status send(std::span<const std::byte> transfer, Seconds deadline) = 0;
  /// The next bytes that the device sends, at most `most`. Error timed_out: none yet; nothing is lost, and
  /// the next call must ask for the same `most`.
  virtual Result<PtpPiece> receive(std::size_t most, Seconds deadline) = 0;
  /// Makes both pipes usable after an error or in the middle of a transaction, within 1.6 s, unless the
  /// device doesn't even let a halt be cleared (the kernel gives that 5 s). It may have closed its session.
  virtual Status recover(std::uint32_t transaction) = 0;
};

}  // namespace emberlock::drivers
