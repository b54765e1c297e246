// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "daemon/server/feeds.h"
#include "daemon/server/http_context.h"
#include "daemon/server/http_stream.h"

namespace emberlock::daemon {

/// The WebSocket of a console: one write at a time, always the newest data that it hasn't seen. A console
/// that doesn't read delays only itself, and is disconnected when it shows no sign of life. On the server's
/// thread.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  /// `who` is the authenticated client.
  Viewer(HttpContext& context, std::string who, HttpStream stream);
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  ~Viewer();

  /// Accepts the WebSocket request and serves until the console disconnects.
  void run(Request request);
  /// Something may be new. Returns when it must be called again without a change, if at all.
  std::optional<TimePoint> write(TimePoint now);
  void close();
  /// Closes it because it was evicted, and says so: the console then doesn't reconnect by itself.
  void make_room();
  [[nodiscard]] const std::string& who() const { return who_; }
  /// Whether it has sent its wishes, as each console does; and its order of arrival: larger is later.
  [[nodiscard]] bool spoke() const { return spoke_; }
  [[nodiscard]] std::uint64_t since() const { return since_; }

 private:
  void leave();
  void read();
  void hear(std::size_t bytes);
  void send(ViewerMessages::Shared message);
  [[nodiscard]] ViewerMessages::Shared next(TimePoint now, std::optional<TimePoint>& again);

  HttpContext& context_;
  const std::string who_;
  std::uint64_t since_;
  bool spoke_ = false;
  bool counted_ = true;
  boost::asio::steady_timer farewell_;
  boost::beast::websocket::stream<HttpStream> socket_;
  boost::beast::flat_buffer heard_;
  std::shared_ptr<const Request> request_;
  ViewerMessages::Shared in_flight_;  ///< null: nothing is being sent
  bool open_ = false;

  HistoryFeed history_;
  StatusFeed status_;
  NoticeFeed notices_;
  IterationFeed iterations_;
  std::unique_ptr<PictureFeed> pictures_;              ///< null: no pictures are wanted
  std::deque<ViewerMessages::Shared> iteration_rest_;  ///< remaining messages of the current iteration
};

}  // namespace emberlock::daemon
