// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/session.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace emberlock::drivers {
namespace {

enum Operation : std::uint16_t {
  kGetDeviceInfo = 0x1001,
  kOpenSession = 0x1002,
  kCloseSession = 0x1003,
  kGetStorageIds = 0x1004,
  kGetObjectHandles = 0x1007,
  kGetObjectInfo = 0x1008,
  kGetObject = 0x1009,
};
enum Response : std::uint16_t { kOk = 0x2001, kDeviceBusy = 0x2019, kSessionAlreadyOpen = 0x201e };

constexpr std::uint32_t kAny = 0xffffffff;
constexpr std::uint32_t kSessionId = 1;
constexpr Seconds kBusyPause = milliseconds(20);
constexpr Seconds kListDeadline{10};
constexpr std::size_t kLargestPiece = std::size_t{256} << 10;

}  // namespace

PtpSession::PtpSession(std::unique_ptr<PtpTransport> transport, std::string where,
                       std::shared_ptr<Clock> clock)
    : transport_(std::move(transport)), where_(std::move(where)), clock_(std::move(clock)) {}

Error PtpSession::named(Error error) const {
  if (error.where.empty()) error.where = where_;
  return error;
}

Error PtpSession::broken(std::string what) const {
  return {ErrorKind::device, std::move(what), where_, "unplug it and plug it in again"};
}

Error PtpSession::refused(std::uint16_t operation, std::uint16_t response) const {
  return {ErrorKind::device,
          fmt::format("it refuses {}: {}", ptp_operation_name(operation), ptp_response_words(response)),
          where_};
}

Error PtpSession::doubt(Error error) {
  exchange_.reset();
  state_ = State::in_doubt;
  return named(std::move(error));
}

std::optional<TimePoint> PtpSession::pending_since() const {
  return exchange_ ? std::optional(exchange_->since) : std::nullopt;
}

Status PtpSession::open() {
  Status opened = open_once();
  if (opened.ok() || state_ != State::in_doubt) return opened;
  // A program that died may have left a transaction unfinished.
  const Status recovered = transport_->recover(0);
  return recovered.ok() ? open_once() : named(recovered.error());
}

Status PtpSession::open_once() {
  // It may also have left its session open; close it so that transaction numbers restart.
  for (int attempt = 0; attempt < 2; ++attempt) {
    next_transaction_ = 0;
    EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer,
                               exchange({kOpenSession, {kSessionId}}, kPtpDeadline / 2));
    if (answer.code == kOk) {
      state_ = State::open;
      return {};
    }
    if (answer.code != kSessionAlreadyOpen) {
      return refused(kOpenSession, answer.code);
    }
    EMBERLOCK_RETURN_IF_ERROR(exchange({kCloseSession}, kPtpDeadline / 2));
  }
  return broken("it says that a session is open, and doesn't close it");
}

void PtpSession::close() {
  if (state_ == State::closed) return;
  // With a transaction pending the pipes would need recovery first; the next opener does that.
  if (state_ == State::open && !exchange_) (void)exchange({kCloseSession}, kPtpDeadline);
  exchange_.reset();
  state_ = State::closed;
}

Status PtpSession::ready() {
  if (exchange_) give_up();
  if (state_ == State::in_doubt) {
    const Status recovered = transport_->recover(next_transaction_ - 1);
    if (!recovered.ok()) return named(recovered.error());
    return open_once();
  }
  return state_ == State::open ? Status() : broken("its session isn't open");
}

Status PtpSession::send(const PtpRequest& request, std::uint32_t transaction) {
  const std::vector<std::byte> command =
      encode(PtpMessage{PtpType::command, request.operation, transaction, request.params});
  EMBERLOCK_RETURN_IF_ERROR(transport_->send(command, kPtpDeadline / 2));
  if (request.data.empty()) return {};
  const auto length = static_cast<std::uint32_t>(kPtpHeaderBytes + request.data.size());
  std::vector<std::byte> data = encode(PtpHeader{length, PtpType::data, request.operation, transaction});
  data.insert(data.end(), request.data.begin(), request.data.end());
  return transport_->send(data, kPtpDeadline / 2);
}

