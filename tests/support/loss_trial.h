// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/random.h"
#include "session/async_writer.h"
#include "session/layout.h"
#include "session/reader.h"
#include "session/salvage.h"
#include "session/verify.h"
#include "tests/support/wait.h"

// A recorder in a process of its own, which is killed or whose disk is taken away, and what is left of its
// recording.
namespace emberlock::test {

constexpr std::size_t kMostCameras = 16;

struct TrialFleet {
  std::size_t cameras = 4;  ///< 1..kMostCameras
  ImageSize size{640, 480};
  double rate_hz = 24;
  session::Encoding encoding = session::Encoding::ffv1;
};

/// What the recorder tells while it lives: it stays when that is gone.
struct Told {
  struct Camera {
    std::atomic<std::int64_t> newest_ns{0};  ///< of the frame that came last
    std::atomic<std::uint64_t> arrived{0};
    std::atomic<std::uint64_t> recorded{0};  ///< as the status has it
    std::atomic<std::uint64_t> dropped{0};   ///< by the queue, as the status has it
  };
  std::array<Camera, kMostCameras> cameras;
  std::atomic<bool> failed{false};
};

/// Of the worst camera.
struct TrialOutcome {
  double lost_s = 0;                   ///< frames that came, weren't told lost meanwhile, and aren't there
  double age_s = 0;                    ///< of the last frame that is there, when the last came
  std::uint64_t recorded_missing = 0;  ///< called recorded, and not there
  std::uint64_t arrived = 0;           ///< of all cameras
  std::uint64_t kept = 0;
  std::uint64_t dropped = 0;  ///< and told so while it went on
  std::string wrong;          ///< what must not be, in words; empty: nothing
};

inline std::shared_ptr<const Image> trial_picture(const ImageLayout& layout, std::uint64_t seed) {
  auto image = std::make_shared<Image>(layout);
  RandomStream random(seed, 3);
  for (int y = 0; y < layout.size.height; ++y) {
    auto* row = image->row_as<std::uint8_t>(y);
    for (int x = 0; x < layout.size.width; ++x)
      row[x] = static_cast<std::uint8_t>(((x * y) >> 9) + static_cast<int>(random.bits() % 8U));
  }
  return image;
}

/// Films and records in real time until it is killed.
[[noreturn]] inline void film_until_killed(const std::filesystem::path& folder, const TrialFleet& fleet,
                                           Told& told) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // it films for nobody else
  const ImageLayout layout{fleet.size, PixelFormat::gray8, 8};
  v1::Manifest manifest;
  manifest.set_session_id("trial");
  manifest.set_purpose("flame");
  for (std::size_t c = 0; c < fleet.cameras; ++c) {
    v1::CameraStream& camera = *manifest.add_cameras();
    camera.set_camera_id("cam" + std::to_string(c));
    camera.set_frame_rate_hz(fleet.rate_hz);
    session::set_layout(camera, layout);
  }
  std::vector<std::shared_ptr<const Image>> pictures;
  for (std::uint64_t i = 0; i < 8; ++i) pictures.push_back(trial_picture(layout, i));
  session::WriterOptions options;
  options.encoding = fleet.encoding;
  options.min_free_bytes = 0;
  options.frames_per_segment = 60;
  auto session = session::SessionWriter::create(folder, manifest, options);
  if (!session) ::_exit(1);
  session::AsyncWriter writer(std::move(session).value());
  SteadyClock clock;
  const TimePoint start = clock.now();
  for (std::uint64_t i = 0;; ++i) {
    clock.sleep_until(start + Seconds(static_cast<double>(i) / fleet.rate_hz));
    for (std::size_t c = 0; c < fleet.cameras; ++c) {
      const TimePoint now = clock.now();
      const Frame frame{{i, now, wall_clock(), now, FrameStatus::complete}, pictures[(i + c) % 8]};
      static_cast<void>(writer.push(c, frame));
      told.cameras[c].newest_ns = now.ns;
      told.cameras[c].arrived = i + 1;
      const session::CameraProgress progress = writer.progress(c);
      told.cameras[c].recorded = progress.counts.recorded();
      told.cameras[c].dropped = progress.counts.queue();
    }
    if (writer.failure()) told.failed = true;
  }
}

