// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "rig/doctor/doctor.h"

namespace emberlock::rig::doctor {
namespace {

constexpr std::uint64_t kFewFiles = 1024;
constexpr std::uint64_t kManyFiles = 65536;
constexpr int kJumboFrame = 8192;
constexpr std::uint64_t kSocketBuffer = 8 << 20;
constexpr int kUsbfsPerCamera = 200;  // megabytes: 50 frames of 4 MB
constexpr Seconds kShortRecording{600};
constexpr double kSpareSpeed = 1.5;  // times what the cameras send

Finding groups(const Facts& f) {
  if (f.root) return {GroupFinding::root};
  if (!f.group_exists) return {GroupFinding::no_group, f.locked.empty() ? Health::warn : Health::fail};
  if (f.in_group) return {GroupFinding::member};
  return {f.joined_later ? GroupFinding::joined_later : GroupFinding::outsider, Health::fail};
}

Finding rules(const Facts& f) {
  if (f.rules) return {RulesFinding::installed};
  return {RulesFinding::missing, Health::warn};
}

Finding devices(const Facts& f) {
  if (!f.driver_failures.empty()) return {CameraFinding::driver_failed, Health::fail};
  if (!f.locked.empty()) return {CameraFinding::locked, Health::fail};
  if (f.cameras == 0) return {CameraFinding::none, Health::warn};
  return {CameraFinding::some};
}

Finding strobe(const Facts& f) {
  switch (f.strobe) {
    case StrobeSource::none:
      return {StrobeFinding::none};
    case StrobeSource::virtual_:
      return {StrobeFinding::simulated};
    case StrobeSource::serial:
      return {StrobeFinding::serial};
    case StrobeSource::replay:
      return {StrobeFinding::replayed};
    case StrobeSource::manual:
      break;
  }
  return {StrobeFinding::by_hand};
}

Finding holders(const Facts& f) {
  for (std::size_t i = 0; i < f.held.size(); ++i) {
    if (f.held[i].second.program.starts_with("emberlock")) continue;
    return {HolderFinding::others, Health::fail, i};
  }
  return {f.held.empty() ? HolderFinding::nobody : HolderFinding::ours};
}

Finding meddlers(const Facts& f) {
  if (f.meddlers.empty()) return {MeddlerFinding::none};
  if (f.rules) return {MeddlerFinding::kept_off};
  return {MeddlerFinding::at_large, Health::warn};
}

Finding limits(const Facts& f) {
  if (f.files_soft >= kFewFiles) return {LimitFinding::enough_files};
  Finding finding{LimitFinding::few_files, Health::warn};
  finding.files = std::min(kManyFiles, std::max(f.files_hard, kFewFiles));
  return finding;
}

Finding usb(const Facts& f) {
  if (!f.usbfs_megabytes) return {UsbFinding::no_usb};
  const int wanted = kUsbfsPerCamera * f.usb3_cameras;
  if (*f.usbfs_megabytes == 0 || *f.usbfs_megabytes >= wanted) return {UsbFinding::enough_memory};
  Finding finding{UsbFinding::little_memory, Health::fail};
  finding.megabytes = wanted;
  return finding;
}

Finding network(const Facts& f) {
  if (f.links.empty()) return {NetworkFinding::no_camera};
  for (std::size_t i = 0; i < f.links.size(); ++i)
    if (f.links[i].mtu < kJumboFrame) return {NetworkFinding::small_packets, Health::warn, i};
  return {NetworkFinding::large_packets};
}

Finding socket_buffer(const Facts& f) {
  if (f.links.empty() || f.socket_buffer >= kSocketBuffer) return {BufferFinding::enough};
  return {BufferFinding::small, Health::warn};
}

Finding disk_space(const Facts& f) {
  if (!f.folder_error.empty()) return {SpaceFinding::unwritable, Health::fail};
  const double above = static_cast<double>(f.free_bytes) - static_cast<double>(f.floor_bytes);
  if (above <= 0) return {SpaceFinding::below_floor, Health::fail};
  if (f.wanted_bytes_per_s <= 0) return {SpaceFinding::unknown_time};
  Finding finding{SpaceFinding::long_time};
  finding.recording = Seconds(above / f.wanted_bytes_per_s);
  if (finding.recording < kShortRecording) {
    finding.code = SpaceFinding::short_time;
    finding.health = Health::warn;
  }
  return finding;
}

Finding disk_speed(const Facts& f) {
  if (!f.write_bytes_per_s) return {SpeedFinding::not_measured};
  if (f.wanted_bytes_per_s <= 0) return {SpeedFinding::unknown_need};
  if (*f.write_bytes_per_s < f.wanted_bytes_per_s) return {SpeedFinding::too_slow, Health::fail};
  if (*f.write_bytes_per_s < kSpareSpeed * f.wanted_bytes_per_s)
    return {SpeedFinding::little_to_spare, Health::warn};
  return {SpeedFinding::enough};
}

Finding clock(const Facts& f) {
  if (f.clock_synchronized) return {ClockFinding::synchronized};
  return {ClockFinding::adrift, Health::warn};
}

Finding governor(const Facts& f) {
  if (f.governor.empty()) return {GovernorFinding::none};
  if (f.governor == "performance" || f.governor == "schedutil") return {GovernorFinding::quick};
  return {GovernorFinding::slow, Health::warn};
}

Finding config(const Facts& f) {
  if (f.config_file.empty()) return {ConfigFinding::no_file};
  if (f.config_problems.empty()) return {ConfigFinding::valid};
  return {ConfigFinding::wrong, Health::fail};
}

Finding daemon(const Facts& f) {
  switch (f.daemon) {
    case Reach::answers:
      return {DaemonFinding::answers};
    case Reach::nobody_there:
      return {DaemonFinding::nobody_there, Health::warn};
    case Reach::refused:
      break;
  }
  return {DaemonFinding::refused, Health::fail};
}

Finding cuda(const Facts& f) {
  if (!f.cuda_built) return {CudaFinding::not_built};
  if (f.cuda_node) return {CudaFinding::ready};
  return {CudaFinding::closed, Health::warn};
}

}  // namespace

std::vector<Finding> diagnose(const Facts& facts) {
  std::vector<Finding> findings;
  for (const auto finding : {groups, rules, devices, strobe, holders, meddlers, limits, usb, network,
                             socket_buffer, disk_space, disk_speed, clock, governor, config, daemon, cuda})
    findings.push_back(finding(facts));
  return findings;
}

}  // namespace emberlock::rig::doctor
