// SPDX-License-Identifier: Apache-2.0
// What salvage costs, and how long emberlockd takes to be ready beside it: eleven cameras, 65 s of FFV1 in
// one segment each, as a killed recorder leaves them.
//   bench_salvage [--size WxH] [--seconds S] [--cameras N] [--folder FOLDER] [--daemon PROGRAM]
// One camera's frames (a flame-like blob in noise) are coded; the others are copies. Processor time is
// printed, as the clock of a busy machine says little; with --daemon the session is made anew, and the
// program is started on it.
#include "session/salvage.h"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "session/files.h"
#include "tests/support/program.h"
#include "tests/support/recording.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  int width = 1280, height = 720, cameras = 11;
  double seconds = 65, rate = 24;
  std::string folder = "out/salvage-bench";
  std::string daemon;
};

double processor_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double clock_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// A blob that wanders over noise of a few grey levels.
Image flame_like(const ImageLayout& layout, std::uint64_t frame) {
  Image image(layout);
  RandomStream random(frame, 3);
  const double x0 = layout.size.width * (.5 + .2 * std::sin(.1 * static_cast<double>(frame)));
  const double y0 = layout.size.height * .5;
  for (int y = 0; y < layout.size.height; ++y) {
    auto* row = image.row_as<std::uint8_t>(y);
    for (int x = 0; x < layout.size.width; ++x) {
      const double d = std::hypot(x - x0, y - y0) / layout.size.height;
      row[x] =
          static_cast<std::uint8_t>(200 * std::exp(-12 * d * d) + static_cast<double>(random.bits() % 6));
    }
  }
  return image;
}

/// Returns its bytes.
std::uint64_t leave_unfinished(const fs::path& folder, const Arguments& a) {
  fs::remove_all(folder);
  fs::create_directories(folder.parent_path());
  const ImageLayout layout{{a.width, a.height}, PixelFormat::gray8, 8};
  auto manifest = test::manifest_of(std::vector(static_cast<std::size_t>(a.cameras), layout));
  for (auto& camera : *manifest.mutable_cameras()) camera.set_frame_rate_hz(a.rate);
  {
    auto writer = session::SessionWriter::create(folder, manifest, test::small_disk_options());
    if (!writer) throw std::runtime_error(writer.error().message());
    const auto frames = static_cast<std::uint64_t>(a.seconds * a.rate);
    for (std::uint64_t i = 0; i < frames; ++i) {
      Frame frame;
      const auto ns = static_cast<std::int64_t>(static_cast<double>(i) / a.rate * 1e9);
      frame.stamp = {i, {ns}, {ns}, {1'000'000'000 + ns}, FrameStatus::complete};
      frame.image = std::make_shared<const Image>(flame_like(layout, i));
      if (const Status written = writer->write(0, frame); !written)
        throw std::runtime_error(written.error().message());
    }
  }
  for (int c = 1; c < a.cameras; ++c) {
    const auto other = folder / ("cam" + std::to_string(c));
    fs::remove_all(other);
    fs::copy(folder / "cam0", other);
  }
  std::uint64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

void measure_salvage(const fs::path& folder, std::uint64_t bytes) {
  const double processor = processor_seconds();
  const double clock = clock_seconds();
  const auto report = session::salvage(folder);
  if (!report.ok()) throw std::runtime_error(report.error().message());
  const double used = processor_seconds() - processor;
  std::uint64_t kept = 0;
  for (const session::SalvagedCamera& camera : report->cameras) kept += camera.kept;
  std::printf("salvage: %.2f GB, %llu frames kept; %.2f s of processors (%.2f s a GB), %.2f s by the clock\n",
              1e-9 * static_cast<double>(bytes), static_cast<unsigned long long>(kept), used,
              used / (1e-9 * static_cast<double>(bytes)), clock_seconds() - clock);
}

/// Until it says READY=1 on a socket as systemd's.
void measure_start(const fs::path& folder, const std::string& program) {
  const fs::path socket = folder / "notify";
  fs::remove(socket);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(static_cast<char*>(address.sun_path), socket.c_str(), sizeof address.sun_path - 1);
  const UniqueFd notify(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (::bind(notify.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("no socket at " + socket.string());
  const std::string config = (folder / "d.toml").string();
  std::ofstream(config) << "[rig]\nname = \"bench\"\n[[rig.camera]]\ndriver = \"virtual\"\ncount = 2\n"
                        << "[rig.strobe]\ndriver = \"none\"\n[recording]\nfolder = \""
                        << (folder / "sessions").string() << "\"\n[server]\nsocket = \""
                        << (folder / "d.sock").string() << "\"\nhttp_listen = \"\"\n";
  const double clock = clock_seconds();
  test::Program daemon({program, "--config", config}, {{"NOTIFY_SOCKET", socket.string()}});
  std::string heard;
  std::array<char, 4096> text{};
  while (heard.find("READY=1") == std::string::npos) {
    const ssize_t length = ::recv(notify.get(), text.data(), text.size(), 0);
    if (length > 0) heard.append(text.data(), static_cast<std::size_t>(length));
  }
  const double ready = clock_seconds() - clock;
  const double used = daemon.processor_seconds();
  const double asked = clock_seconds();
  daemon.end(SIGTERM);
  const double ended = clock_seconds() - asked;
  const bool in_the_midst =
      session::read_manifest(folder / "sessions" / "killed")->state() == v1::Manifest::RECORDING;
  std::printf(
      "emberlockd: ready after %.2f s of processors, %.2f s by the clock; SIGTERM ended it in %.2f s, %s\n",
      used, ready, ended, in_the_midst ? "in mid-salvage" : "salvaged");
}

}  // namespace
}  // namespace emberlock

int main(int argc, char** argv) {
  using namespace emberlock;
  Arguments a;
  std::string size = "1280x720";
  CLI::App app{"What salvage costs"};
  app.add_option("--size", size, "WxH")->capture_default_str();
  app.add_option("--seconds", a.seconds)->capture_default_str();
  app.add_option("--cameras", a.cameras)->capture_default_str();
  app.add_option("--folder", a.folder, "Made, and left behind")->capture_default_str();
  app.add_option("--daemon", a.daemon, "emberlockd");
  CLI11_PARSE(app, argc, argv);
  if (std::sscanf(size.c_str(), "%dx%d", &a.width, &a.height) != 2) return 2;
  try {
    const fs::path folder = fs::absolute(a.folder);
    const std::uint64_t bytes = leave_unfinished(folder / "sessions" / "killed", a);
    if (!a.daemon.empty()) measure_start(folder, a.daemon);
    measure_salvage(folder / "sessions" / "killed", bytes);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  return 0;
}
