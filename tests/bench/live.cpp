// SPDX-License-Identifier: Apache-2.0
// What live volumes cost a recording, and how late they are: the daemon's engine with simulated cameras
// before a flame records twice, without and with them.
//   bench_live --program build/release/libexec/emberlock/emberlock [--cameras 4] [--size 320x240] [--rate 24]
//              [--seconds 10] [--every N] [--voxels V] [--device auto] [--encoding ffv1|raw] [--folder DIR]
// Prints frames recorded and lost by cause, the fullest queue, the longest that a frame waited to be safe,
// and of the volumes: how many, skipped frames, seconds a volume, delays, and by how much a delay was longer
// than its volume took. Exits with 1 where the recording with them lost frames and the other did not.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "daemon/engine/engine.h"

namespace {

using namespace emberlock;
namespace fs = std::filesystem;

struct Arguments {
  std::string program;
  int cameras = 4;
  std::string size = "320x240";
  double rate = 24;
  double seconds = 10;
  std::uint32_t every = 0;
  std::uint32_t voxels = 0;
  std::string device = "auto";
  std::string encoding = "ffv1";
  std::string folder;
};

struct Shown {
  std::uint64_t frame = 0;
  double delay = 0;
  double took = 0;
};

/// Every volume that is shown.
class Watcher {
 public:
  explicit Watcher(daemon::Board& board)
      : board_(board), subscription_(board.subscribe([this](daemon::Board::Topic topic) {
          if (topic == daemon::Board::Topic::iterations) look();
        })) {}
  std::vector<Shown> shown() {
    const std::lock_guard lock(mutex_);
    return shown_;
  }

 private:
  void look() {
    const auto all = board_.iterations(0);
    if (all.empty() || !all.back()->has_live_delay_s()) return;
    const std::lock_guard lock(mutex_);
    shown_.push_back({all.back()->frame(), all.back()->live_delay_s(), all.back()->iteration().seconds()});
  }
  daemon::Board& board_;
  std::mutex mutex_;
  std::vector<Shown> shown_;
  daemon::Subscription subscription_;
};

double part(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

/// Records for so long; tells what became of it.
v1::RecordingStatus record(daemon::Engine& engine, daemon::Board& board, const Arguments& a,
                           const std::string& name, bool live) {
  v1::RecordRequest request;
  request.set_name(name);
  request.set_unlocked(true);
  request.set_seconds(a.seconds);
  if (live) {
    request.mutable_live()->set_every(a.every);
    request.mutable_live()->set_voxels(a.voxels);
  }
  if (const auto begun = engine.record(request); !begun.ok()) {
    std::fprintf(stderr, "%s\n", begun.error().message().c_str());
    std::exit(1);
  }
  double fullest = 0;
  double at_risk = 0;
  v1::RecordingStatus status;
  do {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    status = board.status()->recording();
    if (status.session() != name) continue;
    fullest = std::max(fullest, status.queue_fill());
    at_risk = std::max(at_risk, status.progress().at_risk_s());
  } while (status.session() != name || (status.state() != v1::RecordingStatus::COMPLETE &&
                                        status.state() != v1::RecordingStatus::FAILED));
  const v1::Counts& lost = status.lost();
  std::printf(
      "%-8s %6lu frames recorded, lost: %lu by cameras, %lu for want of a buffer, %lu to the queue, %lu "
      "to the disk; fullest queue %.0f %%, longest until safe %.2f s. %s\n",
      name.c_str(), lost.recorded(), lost.camera_gap() + lost.transport(), lost.underrun(), lost.queue(),
      lost.disk(), 100 * fullest, at_risk, status.verdict().c_str());
  return status;
}

rig::DaemonConfig config_of(const Arguments& a, const fs::path& folder) {
  rig::DaemonConfig config;
  rig::CameraConfig cameras;
  cameras.count = a.cameras;
  ImageSize size;
  if (std::sscanf(a.size.c_str(), "%dx%d", &size.width, &size.height) != 2) std::exit(2);
  cameras.request.size = size;
  cameras.request.frame_rate = Hertz(a.rate);
  config.rig.cameras.push_back(cameras);
  config.rig.virtual_rig.time = rig::VirtualConfig::Time::real;
  config.rig.virtual_rig.scene = rig::VirtualConfig::Scene::flame;
  config.recording.folder = folder / "sessions";
  config.recording.transcode = rig::RecordingConfig::Transcode::never;
  config.recording.writer.encoding =
      a.encoding == "raw" ? session::Encoding::raw_nut : session::Encoding::ffv1;
  config.recording.writer.min_free_bytes = 0;
  config.reconstruction.program = fs::absolute(a.program);
  config.reconstruction.device = a.device;
  return config;
}

void tell_volumes(const v1::LiveStatus& live, const std::vector<Shown>& shown) {
  std::vector<double> delays;
  std::vector<double> beyond;
  std::vector<double> took;
  for (const Shown& one : shown) {
    delays.push_back(one.delay);
    took.push_back(one.took);
    beyond.push_back(one.delay - one.took);
  }
  std::printf("volumes  %lu on %s, %u voxels, %lu frames skipped, %lu without flame; %s %s\n", live.volumes(),
              live.device().c_str(), live.voxels(), live.skipped(), live.without_flame(),
              v1::LiveStatus::State_Name(live.state()).c_str(), live.reason().c_str());
  std::printf(
      "         seconds a volume: median %.2f, 95 %% %.2f, most %.2f; delay: median %.2f, 95 %% %.2f, "
      "most %.2f s; delay beyond its volume's time: median %.2f, 95 %% %.2f, most %.2f s\n",
      part(took, 0.5), part(took, 0.95), part(took, 1), part(delays, 0.5), part(delays, 0.95),
      part(delays, 1), part(beyond, 0.5), part(beyond, 0.95), part(beyond, 1));
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  CLI::App app{"What live volumes cost a recording, and how late they are"};
  app.add_option("--program", a.program, "emberlock with all verbs")->required();
  app.add_option("--cameras", a.cameras);
  app.add_option("--size", a.size);
  app.add_option("--rate", a.rate);
  app.add_option("--seconds", a.seconds);
  app.add_option("--every", a.every);
  app.add_option("--voxels", a.voxels);
  app.add_option("--device", a.device);
  app.add_option("--encoding", a.encoding);
  app.add_option("--folder", a.folder);
  CLI11_PARSE(app, argc, argv);
  const fs::path folder = (a.folder.empty() ? fs::temp_directory_path() : fs::path(a.folder)) /
                          ("bench_live." + std::to_string(::getpid()));
  std::uint64_t lost_more = 0;
  {
    daemon::Board board;
    auto engine = daemon::Engine::start(config_of(a, folder), board);
    if (!engine.ok()) {
      std::fprintf(stderr, "%s\n", engine.error().message().c_str());
      return 1;
    }
    while (board.status()->phase() != v1::IDLE) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::this_thread::sleep_for(std::chrono::seconds(2));  // until all cameras film steadily
    const v1::RecordingStatus without = record(**engine, board, a, "without", false);
    Watcher watcher(board);
    const v1::RecordingStatus with = record(**engine, board, a, "with", true);
    tell_volumes(board.status()->live(), watcher.shown());
    const auto loss = [](const v1::RecordingStatus& status) { return daemon::lost(status.lost()); };
    lost_more = loss(without) == 0 ? loss(with) : 0;
  }
  std::error_code ec;
  fs::remove_all(folder, ec);
  return lost_more > 0 ? 1 : 0;
}
