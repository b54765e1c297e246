#include "daemon/server/http_context.h"

#include <algorithm>
#include <utility>

#include <boost/asio/post.hpp>

#include "base/clock.h"
#include "daemon/server/viewer.h"

namespace emberlock {

HttpContext::HttpContext(Api& daemon, HttpServerOptions wanted, HttpGate who, ConsoleFiles files)
    : api(daemon),
      options(std::move(wanted)),
      gate(std::move(who)),
      console(std::move(files)),
      workers(options.workers, options.waiting),
      job_workers(options.jobs, options.waiting_jobs) {}

std::chrono::nanoseconds HttpContext::patience() const {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(options.patience.value() * 1e9));
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
    if (error) return;  // an earlier one took its place
    tick_due_.reset();
    serve_all();
  });
}

}  // namespace emberlock
