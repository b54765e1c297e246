// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <set>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>

#include "base/time_point.h"
#include "daemon/server/console_files.h"
#include "daemon/server/http_request.h"
#include "daemon/server/http_server.h"
#include "daemon/server/job_watch.h"
#include "daemon/server/viewer_messages.h"
#include "daemon/work/workers.h"

namespace emberlock::daemon {

class HttpConnection;
class Viewer;

/// State shared by all connections, and the event loop that they run on. Only on the loop's thread, unless
/// stated otherwise.
struct HttpContext {
  HttpContext(Api& daemon, HttpServerOptions wanted, HttpGate who, ConsoleFiles files);

  /// Something on the board changed. Any thread; returns at once.
  void wake();
  /// Writes to a viewer what is new for it.
  void serve(Viewer& viewer);
  [[nodiscard]] std::chrono::nanoseconds patience() const;
  /// A rising counter that orders connections by their last activity.
  [[nodiscard]] std::uint64_t next_turn() { return ++turns_; }
  /// Closes a connection if the limit is reached: eviction.h. False: all of them wait for answers.
  [[nodiscard]] bool make_room_for_a_connection();
  /// The same for viewers.
  void make_room_for_a_viewer();

  Api& api;
  const HttpServerOptions options;
  const HttpGate gate;
  const ConsoleFiles console;
  std::shared_ptr<boost::asio::ssl::context> tls;  ///< null: plain
  ViewerMessages messages;                         ///< shared messages are made once for all viewers
  std::set<Viewer*> viewers;
  std::set<HttpConnection*> connections;
  std::set<std::shared_ptr<JobWatch>> jobs;  ///< running jobs
  std::atomic<std::size_t> viewer_count = 0;

  // Destroyed in reverse order: workers use the loop, and its connections use all members above.
  boost::asio::io_context loop{1};
  Workers workers;

 private:
  void serve_all();
  void tick_at(TimePoint at);

  std::uint64_t turns_ = 0;
  std::atomic<bool> awake_ = false;
  boost::asio::steady_timer tick_{loop};
  std::optional<TimePoint> tick_due_;
};

}  // namespace emberlock::daemon
