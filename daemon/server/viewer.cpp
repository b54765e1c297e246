// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/viewer.h"

#include <chrono>
#include <string_view>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include "base/clock.h"

namespace emberlock::daemon {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;

/// Limit of the kernel's send buffer for a viewer. Small, so that a slow connection shows new data rather
/// than queued data.
constexpr int kKernelBytes = 256 << 10;
constexpr int kUnsentBytes = 64 << 10;

constexpr std::uint16_t kMadeRoom = 4001;     // a WebSocket close code from the range for applications
constexpr std::chrono::seconds kFarewell{1};  // for the other side to close too

void keep_kernel_queue_short(int socket) {
  (void)::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &kKernelBytes, sizeof(kKernelBytes));
  (void)::setsockopt(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytes, sizeof(kUnsentBytes));
}

}  // namespace

Viewer::Viewer(HttpContext& context, std::string who, HttpStream stream)
    : context_(context),
      who_(std::move(who)),
      since_(context.next_turn()),
      farewell_(context.loop),
      socket_(std::move(stream)),
      history_(context.api.board()),
      status_(context.api.board()),
      notices_(context.api.board(), 0),
      iterations_(context.api.board()) {
  context_.viewers.insert(this);
  ++context_.viewer_count;
  keep_kernel_queue_short(beast::get_lowest_layer(socket_).socket().native_handle());
}

Viewer::~Viewer() { leave(); }

void Viewer::leave() {
  if (!std::exchange(counted_, false)) return;
  context_.viewers.erase(this);
  if (--context_.viewer_count == 0) context_.messages.forget();
}

void Viewer::run(Request request) {
  beast::get_lowest_layer(socket_).expires_never();  // the WebSocket has deadlines of its own
  websocket::stream_base::timeout deadlines{};
  deadlines.handshake_timeout = context_.patience();
  deadlines.idle_timeout = context_.patience();
  deadlines.keep_alive_pings = true;
  socket_.set_option(deadlines);
  socket_.read_message_max(context_.options.largest_wish);
  socket_.auto_fragment(false);
  request_ = std::make_shared<const Request>(std::move(request));
  socket_.async_accept(*request_, [self = shared_from_this()](beast::error_code error) {
    if (error) return;
    self->open_ = true;
    self->request_.reset();
    self->read();
    self->context_.serve(*self);
  });
}

void Viewer::close() {
  open_ = false;
  beast::get_lowest_layer(socket_).close();
}

void Viewer::make_room() {
  leave();
  open_ = false;
  pictures_.reset();
  // A client that doesn't read won't get a close message either.
  if (in_flight_ || request_) return beast::get_lowest_layer(socket_).close();
  farewell_.expires_after(kFarewell);
  farewell_.async_wait([self = shared_from_this()](beast::error_code /*error*/) { self->close(); });
  socket_.async_close({static_cast<websocket::close_code>(kMadeRoom), "another console was opened"},
                      [self = shared_from_this()](beast::error_code /*error*/) { self->farewell_.cancel(); });
}

void Viewer::read() {
  socket_.async_read(heard_, [self = shared_from_this()](beast::error_code error, std::size_t bytes) {
    if (error) return self->close();
    self->hear(bytes);
  });
}

void Viewer::hear(std::size_t bytes) {
  const std::string_view text(static_cast<const char*>(heard_.data().data()), bytes);
  const auto wish = parse_wish(text);
  heard_.consume(heard_.size());
  if (!counted_) return read();  // evicted; waits for the other side's close message
  if (!wish || !socket_.got_text()) {
    open_ = false;
    return socket_.async_close({websocket::close_code::policy_error, "no such message"},
                               [self = shared_from_this()](beast::error_code /*error*/) { self->close(); });
  }
  spoke_ = true;
  since_ = context_.next_turn();
  // The new feed is created before the old one is destroyed, so that pictures continue to be made.
  pictures_ = *wish ? std::make_unique<PictureFeed>(context_.api.board(), **wish) : nullptr;
  context_.serve(*this);
  read();
}

ViewerMessages::Shared Viewer::next(TimePoint now, std::optional<TimePoint>& again) {
  const auto newest = [&](auto& feed) {
    auto next = feed.next(now);
    if (next.again) again = std::min(again.value_or(*next.again), *next.again);
    return next.message;
  };
  if (const auto status = newest(history_)) return context_.messages.history_of(status);
  if (const auto status = newest(status_)) return context_.messages.of(status);
  if (const auto notice = newest(notices_))
    return std::make_shared<const WatchMessage>(watch_message(*notice));
  if (iteration_rest_.empty()) {
    if (const auto preview = newest(iterations_)) {
      auto messages = context_.messages.of(preview);
      iteration_rest_.assign(messages.begin(), messages.end());
    }
  }
  if (!iteration_rest_.empty()) {
    auto message = std::move(iteration_rest_.front());
    iteration_rest_.pop_front();
    return message;
  }
  if (!pictures_) return nullptr;
  const auto picture = newest(*pictures_);
  return picture ? context_.messages.of(picture) : nullptr;
}

std::optional<TimePoint> Viewer::write(TimePoint now) {
  std::optional<TimePoint> again;
  if (!open_ || in_flight_) return again;
  auto message = next(now, again);
  if (!message) return again;
  send(std::move(message));
  return std::nullopt;
}

void Viewer::send(ViewerMessages::Shared message) {
  in_flight_ = std::move(message);
  socket_.binary(in_flight_->kind == WatchMessage::Kind::binary);
  socket_.async_write(boost::asio::buffer(in_flight_->bytes),
                      [self = shared_from_this()](beast::error_code error, std::size_t /*bytes*/) {
                        self->in_flight_.reset();
                        if (error) return self->close();
                        self->context_.serve(*self);
                      });
}

}  // namespace emberlock::daemon