Status PtpSession::begin(const PtpRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(ready());
  exchange_ = Exchange{request, next_transaction_++, clock_->now()};
  const Status sent = send(request, exchange_->transaction);
  return sent.ok() ? sent : doubt(sent.error());
}

void PtpSession::give_up() {
  if (!exchange_) return;
  exchange_.reset();
  state_ = State::in_doubt;
}

Result<PtpAnswer> PtpSession::finish(Seconds deadline) {
  if (!exchange_) return broken("nothing was asked");
  const std::uint16_t operation = exchange_->request.operation;
  EMBERLOCK_ASSIGN_OR_RETURN(PtpAnswer answer, any_answer(deadline));
  if (answer.code != kOk) return refused(operation, answer.code);
  return answer;
}

Result<PtpAnswer> PtpSession::any_answer(Seconds deadline) {
  const TimePoint until = clock_->now() + deadline;
  while (!answered()) {
    const std::size_t packet = transport_->packet_bytes();
    std::size_t most = packet;
    if (exchange_->await == Await::data) {
      most = static_cast<std::size_t>(std::min<std::uint64_t>(exchange_->data_left, kLargestPiece));
      most = (most + packet - 1) / packet * packet;
    }
    const auto piece = transport_->receive(most, std::max(Seconds(0), until - clock_->now()));
    if (!piece.ok()) {
      if (piece.error().kind == ErrorKind::timed_out) return named(piece.error());
      return doubt(piece.error());
    }
    const Status taken = take(*piece);
    if (!taken.ok()) return doubt(taken.error());
  }
  PtpAnswer answer = std::move(exchange_->answer);
  exchange_.reset();
  return answer;
}

Status PtpSession::take(const PtpPiece& piece) {
  if (exchange_->await == Await::data) return take_data(piece.bytes, piece.end);
  if (piece.bytes.empty()) {
    // Data that fill their last packet may or may not be followed by an empty packet.
    if (std::exchange(exchange_->empty_packet_seen, true)) return broken("it sends empty packets only");
    return {};
  }
  return exchange_->await == Await::first ? take_first(piece) : take_response(piece.bytes);
}

Status PtpSession::take_first(const PtpPiece& piece) {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpHeader header, parse_ptp_header(piece.bytes));
  if (header.type != PtpType::data) return take_response(piece.bytes);
  if (header.transaction != exchange_->transaction || header.code != exchange_->request.operation) {
    return broken(fmt::format("it answers transaction {} ({:#06x}), but {} ({:#06x}) was asked",
                              header.transaction, header.code, exchange_->transaction,
                              exchange_->request.operation));
  }
  exchange_->await = Await::data;
  exchange_->data_left = header.length - kPtpHeaderBytes;
  if (header.length == kPtpLengthUnknown || exchange_->data_left > exchange_->request.most_data) {
    return broken(fmt::format("it announces {} bytes where {} are the most", header.length,
                              exchange_->request.most_data));
  }
  const auto payload = piece.bytes.subspan(kPtpHeaderBytes);
  // Some devices send the header in a transfer of its own.
  const bool header_alone = payload.empty() && exchange_->data_left > 0;
  return take_data(payload, header_alone ? PtpPieceEnd::more : piece.end);
}

Status PtpSession::take_data(std::span<const std::byte> bytes, PtpPieceEnd end) {
  if (bytes.size() > exchange_->data_left) return broken("it sends more data than it announced");
  exchange_->data_left -= bytes.size();
  if (!bytes.empty() && exchange_->request.sink) {
    EMBERLOCK_RETURN_IF_ERROR(exchange_->request.sink(bytes));
  } else {
    std::vector<std::byte>& data = exchange_->answer.data;
    if (data.empty()) data.reserve(bytes.size() + static_cast<std::size_t>(exchange_->data_left));
    data.insert(data.end(), bytes.begin(), bytes.end());
  }
  if (exchange_->data_left == 0) {
    exchange_->await = Await::response;
  } else if (end == PtpPieceEnd::short_packet) {
    return broken(fmt::format("its data end {} bytes too soon", exchange_->data_left));
  }
  return {};
}

