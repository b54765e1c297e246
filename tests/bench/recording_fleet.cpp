// SPDX-License-Identifier: Apache-2.0
// How many cameras one machine records in real time: N synthetic cameras deliver on time, whatever the
// recorder does, through AsyncWriter to a folder.
//   bench_recording_fleet [--cameras 11] [--size 1280x720] [--rate 24] [--seconds 60] [--encoding raw|ffv1]
//   [--folder DIR]
//                         [--find]  more cameras, run by run, until the first loss
// Prints what was lost by cause, MB/s, CPU, and which resource ended it. With --transcode the recording is
// compressed, verified and read back too.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "base/random.h"
#include "session/async_writer.h"
#include "session/layout.h"
#include "session/salvage.h"
#include "session/verify.h"

namespace {

using namespace emberlock;
using Clock = std::chrono::steady_clock;

struct Fleet {
  int cameras = 11;
  std::string size = "1280x720";
  double rate = 24;
  double seconds = 60;
  std::string encoding = "raw";
  std::string folder;
  double queue_seconds = session::AsyncWriterOptions{}.queue_time.value();
  bool find = false;
  bool transcode = false;
};

struct Outcome {
  v1::Counts counts;  // of all cameras
  std::uint64_t made = 0;
  std::uint64_t bytes = 0;
  double seconds = 0;
  double finish_seconds = 0;
  double user_cpus = 0;
  double system_cpus = 0;
  double fullest = 0;
  double at_risk = 0;           // seconds: the longest that a frame took to become safe
  double waiting_for_disk = 0;  // of the time, all processors together
  std::string failure;
};

/// A flame-like picture with camera noise: pure noise would flatter no codec, a flat one every codec.
std::shared_ptr<const Image> flame_like(const ImageLayout& layout, std::uint64_t seed) {
  auto image = std::make_shared<Image>(layout);
  RandomStream random(seed, 1);
  for (int y = 0; y < layout.size.height; ++y) {
    auto* row = image->row_as<std::uint8_t>(y);
    for (int x = 0; x < layout.size.width; ++x) {
      const double dx = (x - layout.size.width / 2.0) / layout.size.width;
      const double dy = (y - layout.size.height / 2.0) / layout.size.height;
      const double light =
          0.8 * std::exp(-30 * dx * dx - 8 * dy * dy) * (1 + 0.3 * std::sin(40 * dy + 9 * dx));
      row[x] = static_cast<std::uint8_t>(std::clamp((light + random.normal(0.02, 0.006)) * 255, 0.0, 255.0));
    }
  }
  return image;
}

double seconds_of(const timeval& t) {
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
}

/// Processors' seconds so far spent waiting for disks.
double io_wait() {
  std::FILE* const stat = std::fopen("/proc/stat", "r");
  unsigned long long t[5] = {};
  const int read = stat == nullptr
                       ? 0
                       : std::fscanf(stat, "cpu %llu %llu %llu %llu %llu", &t[0], &t[1], &t[2], &t[3], &t[4]);
  if (stat != nullptr) std::fclose(stat);
  return read == 5 ? static_cast<double>(t[4]) / static_cast<double>(::sysconf(_SC_CLK_TCK)) : 0;
}

v1::Manifest manifest_of(const Fleet& fleet, const ImageLayout& layout) {
  v1::Manifest manifest;
  manifest.set_session_id("fleet");
  manifest.set_purpose("flame");
  for (int i = 0; i < fleet.cameras; ++i) {
    v1::CameraStream& camera = *manifest.add_cameras();
    camera.set_camera_id("cam" + std::to_string(i));
    camera.set_frame_rate_hz(fleet.rate);
    session::set_layout(camera, layout);
  }
  return manifest;
}

/// Delivers a camera's frames, each a picture of its own in memory, as a driver would, at its time.
void film(session::AsyncWriter& writer, std::size_t camera, const Fleet& fleet,
          const std::vector<std::shared_ptr<const Image>>& scenes, Clock::time_point start,
          std::uint64_t frames) {
  for (std::uint64_t i = 0; i < frames; ++i) {
    const double at = (static_cast<double>(i) + static_cast<double>(camera) / fleet.cameras) / fleet.rate;
    std::this_thread::sleep_until(
        start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(at)));
    Frame frame;
    frame.stamp.frame_id = i;
    frame.stamp.monotonic_time.ns = static_cast<std::int64_t>(at * 1e9);
    frame.image = std::make_shared<const Image>(*scenes[(i + camera) % scenes.size()]);
    static_cast<void>(writer.push(camera, std::move(frame)));  // what is lost the manifest counts
  }
}

