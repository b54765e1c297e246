// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/quantity.h"
#include "base/result.h"
#include "drivers/ptp/container.h"
#include "drivers/ptp/transport.h"

namespace emberlock::drivers {

/// Time limit for an answer without much data.
inline constexpr Seconds kPtpDeadline{1};

inline constexpr std::uint16_t kPtpGetPartialObject = 0x101b;
/// The parent handle of objects that are in no folder.
inline constexpr std::uint32_t kPtpRoot = 0xffffffff;

/// Receives the data of an answer piece by piece; its error ends the transaction.
using PtpSink = std::function<Status(std::span<const std::byte>)>;

struct PtpRequest {
  std::uint16_t operation = 0;
  std::vector<std::uint32_t> params = {};  ///< at most kPtpMostParams
  std::span<const std::byte> data = {};    ///< to send; must live until the transaction ends
  PtpSink sink = {};                       ///< receives the data; if empty, the answer collects them
  std::uint64_t most_data = 64ULL << 20;   ///< limit of the received bytes; more is an error
};

struct PtpAnswer {
  std::uint16_t code = 0;  ///< of the response
  std::vector<std::uint32_t> params;
  std::vector<std::byte> data;

  /// Parameters that the device omitted are zero.
  [[nodiscard]] std::uint32_t param(std::size_t i) const { return i < params.size() ? params[i] : 0; }
};

/// A session with one PTP device: one numbered transaction at a time; each answer is checked against its
/// request. One owner thread.
///
/// Errors are of kind `device` (gone, refuses, or sent invalid data) or timed_out, and name the device as
/// `where`. After an error that leaves the state of the pipes unknown, the next transaction first recovers
/// them and reopens the session.
class PtpSession {
 public:
  PtpSession(std::unique_ptr<PtpTransport> transport, std::string where, std::shared_ptr<Clock> clock);
  ~PtpSession() { close(); }
  PtpSession(const PtpSession&) = delete;
  PtpSession& operator=(const PtpSession&) = delete;

  Status open();
  /// Takes at most kPtpDeadline; no effect when it isn't open.
  void close();

  /// A whole transaction; repeated while the device is busy. Error timed_out: the transaction was abandoned.
  Result<PtpAnswer> transact(const PtpRequest& request, Seconds deadline = kPtpDeadline);

  /// The same in two parts, so that the caller needn't block. No other request is allowed between them.
  /// finish() returns timed_out while the answer is incomplete; then call it again, or abandon the
  /// transaction.
  Status begin(const PtpRequest& request);
  Result<PtpAnswer> finish(Seconds deadline);
  void give_up();
  /// When the pending transaction began; nullopt if there is none.
  [[nodiscard]] std::optional<TimePoint> pending_since() const;

  Result<PtpDeviceInfo> device_info();
  Result<std::vector<std::uint32_t>> storages();
  /// Handles of the files and folders in a folder. This may take seconds for a full folder.
  Result<std::vector<std::uint32_t>> objects(std::uint32_t folder = kPtpRoot);
  Result<PtpObjectInfo> object_info(std::uint32_t handle);
  /// Reads a whole file into `sink`.
  Status object(std::uint32_t handle, std::uint64_t bytes, const PtpSink& sink, Seconds deadline);
  /// Reads at most `bytes` of a file from `offset` on. Returns the number of bytes received.
  Result<std::uint64_t> partial_object(std::uint32_t handle, std::uint32_t offset, std::uint32_t bytes,
                                       const PtpSink& sink, Seconds deadline);

  [[nodiscard]] const std::string& where() const { return where_; }
  /// Sets the name of the device in errors.
  void rename(std::string where) { where_ = std::move(where); }
  [[nodiscard]] Clock& clock() const { return *clock_; }

 private:
  enum class State { closed, open, in_doubt };
  enum class Await { first, data, response };
  struct Exchange {
    PtpRequest request;
    std::uint32_t transaction = 0;
    TimePoint since;
    Await await = Await::first;
    std::uint64_t data_left = 0;
    bool empty_packet_seen = false;
    PtpAnswer answer = {};
  };

  Status open_once();
  Status ready();
  Status send(const PtpRequest& request, std::uint32_t transaction);
  /// Sends a request, inside or outside a session, and accepts any response.
  Result<PtpAnswer> exchange(const PtpRequest& request, Seconds deadline);
  Result<PtpAnswer> any_answer(Seconds deadline);
  Status take(const PtpPiece& piece);
  Status take_first(const PtpPiece& piece);
  Status take_data(std::span<const std::byte> bytes, PtpPieceEnd end);
  Status take_response(std::span<const std::byte> bytes);
  [[nodiscard]] bool answered() const { return exchange_->answer.code != 0; }
  [[nodiscard]] Error broken(std::string what) const;
  [[nodiscard]] Error refused(std::uint16_t operation, std::uint16_t response) const;
  [[nodiscard]] Error named(Error error) const;
  Error doubt(Error error);

  std::unique_ptr<PtpTransport> transport_;
  std::string where_;
  std::shared_ptr<Clock> clock_;
  State state_ = State::closed;
  std::uint32_t next_transaction_ = 0;
  std::optional<Exchange> exchange_;
};

}  // namespace emberlock::drivers
