// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/quantity.h"
#include "rig/config/config.h"
#include "rig/devices/device_list.h"
#include "rig/doctor/finding.h"

// Whether this machine is fit for the rig: facts are collected from the system, a pure function finds what
// they come to, and words.h says it.
namespace emberlock::rig::doctor {

/// A network interface that leads to GigE Vision cameras.
struct NetworkLink {
  std::string interface;
  int mtu = 0;  ///< bytes
  int cameras = 0;
};

/// A process that takes cameras or ports for itself.
struct Meddler {
  std::string program;
  int pid = 0;
};

enum class Reach { answers, nobody_there, refused };

struct Facts {
  std::string user;
  bool root = false;
  bool group_exists = false;                    ///< emberlock
  bool in_group = false;                        ///< this process is
  bool joined_later = false;                    ///< the user is by now, this process began before
  std::vector<std::filesystem::path> locked{};  ///< nodes of cameras and ports that this process may not open

  std::optional<std::filesystem::path> rules{};  ///< where 72-emberlock.rules lies

  std::uint64_t files_soft = 0, files_hard = 0;  ///< open files a process may have
  std::uint64_t locked_memory = 0;               ///< bytes
  std::uint64_t realtime_priority = 0;

  std::optional<int> usbfs_megabytes{};  ///< what all USB transfers may hold; absent without USB
  int usb3_cameras = 0;                  ///< USB3 Vision, whose frames lie there
  std::vector<NetworkLink> links{};
  std::uint64_t socket_buffer = 0;  ///< net.core.rmem_max, bytes

  std::filesystem::path folder;  ///< of the recordings
  std::string folder_error;      ///< why nothing can be written there; else empty
  std::uint64_t free_bytes = 0;
  std::uint64_t floor_bytes = 0;
  std::optional<double>
      write_bytes_per_s{};  ///< with everything on the disk before it counts; absent: not tried
  StrobeSource strobe = StrobeSource::none;  ///< as configured
  StrobeDial dial{};                         ///< of a manual one
  Hertz frame_rate{};                        ///< of the configured cameras; 0: not known
  double wanted_bytes_per_s = 0;  ///< raw, at the configured size and rate of all cameras; 0: not known

  bool clock_synchronized = false;
  std::string governor;  ///< the processors' slowest; empty: the kernel has none

  int cameras = 0;
  std::vector<std::pair<std::string, drivers::Holder>>
      held{};  ///< cameras and ports, by id, that another process has
  std::vector<Error> driver_failures{};
  std::vector<Meddler> meddlers{};

  std::filesystem::path config_file;  ///< empty: there is none
  std::vector<Error> config_problems{};
  std::filesystem::path socket;
  Reach daemon = Reach::nobody_there;

  bool cuda_built = false;
  bool cuda_node = false;  ///< /dev/nvidia0 can be opened
};

/// One finding a matter, in the order of FindingCode.
std::vector<Finding> diagnose(const Facts& facts);

struct CollectOptions {
  std::filesystem::path config_file =
      "/etc/emberlock/emberlockd.toml";                  ///< where there is none: the defaults
  std::uint64_t probe_bytes = std::uint64_t{128} << 20;  ///< written to measure the disk; 0: not at all
  Seconds probe_time{2};                                 ///< at most
};
/// Takes about 3 s: cameras are looked for, and the disk is written to.
Facts collect(const CollectOptions& options);

/// How fast a folder takes data that doesn't compress, to the disk itself (fdatasync); the file is removed.
/// Errors: io.
Result<double> write_speed(const std::filesystem::path& folder, std::uint64_t bytes, Seconds at_most);

/// What all cameras send a second, unpacked: of those whose size and rate the configuration tells.
double wanted_bytes_per_second(const RigConfig& rig);

/// At which the cameras film, of the first whose rate the configuration tells; 0: of none.
Hertz frame_rate(const RigConfig& rig);

}  // namespace emberlock::rig::doctor