Outcome record(const Fleet& fleet, const ImageLayout& layout, const std::filesystem::path& folder) {
  std::vector<std::shared_ptr<const Image>> scenes;
  for (std::uint64_t i = 0; i < 8; ++i) scenes.push_back(flame_like(layout, i));
  session::WriterOptions options;
  options.encoding = fleet.encoding == "raw" ? session::Encoding::raw_nut : session::Encoding::ffv1;
  auto session = session::SessionWriter::create(folder, manifest_of(fleet, layout), options);
  Outcome outcome;
  if (!session) {
    outcome.failure = session.error().message();
    return outcome;
  }
  session::AsyncWriter writer(std::move(session).value(), {.queue_time = Seconds(fleet.queue_seconds)});
  const auto frames = static_cast<std::uint64_t>(fleet.seconds * fleet.rate);
  const auto cameras = static_cast<std::size_t>(fleet.cameras);
  rusage before{};
  ::getrusage(RUSAGE_SELF, &before);
  const double waited = io_wait();
  const auto start = Clock::now();
  outcome.made = frames * cameras;
  {
    std::vector<std::jthread> drivers;
    for (std::size_t c = 0; c < cameras; ++c) {
      drivers.emplace_back([&, c] { film(writer, c, fleet, scenes, start, frames); });
    }
    const std::jthread watcher([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        for (std::size_t c = 0; c < cameras; ++c) {
          const session::CameraProgress now = writer.progress(c);
          outcome.fullest = std::max(outcome.fullest, now.queue_fill);
          outcome.at_risk = std::max(outcome.at_risk, now.at_risk.value());
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    });
    drivers.clear();
  }
  rusage after{};
  ::getrusage(RUSAGE_SELF, &after);
  outcome.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  outcome.waiting_for_disk = (io_wait() - waited) / outcome.seconds;
  outcome.user_cpus = (seconds_of(after.ru_utime) - seconds_of(before.ru_utime)) / outcome.seconds;
  outcome.system_cpus = (seconds_of(after.ru_stime) - seconds_of(before.ru_stime)) / outcome.seconds;
  const auto finishing = Clock::now();
  const auto manifest = writer.finish();
  outcome.finish_seconds = std::chrono::duration<double>(Clock::now() - finishing).count();
  for (std::size_t c = 0; c < cameras; ++c) outcome.bytes += writer.progress(c).bytes;
  if (!manifest) outcome.failure = manifest.error().message();
  if (const auto failure = writer.failure()) outcome.failure = failure->message();
  if (manifest) {
    for (const v1::CameraStream& camera : manifest->cameras()) {
      outcome.counts.set_recorded(outcome.counts.recorded() + camera.counts().recorded());
      outcome.counts.set_queue(outcome.counts.queue() + camera.counts().queue());
      outcome.counts.set_disk(outcome.counts.disk() + camera.counts().disk());
      outcome.counts.set_camera_gap(outcome.counts.camera_gap() + camera.counts().camera_gap());
    }
  }
  return outcome;
}

std::uint64_t lost(const Outcome& o) { return o.counts.queue() + o.counts.disk() + o.counts.camera_gap(); }

/// What there was least of, by where the time went.
const char* scarce(const Outcome& o) {
  const double processors = std::thread::hardware_concurrency();
  if (o.user_cpus + o.system_cpus > .85 * processors) return "processors";
  if (o.waiting_for_disk > .1 * processors || o.counts.disk() > 0) return "disk";
  return "processors, which others use too";
}

void print(const Fleet& fleet, const Outcome& o) {
  std::printf(
      "%2d cameras %s at %g/s, %s, %.0f s: %llu frames made, %llu recorded, lost: queue %llu disk %llu gap "
      "%llu, "
      "unaccounted %lld; %.1f MB/s, CPU %.2f user + %.2f system, waiting for disk %.2f, fullest queue %.0f "
      "%%, safe after %.2f s at most, "
      "finished in %.1f s\n",
      fleet.cameras, fleet.size.c_str(), fleet.rate, fleet.encoding.c_str(), o.seconds,
      static_cast<unsigned long long>(o.made), static_cast<unsigned long long>(o.counts.recorded()),
      static_cast<unsigned long long>(o.counts.queue()), static_cast<unsigned long long>(o.counts.disk()),
      static_cast<unsigned long long>(o.counts.camera_gap()),
      static_cast<long long>(o.made) - static_cast<long long>(o.counts.recorded() + lost(o)),
      static_cast<double>(o.bytes) / 1e6 / o.seconds, o.user_cpus, o.system_cpus, o.waiting_for_disk,
      100 * o.fullest, o.at_risk, o.finish_seconds);
  if (!o.failure.empty()) std::printf("  %s\n", o.failure.c_str());
  std::fflush(stdout);
}

void compress(const std::filesystem::path& folder) {
  auto start = Clock::now();
  const Status done = session::transcode(folder);
  const double transcoded = std::chrono::duration<double>(Clock::now() - start).count();
  start = Clock::now();
  const auto check = session::verify_session(folder);
  std::printf("transcoded in %.0f s%s; verified in %.0f s: %s\n", transcoded,
              done ? "" : (": " + done.error().message()).c_str(),
              std::chrono::duration<double>(Clock::now() - start).count(),
              check && check->whole() ? "all there" : "NOT all there");
}

}  // namespace

