// SPDX-License-Identifier: Apache-2.0
// What consoles cost the daemon: 11 cameras of 1280 x 720 Mono8 at 24 frames a second, shown to 1, 10 and 50
// of them, of the 50 one that never reads. The consoles are a process of their own, so that the processor
// time is the daemon's alone.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/random.h"
#include "daemon/server/http_server.h"
#include "daemon/server/json_api.h"
#include "daemon/server/metrics.h"
#include "daemon/server/pictures.h"
#include "tests/support/fake_api.h"
#include "tests/support/watch_client.h"

namespace emberlock {
namespace {

constexpr int kCameras = 11;
constexpr double kFrameRate = 24;
constexpr Seconds kDuration{10};

/// A dark picture with noise and a lamp's spot, as cameras of a rig see it.
std::shared_ptr<const Image> dark_room(std::uint64_t seed) {
  auto image = std::make_shared<Image>(ImageLayout{{1280, 720}, PixelFormat::gray8, 8});
  RandomStream random(seed, 1);
  for (int y = 0; y < 720; ++y) {
    for (int x = 0; x < 1280; ++x) {
      const bool lamp = (x - 640) * (x - 640) + (y - 360) * (y - 360) < 900;
      image->row_as<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(lamp ? 250 : 12 + random.bits() % 6);
    }
  }
  return image;
}

constexpr int kRounds = 500;
constexpr std::uint64_t kFramesPerRound = 24;

void add_round(v1::DaemonStatus& status, std::uint32_t round) {
  auto& history = *status.mutable_alignment()->mutable_history();
  v1::RoundPoint& point = *history.Add();
  point.set_round(round);
  point.set_at_s(round * kFramesPerRound / kFrameRate);
  for (int i = 0; i < kCameras; ++i) point.add_error_rows(12.3456789 / (i + round));
  point.set_resets(round / 2);
  if (history.size() > kRounds) history.erase(history.begin());
}

/// With as long a history as there is.
v1::DaemonStatus long_aligned() {
  v1::DaemonStatus status;
  status.set_phase(v1::ALIGNING);
  for (std::uint32_t round = 0; round < kRounds; ++round) add_round(status, round);
  for (int i = 0; i < kCameras; ++i) {
    v1::CameraStatus& camera = *status.add_cameras();
    camera.set_id(fmt::format("camera {}", i));
    camera.set_state(v1::CameraStatus::FILMING);
    camera.set_error_rows(1.2345678 * i);
    camera.set_reason("films");
    camera.mutable_counts()->set_delivered(1000);
  }
  return status;
}

struct Seen {
  double slowest_hz = 0;  ///< of all consoles that read and all cameras
  double late_ms = 0;     ///< from a frame's arrival to its picture, the 95th percentile
  double text_bytes = 0;  ///< a second, of status and rounds, to one console
};

/// The consoles' process: reads for a while, and counts.
Seen watch(int port, int consoles, int stalled) {
  std::vector<test::WatchClient> all;
  for (int i = 0; i < consoles; ++i) all.emplace_back(port).say(R"({"watch": {"rate_hz": 12}})");
  std::vector<pollfd> sockets;
  for (int i = stalled; i < consoles; ++i) sockets.push_back({all[i].descriptor(), POLLIN, 0});
  std::vector<std::map<std::string, int>> counts(sockets.size());
  std::vector<double> late_ms;
  double text_bytes = 0;
  const SteadyClock clock;
  const TimePoint settled = clock.now() + Seconds(1);
  while (clock.now() < settled + kDuration) {
    ::poll(sockets.data(), sockets.size(), 100);
    for (std::size_t i = 0; i < sockets.size(); ++i) {
      if (sockets[i].revents == 0) continue;
      while (const auto message = all[i + static_cast<std::size_t>(stalled)].hear_now()) {
        if (clock.now() < settled) continue;
        if (message->opcode == 1) text_bytes += static_cast<double>(message->bytes.size());
        if (message->opcode != 2) continue;
        const auto header = nlohmann::json::parse(message->bytes.substr(4, message->bytes.find('}', 4) - 3));
        ++counts[i][header["camera_id"]];
        late_ms.push_back(in_milliseconds(clock.now() - TimePoint{header["monotonic_ns"]}));
      }
    }
  }
  Seen seen{1e9, 0, text_bytes / kDuration.value() / static_cast<double>(counts.size())};
  for (const auto& console : counts) {
    if (console.size() < kCameras) seen.slowest_hz = 0;
    for (const auto& [camera, pictures] : console)
      seen.slowest_hz = std::min(seen.slowest_hz, pictures / kDuration.value());
  }
  std::sort(late_ms.begin(), late_ms.end());
  if (!late_ms.empty()) seen.late_ms = late_ms[late_ms.size() * 95 / 100];
  return seen;
}

void measure(int consoles, int stalled) {
  int to_child[2], to_parent[2];
  if (::pipe(to_child) != 0 || ::pipe(to_parent) != 0) return;
  const pid_t child = ::fork();
  if (child == 0) {
    int port = 0;
    if (::read(to_child[0], &port, sizeof(port)) != sizeof(port)) ::_exit(1);
    const Seen seen = watch(port, consoles, stalled);
    ::_exit(::write(to_parent[1], &seen, sizeof(seen)) == sizeof(seen) ? 0 : 1);
  }
  test::FakeApi api;
  const auto server = daemon::HttpServer::start(
      api, {.listen = "127.0.0.1:0", .token = *rig::Token::parse(test::kHttpToken)});
  if (!server) return;
  daemon::Pictures pictures(api.board(), {});
  std::atomic<bool> over = false;
  v1::DaemonStatus status = long_aligned();
  std::thread cameras([&] {
    SteadyClock clock;
    std::vector<Frame> frames;
    for (int i = 0; i < kCameras; ++i) frames.push_back({.stamp = {}, .image = dark_room(i)});
    const TimePoint begun = clock.now();
    for (std::uint64_t n = 0; !over; ++n) {
      clock.sleep_until(begun + Seconds(static_cast<double>(n) / kFrameRate));
      status.set_now_ns(clock.now().ns);
      if (n % kFramesPerRound == 0) add_round(status, static_cast<std::uint32_t>(kRounds + n));
      api.board().show(status);
      for (int i = 0; i < kCameras; ++i) {
        frames[i].stamp.frame_id = n;
        frames[i].stamp.monotonic_time = clock.now();
        pictures.offer(fmt::format("camera {}", i), frames[i]);
      }
    }
  });
  const int port = (*server)->port();
  const double cpu = daemon::process_usage().cpu_s;
  Seen seen;
  if (::write(to_child[1], &port, sizeof(port)) != sizeof(port) ||
      ::read(to_parent[0], &seen, sizeof(seen)) != sizeof(seen))
    std::puts("the consoles failed");
  const daemon::ProcessUsage usage = daemon::process_usage();
  over = true;
  cameras.join();
  ::waitpid(child, nullptr, 0);
  fmt::print(
      "{:3} consoles ({} stalled): {:5.1f} pictures/s of the slowest camera, {:4.0f} ms late (95 %), daemon "
      "{:5.1f} % of a "
      "core, {} MB; {:.0f} kB/s of status and rounds a console (a status with its rounds: {:.0f} kB)\n",
      consoles, stalled, seen.slowest_hz, seen.late_ms, 100 * (usage.cpu_s - cpu) / (kDuration.value() + 1),
      usage.resident_bytes >> 20, seen.text_bytes / 1000,
      static_cast<double>(daemon::to_json(status).size()) / 1000);
  std::fflush(stdout);
}

}  // namespace
}  // namespace emberlock

int main() {
  emberlock::measure(1, 0);
  emberlock::measure(10, 0);
  emberlock::measure(50, 1);
}