/// What was known of a camera before a disaster.
struct Before {
  std::int64_t newest_ns;
  std::uint64_t recorded, arrived, dropped;
};

/// Records `seconds` of frames into `folder`, and on until `moment` of each camera, if that is set. Then it
/// calls `disaster` with the recorder's process id, and looks at what is left of the session in the folder
/// that `disaster` names, by then salvaged. What was called recorded until then must be there.
inline TrialOutcome lose_a_recording(const std::filesystem::path& folder, const TrialFleet& fleet,
                                     double seconds,
                                     const std::function<std::filesystem::path(pid_t)>& disaster,
                                     const std::function<bool(const Before&)>& moment = {}) {
  void* const shared =
      ::mmap(nullptr, sizeof(Told), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) throw std::runtime_error("no shared memory");
  Told& told = *new (shared) Told;
  const pid_t child = ::fork();
  if (child == 0) film_until_killed(folder, fleet, told);
  TrialOutcome outcome;
  const auto filmed = static_cast<std::uint64_t>(seconds * fleet.rate_hz);
  const bool in_time = wait_until(
      [&] {
        return told.failed ||
               std::all_of(told.cameras.begin(), told.cameras.begin() + fleet.cameras,
                           [&](const Told::Camera& camera) { return camera.arrived >= filmed; });
      },
      kHangLimit + std::chrono::seconds(std::lround(seconds)));
  if (!in_time) outcome.wrong = "the recorder doesn't film";
  std::vector<Before> before;
  const bool came = wait_until([&] {
    before.clear();
    for (std::size_t c = 0; c < fleet.cameras; ++c) {
      Told::Camera& camera = told.cameras[c];
      before.push_back({camera.newest_ns, camera.recorded, camera.arrived, camera.dropped});
    }
    return told.failed || !moment || std::all_of(before.begin(), before.end(), moment);
  });
  for (const Before& camera : before) {
    outcome.arrived += camera.arrived;
    outcome.dropped += camera.dropped;
  }
  if (!came) outcome.wrong = "the moment never came";
  if (told.failed) outcome.wrong = "the recorder failed by itself";
  const std::filesystem::path left = disaster(child);
  int status = 0;
  ::kill(child, SIGKILL);
  ::waitpid(child, &status, 0);
  if (!WIFSIGNALED(status)) outcome.wrong = "the recorder ended by itself";
  ::munmap(shared, sizeof(Told));

  const auto salvaged = session::salvage(left);
  if (!salvaged) {
    outcome.wrong = salvaged.error().message();
    return outcome;
  }
  const auto check = session::verify_session(left);
  // Of a camera that lost its all, and had begun no second ago, it may not say so.
  const bool kept_some = std::all_of(salvaged->cameras.begin(), salvaged->cameras.end(),
                                     [](const session::SalvagedCamera& camera) { return camera.kept > 0; });
  if (!check || kept_some != check->whole())
    outcome.wrong = check ? "salvaged, but not whole: " + check->to_do : check.error().message();
  const auto reader = session::SessionReader::open(left);
  if (!reader) {
    outcome.wrong = reader.error().message();
    return outcome;
  }
  for (std::size_t c = 0; c < fleet.cameras; ++c) {
    const auto& stamps = reader->stamps(c);
    outcome.kept += stamps.size();
    if (stamps.size() < before[c].recorded)
      outcome.recorded_missing = std::max(outcome.recorded_missing, before[c].recorded - stamps.size());
    const std::uint64_t taken = before[c].arrived - std::min(before[c].arrived, before[c].dropped);
    const auto lost = static_cast<double>(taken - std::min<std::uint64_t>(taken, stamps.size()));
    outcome.lost_s = std::max(outcome.lost_s, lost / fleet.rate_hz);
    const TimePoint newest{before[c].newest_ns};
    outcome.age_s =
        std::max(outcome.age_s, stamps.empty() ? seconds : (newest - stamps.back().monotonic_time).value());
  }
  return outcome;
}

}  // namespace emberlock::test