int main(int argc, char** argv) {
  Fleet fleet;
  CLI::App app("Records synthetic cameras in real time");
  app.add_option("--cameras", fleet.cameras)->check(CLI::Range(1, 200));
  app.add_option("--size", fleet.size);
  app.add_option("--rate", fleet.rate)->check(CLI::PositiveNumber);
  app.add_option("--seconds", fleet.seconds)->check(CLI::PositiveNumber);
  app.add_option("--encoding", fleet.encoding)->check(CLI::IsMember({"raw", "ffv1"}));
  app.add_option("--folder", fleet.folder);
  app.add_option("--queue-seconds", fleet.queue_seconds)->check(CLI::PositiveNumber);
  app.add_flag("--find", fleet.find);
  app.add_flag("--transcode", fleet.transcode);
  CLI11_PARSE(app, argc, argv);
  int width = 0;
  int height = 0;
  if (std::sscanf(fleet.size.c_str(), "%dx%d", &width, &height) != 2) return 2;
  const ImageLayout layout{{width, height}, PixelFormat::gray8, 8};
  if (fleet.folder.empty()) fleet.folder = std::filesystem::temp_directory_path();
  const std::filesystem::path folder =
      std::filesystem::path(fleet.folder) / ("emberlock-fleet-" + std::to_string(::getpid()));
  for (;; ++fleet.cameras) {
    const Outcome outcome = record(fleet, layout, folder);
    print(fleet, outcome);
    if (fleet.transcode && outcome.failure.empty()) compress(folder);
    std::filesystem::remove_all(folder);
    if (!outcome.failure.empty()) return 1;
    if (lost(outcome) > 0) std::printf("scarce: %s\n", scarce(outcome));
    if (!fleet.find || lost(outcome) > 0) return 0;
  }
}
