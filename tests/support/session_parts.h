// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "session/files.h"
#include "session/salvage.h"
#include "session/writer.h"
#include "tests/support/recording.h"

// A session that several hosts recorded, each its part on a clock of its own.
namespace emberlock::test {

inline constexpr std::int64_t kPartsBegin = 100'000'000'000;  ///< on the session's clock, ns
inline constexpr std::int64_t kPartsStep = 60'000'000'000;    ///< from frame to frame
inline const ImageLayout kPartsLayout{{64, 48}, PixelFormat::gray8, 8};

struct PartHost {
  std::string name;  ///< of its folder too
  std::vector<std::string> cameras;
  std::int64_t ahead_ns = 0;           ///< of the session's clock, as the recording begins
  double ppm = 0;                      ///< so much faster
  std::vector<v1::Event> events = {};  ///< on its own clock

  [[nodiscard]] std::int64_t ahead(std::int64_t at) const {
    return ahead_ns + std::llround(ppm * 1e-6 * static_cast<double>(at - kPartsBegin));
  }
  /// What it shows.
  [[nodiscard]] std::int64_t shows(std::int64_t at) const { return at + ahead(at); }
};

/// The instant of the shared frame `i`, on the session's clock.
inline std::int64_t instant_of(std::uint64_t i) {
  return kPartsBegin + static_cast<std::int64_t>(i) * kPartsStep;
}

struct PartsRecording {
  std::uint64_t frames = 21;  ///< a minute apart: twenty minutes
  session::Encoding encoding = session::Encoding::ffv1;
};

inline void check_done(const Status& done) {
  if (!done) throw std::runtime_error(done.error().message());
}
template <class T>
T checked(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  return std::move(result).value();
}

/// Begins a host's part and writes its frames and events.
inline session::SessionWriter begin_part(const std::filesystem::path& folder, const PartHost& host,
                                         const PartsRecording& recording, const std::string& led_by) {
  v1::Manifest manifest = manifest_of(std::vector<ImageLayout>(host.cameras.size(), kPartsLayout));
  manifest.set_session_id("take 1");
  manifest.set_led_by(led_by);
  for (std::size_t c = 0; c < host.cameras.size(); ++c)
    manifest.mutable_cameras(static_cast<int>(c))->set_camera_id(host.cameras[c]);
  session::WriterOptions options = small_disk_options(recording.encoding);
  options.frames_per_segment = 10;
  session::SessionWriter writer = checked(session::SessionWriter::create(folder, manifest, options));
  for (std::size_t c = 0; c < host.cameras.size(); ++c) {
    for (std::uint64_t i = 0; i < recording.frames; ++i) {
      Frame frame = noise_frame(kPartsLayout, i, std::hash<std::string>()(host.cameras[c]) % 1000);
      frame.stamp.monotonic_time.ns = host.shows(instant_of(i));
      check_done(writer.write(c, frame));
    }
  }
  for (const v1::Event& event : host.events) check_done(writer.append(event));
  return writer;
}

/// What the leading host's manifest tells of another's part, whose clock was read a second after the
/// recording's beginning and a second before its end.
inline v1::HostPart told_of(const PartHost& host, const PartsRecording& recording) {
  v1::HostPart told;
  told.set_host(host.name + ":50051");
  told.set_session("take 1");
  for (const std::string& id : host.cameras) told.add_camera_ids(id);
  told.set_state(v1::HostPart::WHOLE);
  for (const std::int64_t at :
       {kPartsBegin + 1'000'000'000, instant_of(recording.frames - 1) - 1'000'000'000}) {
    v1::ClockReading& reading = *told.add_clock();
    reading.set_at_ns(at);
    reading.set_ahead_ns(host.ahead(at));
    reading.set_sigma_ns(200'000);
  }
  told.set_frames(recording.frames * host.cameras.size());
  return told;
}

/// Changes a finished session's manifest.
template <class Change>
void change_manifest(const std::filesystem::path& folder, const Change& change) {
  v1::Manifest manifest = checked(session::read_manifest(folder));
  change(manifest);
  check_done(session::write_manifest(folder, manifest));
}

/// Records all hosts' parts into `folder`/NAME, the first one's as the leader. The folders, in their order.
inline std::vector<std::filesystem::path> record_parts(const std::filesystem::path& folder,
                                                       const std::vector<PartHost>& hosts,
                                                       const PartsRecording& recording = {}) {
  std::vector<std::filesystem::path> parts;
  for (const PartHost& host : hosts) {
    parts.push_back(folder / host.name);
    const bool leads = &host == &hosts.front();
    session::SessionWriter writer =
        begin_part(parts.back(), host, recording, leads ? "" : hosts.front().name);
    static_cast<void>(checked(writer.finish()));
  }
  change_manifest(parts.front(), [&](v1::Manifest& manifest) {
    for (std::size_t i = 1; i < hosts.size(); ++i) *manifest.add_hosts() = told_of(hosts[i], recording);
  });
  return parts;
}

/// Two cameras of the leader's; two of a host whose clock is 5000 s ahead and gains 30 ppm; one of a host
/// that was started later and whose clock loses 12 ppm.
inline std::vector<PartHost> three_hosts() {
  return {{"lab-1", {"left", "right"}},
          {"lab-2", {"back", "above"}, 5'000'000'000'000, 30},
          {"lab-3", {"front"}, -70'000'000'000, -12}};
}

}  // namespace emberlock::test
