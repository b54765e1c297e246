#pragma once

#include <deque>
#include <memory>
#include <optional>

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "daemon/server/feeds.h"
#include "daemon/server/http_context.h"
#include "daemon/server/http_stream.h"

namespace emberlock {

/// One console's WebSocket: one write in flight, and for the next the newest of what it hasn't seen. A
/// console that doesn't read stands still alone, and is gone when it gives no sign of life. On the server's
/// thread.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  Viewer(HttpContext& context, HttpStream stream);
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  ~Viewer();

  /// Answers the request for it and serves until the console goes.
  void run(Request request);
  /// Something may be new. Returns when it wants to be asked again without that, if so.
  std::optional<TimePoint> write(TimePoint now);
  void close();

 private:
  void read();
  void hear(std::size_t bytes);
  void send(ViewerMessages::Shared message);
  [[nodiscard]] ViewerMessages::Shared next(TimePoint now, std::optional<TimePoint>& again);

  HttpContext& context_;
  boost::beast::websocket::stream<HttpStream> socket_;
  boost::beast::flat_buffer heard_;
  std::shared_ptr<const Request> request_;
  ViewerMessages::Shared in_flight_;  ///< null: none
  bool open_ = false;

  HistoryFeed history_;
  StatusFeed status_;
  NoticeFeed notices_;
  IterationFeed iterations_;
  std::unique_ptr<PictureFeed> pictures_;              ///< null: none are wanted
  std::deque<ViewerMessages::Shared> iteration_rest_;  ///< of the iteration that is being sent
};

}  // namespace emberlock
