// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/http_context.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <boost/asio/post.hpp>

#include "base/clock.h"
#include "daemon/server/eviction.h"
#include "daemon/server/http_connection.h"
#include "daemon/server/viewer.h"

namespace emberlock::daemon {

HttpContext::HttpContext(Api& daemon, HttpServerOptions wanted, HttpGate who, ConsoleFiles files)
    : api(daemon),
      options(std::move(wanted)),
      gate(std::move(who)),
      console(std::move(files)),
      workers(options.workers, options.waiting) {}

std::chrono::nanoseconds HttpContext::patience() const {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(options.patience.value() * 1e9));
}

bool HttpContext::make_room_for_a_connection() {
  if (connections.size() < options.connections) return true;
  std::vector<HttpConnection*> those;
  std::vector<Occupant> occupants;
  for (HttpConnection* one : connections) {
    if (one->standing() == HttpConnection::Standing::working) continue;
    those.push_back(one);
    occupants.push_back({one->peer(), static_cast<int>(one->standing()), one->since()});
  }
  const auto leaves = choose_evicted(occupants);
  if (leaves) those[*leaves]->close();
  return leaves.has_value();
}

void HttpContext::make_room_for_a_viewer() {
  if (viewers.size() < options.viewers) return;
  const std::vector<Viewer*> those(viewers.begin(), viewers.end());
  std::vector<Occupant> occupants;
  occupants.reserve(those.size());
  for (const Viewer* one : those) occupants.push_back({one->who(), one->spoke() ? 1 : 0, one->since()});
  if (const auto leaves = choose_evicted(occupants)) those[*leaves]->make_room();
}

void HttpContext::wake() {
  if (viewer_count == 0 || awake_.exchange(true)) return;
  boost::asio::post(loop, [this] {
    awake_ = false;
    serve_all();
  });
}

void HttpContext::serve_all() {
  for (Viewer* viewer : viewers) serve(*viewer);
}

void HttpContext::serve(Viewer& viewer) {
  if (const auto again = viewer.write(SteadyClock().now())) tick_at(*again);
}

void HttpContext::tick_at(TimePoint at) {
  const TimePoint now = SteadyClock().now();
  if (tick_due_ && *tick_due_ <= at) return;
  tick_due_ = at;
  tick_.expires_after(std::chrono::nanoseconds(std::max<std::int64_t>(0, at.ns - now.ns)));
  tick_.async_wait([this](boost::system::error_code error) {
    if (error) return;  // replaced by an earlier tick
    tick_due_.reset();
    serve_all();
  });
}

}  // namespace emberlock::daemon
