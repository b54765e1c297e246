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
#include "daemon/server/job.h"
#include "daemon/server/viewer_messages.h"
#include "daemon/server/workers.h"

namespace emberlock::daemon {

class HttpConnection;
class Viewer;

/// What all connections share, and the loop that they run on. On the loop's thread alone, where not said
/// otherwise.
struct HttpContext {
  HttpContext(Api& daemon, HttpServerOptions wanted, HttpGate who, ConsoleFiles files);

  /// Something on the board changed. From any thread; returns at once.
  void wake();
  /// Writes to a viewer what is new for it.
  void serve(Viewer& viewer);
  [[nodiscard]] std::chrono::nanoseconds patience() const;
  /// Larger each time: who came, or was heard, when.
  [[nodiscard]] std::uint64_t next_turn() { return ++turns_; }
  /// Lets one connection go where there are as many as may be: crowd.h. False: each waits for its answer.
  [[nodiscard]] bool make_room_for_a_connection();
  /// Likewise of viewers.
  void make_room_for_a_viewer();

  Api& api;
  const HttpServerOptions options;
  const HttpGate gate;
  const ConsoleFiles console;
  std::shared_ptr<boost::asio::ssl::context> tls;  ///< null: plain
  ViewerMessages messages;                         ///< what viewers have in common is made once
  std::set<Viewer*> viewers;
  std::set<HttpConnection*> connections;
  std::set<std::shared_ptr<Job>> jobs;  ///< that run
  std::atomic<std::size_t> viewer_count = 0;

  // In this order they may go: workers call the loop, the loop's connections all of the above.
  boost::asio::io_context loop{1};
  Workers workers;
  Workers job_workers;

 private:
  void serve_all();
  void tick_at(TimePoint at);

  std::uint64_t turns_ = 0;
  std::atomic<bool> awake_ = false;
  boost::asio::steady_timer tick_{loop};
  std::optional<TimePoint> tick_due_;
};

}  // namespace emberlock::daemon