Status PtpSession::take_response(std::span<const std::byte> bytes) {
  EMBERLOCK_ASSIGN_OR_RETURN(PtpMessage message, parse_ptp_message(bytes));
  if (message.type != PtpType::response || message.code == 0) return broken("it sends no response");
  if (message.transaction != exchange_->transaction) {
    return broken(fmt::format("it answers transaction {}, but {} was asked", message.transaction,
                              exchange_->transaction));
  }
  exchange_->answer.code = message.code;
  exchange_->answer.params = std::move(message.params);
  return {};
}

Result<PtpAnswer> PtpSession::exchange(const PtpRequest& request, Seconds deadline) {
  exchange_ = Exchange{request, next_transaction_++, clock_->now()};
  const Status sent = send(request, exchange_->transaction);
  if (!sent.ok()) return doubt(sent.error());
  auto answer = any_answer(deadline);
  if (!answer.ok() && exchange_) {
    give_up();
    return Error{ErrorKind::timed_out,
                 fmt::format("no answer to {} within {:.1f} s", ptp_operation_name(request.operation),
                             deadline.value()),
                 where_, "see whether the camera hangs: switch it off and on again"};
  }
  return answer;
}

Result<PtpAnswer> PtpSession::transact(const PtpRequest& request, Seconds deadline) {
  const TimePoint until = clock_->now() + deadline;
  EMBERLOCK_RETURN_IF_ERROR(ready());
  for (;;) {
    EMBERLOCK_ASSIGN_OR_RETURN(PtpAnswer answer, exchange(request, until - clock_->now()));
    if (answer.code == kOk) return answer;
    if (answer.code != kDeviceBusy || clock_->now() + kBusyPause >= until) {
      return refused(request.operation, answer.code);
    }
    clock_->sleep_until(clock_->now() + kBusyPause);
  }
}

Result<PtpDeviceInfo> PtpSession::device_info() {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer, transact({kGetDeviceInfo}, kPtpDeadline / 2));
  auto info = parse_ptp_device_info(answer.data);
  return info.ok() ? std::move(info) : named(info.error());
}

Result<std::vector<std::uint32_t>> PtpSession::storages() {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer, transact({kGetStorageIds}));
  auto list = parse_ptp_u32_array(answer.data);
  return list.ok() ? std::move(list) : named(list.error());
}

Result<std::vector<std::uint32_t>> PtpSession::objects(std::uint32_t folder) {
  // On any storage, of any format.
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer,
                             transact({kGetObjectHandles, {kAny, 0, folder}}, kListDeadline));
  auto list = parse_ptp_u32_array(answer.data);
  return list.ok() ? std::move(list) : named(list.error());
}

Result<PtpObjectInfo> PtpSession::object_info(std::uint32_t handle) {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer, transact({kGetObjectInfo, {handle}}));
  auto info = parse_ptp_object_info(answer.data);
  return info.ok() ? std::move(info) : named(info.error());
}

Status PtpSession::object(std::uint32_t handle, std::uint64_t bytes, const PtpSink& sink, Seconds deadline) {
  const auto answer = transact({kGetObject, {handle}, {}, sink, bytes}, deadline);
  return answer.ok() ? Status() : answer.error();
}

Result<std::uint64_t> PtpSession::partial_object(std::uint32_t handle, std::uint32_t offset,
                                                 std::uint32_t bytes, const PtpSink& sink, Seconds deadline) {
  std::uint64_t came = 0;
  const PtpSink counted = [&](std::span<const std::byte> piece) {
    came += piece.size();
    return sink(piece);
  };
  EMBERLOCK_RETURN_IF_ERROR(
      transact({kPtpGetPartialObject, {handle, offset, bytes}, {}, counted, bytes}, deadline));
  return came;
}

}  // namespace emberlock::drivers
