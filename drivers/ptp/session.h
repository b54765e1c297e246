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

/// How long a device may take for an answer without much data.
inline constexpr Seconds kPtpDeadline{1};

inline constexpr std::uint16_t kPtpGetPartialObject = 0x101b;
/// The folder that holds what lies in none.
inline constexpr std::uint32_t kPtpRoot = 0xffffffff;

/// Takes the data of an answer piece by piece; its error ends the transaction.
using PtpSink = std::function<Status(std::span<const std::byte>)>;

struct PtpRequest {
  std::uint16_t operation = 0;
  std::vector<std::uint32_t> params = {};  ///< at most kPtpMostParams
  std::span<const std::byte> data = {};    ///< to send; must live until the transaction ends
  PtpSink sink = {};                       ///< of what comes; else it is collected in the answer
  std::uint64_t most_data = 64ULL << 20;   ///< bytes that may come; more is an error
};

struct PtpAnswer {
  std::uint16_t code = 0;  ///< of the response
  std::vector<std::uint32_t> params;
  std::vector<std::byte> data;

  /// Parameters that a device leaves out are zero.
  [[nodiscard]] std::uint32_t param(std::size_t i) const { return i < params.size() ? params[i] : 0; }
};

/// A session with one PTP device: one transaction at a time, numbered, each answer checked against what was
/// asked. One owner thread.
///
/// Errors are of kind `device` (it is gone, it refuses, or what it sent breaks the rules) or timed_out, and
/// name it as `where`. After one that leaves the pipes in doubt the next transaction first recovers them and
/// opens the session again.
class PtpSession {
 public:
  PtpSession(std::unique_ptr<PtpTransport> transport, std::string where, std::shared_ptr<Clock> clock);
  ~PtpSession() { close(); }
  PtpSession(const PtpSession&) = delete;
  PtpSession& operator=(const PtpSession&) = delete;

  Status open();
  /// Within kPtpDeadline; harmless when it isn't open.
  void close();

  /// A whole transaction that the device does; asks again while it is busy. Error timed_out: it is given up.
  Result<PtpAnswer> transact(const PtpRequest& request, Seconds deadline = kPtpDeadline);

  /// The same in two parts, so that a caller needn't wait: between them nothing else may be asked. finish()
  /// says timed_out while the answer isn't whole, and may be called again, or the transaction given up.
  Status begin(const PtpRequest& request);
  Result<PtpAnswer> finish(Seconds deadline);
  void give_up();
  /// When the transaction under way began; absent: there is none.
  [[nodiscard]] std::optional<TimePoint> pending_since() const;

  Result<PtpDeviceInfo> device_info();
  Result<std::vector<std::uint32_t>> storages();
  /// Handles of the files and folders in a folder; of a full one that may take seconds.
  Result<std::vector<std::uint32_t>> objects(std::uint32_t folder = kPtpRoot);
  Result<PtpObjectInfo> object_info(std::uint32_t handle);
  /// The whole of a file, into `sink`.
  Status object(std::uint32_t handle, std::uint64_t bytes, const PtpSink& sink, Seconds deadline);
  /// At most `bytes` of it from `offset` on; how many came.
  Result<std::uint64_t> partial_object(std::uint32_t handle, std::uint32_t offset, std::uint32_t bytes,
                                       const PtpSink& sink, Seconds deadline);

  [[nodiscard]] const std::string& where() const { return where_; }
  /// How errors name the device from now on.
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
  /// Asks outside of a session or in one, and takes any response.
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
