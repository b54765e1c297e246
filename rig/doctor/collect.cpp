// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <pwd.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/daemon_folders.h"
#include "base/file.h"
#include "base/random.h"
#include "base/unique_fd.h"
#include "rig/config/config.h"
#include "rig/config/preflight.h"
#include "rig/doctor/doctor.h"

namespace emberlock::rig::doctor {
namespace {
namespace fs = std::filesystem;

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

void look_at_user(Facts& f) {
  const passwd* user = ::getpwuid(::geteuid());
  f.user = user != nullptr ? user->pw_name : fmt::format("user {}", ::geteuid());
  f.root = ::geteuid() == 0;
  const group* ours = ::getgrnam("emberlock");
  if (ours == nullptr) return;
  f.group_exists = true;
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(0, ::getgroups(0, nullptr))));
  ::getgroups(static_cast<int>(groups.size()), groups.data());
  f.in_group =
      ::getegid() == ours->gr_gid || std::find(groups.begin(), groups.end(), ours->gr_gid) != groups.end();
  for (char** member = ours->gr_mem; *member != nullptr; ++member)
    f.joined_later = f.joined_later || f.user == *member;
}

void look_at_rules(Facts& f) {
  for (const char* folder :
       {"/etc/udev/rules.d", "/run/udev/rules.d", "/usr/lib/udev/rules.d", "/lib/udev/rules.d"}) {
    const fs::path rules = fs::path(folder) / "72-emberlock.rules";
    std::error_code ignored;
    if (fs::exists(rules, ignored)) {
      f.rules = rules;
      return;
    }
  }
}

void look_at_limits(Facts& f) {
  rlimit limit{};
  const auto soft = [&](auto what) {
    ::getrlimit(what, &limit);
    return limit.rlim_cur == RLIM_INFINITY ? UINT64_MAX : static_cast<std::uint64_t>(limit.rlim_cur);
  };
  f.locked_memory = soft(RLIMIT_MEMLOCK);
  f.realtime_priority = soft(RLIMIT_RTPRIO);
  f.files_soft = soft(RLIMIT_NOFILE);
  f.files_hard = limit.rlim_max == RLIM_INFINITY ? UINT64_MAX : static_cast<std::uint64_t>(limit.rlim_max);
}

int mtu_of(const std::string& interface) {
  const UniqueFd socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  return socket.get() >= 0 && ::ioctl(socket.get(), SIOCGIFMTU, &request) == 0 ? request.ifr_mtu : 0;
}

/// The interface whose own network holds this address.
std::optional<std::string> interface_to(const std::string& address) {
  in_addr wanted{};
  ifaddrs* all = nullptr;
  if (::inet_pton(AF_INET, address.c_str(), &wanted) != 1 || ::getifaddrs(&all) != 0) return std::nullopt;
  std::optional<std::string> found;
  for (const ifaddrs* each = all; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET || each->ifa_netmask == nullptr)
      continue;
    const auto bits = [](const sockaddr* a) {
      return reinterpret_cast<const sockaddr_in*>(a)->sin_addr.s_addr;
    };
    if (((bits(each->ifa_addr) ^ wanted.s_addr) & bits(each->ifa_netmask)) == 0) found = each->ifa_name;
  }
  ::freeifaddrs(all);
  return found;
}

void look_at_devices(Facts& f) {
  const DeviceList list = list_devices();
  f.cameras = static_cast<int>(list.cameras.size());
  std::map<std::string, int> by_interface;
  for (const ListedCamera& camera : list.cameras) {
    const drivers::CameraFound& found = camera.found;
    if (found.holder) f.held.emplace_back(found.id, *found.holder);
    if (camera.driver != "aravis") {
      if (found.address.starts_with("/dev/") && ::access(found.address.c_str(), R_OK | W_OK) != 0)
        f.locked.emplace_back(found.address);
    } else if (const auto interface = interface_to(found.address)) {
      ++by_interface[*interface];
    } else {
      ++f.usb3_cameras;
    }
  }
  for (const drivers::StrobeFound& port : list.ports) {
    if (port.holder) f.held.emplace_back(port.id, *port.holder);
  }
  for (const auto& [interface, cameras] : by_interface)
    f.links.push_back({interface, mtu_of(interface), cameras});
  for (const DeviceList::Failure& failure : list.failures) f.driver_failures.push_back(failure.error);
}

void look_at_kernel(Facts& f) {
  if (const std::string text = first_line("/sys/module/usbcore/parameters/usbfs_memory_mb"); !text.empty())
    f.usbfs_megabytes = std::atoi(text.c_str());
  f.socket_buffer = std::strtoull(first_line("/proc/sys/net/core/rmem_max").c_str(), nullptr, 10);
  timex state{};
  f.clock_synchronized = ::adjtimex(&state) != TIME_ERROR && (state.status & STA_UNSYNC) == 0;
  std::error_code ignored;
  for (const auto& cpu : fs::directory_iterator("/sys/devices/system/cpu", ignored)) {
    const std::string governor = first_line(cpu.path() / "cpufreq/scaling_governor");
    if (!governor.empty() && (f.governor.empty() || f.governor == "performance")) f.governor = governor;
  }
}

void look_at_processes(Facts& f) {
  std::error_code ignored;
  for (const auto& process : fs::directory_iterator("/proc", ignored)) {
    const int pid = std::atoi(process.path().filename().c_str());
    if (pid <= 0) continue;
    const std::string program = first_line(process.path() / "comm");
    if (program.starts_with("gvfs-gphoto2") || program.starts_with("gvfsd-gphoto2") ||
        program == "ModemManager")
      f.meddlers.push_back({program, pid});
  }
}

void look_at_disk(Facts& f, const RecordingConfig& recording, const CollectOptions& options) {
  f.folder = recording.folder;
  f.floor_bytes = recording.writer.min_free_bytes;
  std::error_code ignored;
  fs::path there = f.folder;
  while (!fs::exists(there, ignored) && there.has_relative_path()) there = there.parent_path();
  struct statvfs space {};
  if (::statvfs(there.c_str(), &space) == 0) f.free_bytes = space.f_bavail * space.f_frsize;
  if (::access(there.c_str(), W_OK | X_OK) != 0) {
    f.folder_error = fmt::format("{} can't write to {}: {}", f.user, there.string(), std::strerror(errno));
    return;
  }
  // Never below the floor.
  const std::uint64_t room = f.free_bytes > f.floor_bytes ? f.free_bytes - f.floor_bytes : 0;
  if (const std::uint64_t bytes = std::min(options.probe_bytes, room); bytes > 0) {
    if (const auto speed = write_speed(there, bytes, options.probe_time)) f.write_bytes_per_s = *speed;
  }
}

void look_at_daemon(Facts& f, const fs::path& socket) {
  f.socket = socket;
  const UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  socket.string().copy(address.sun_path, sizeof address.sun_path - 1);
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    f.daemon = Reach::answers;
    return;
  }
  f.daemon = errno == EACCES || errno == EPERM ? Reach::refused : Reach::nobody_there;
}

void look_at_cuda(Facts& f) {
#ifdef EMBERLOCK_HAVE_CUDA
  f.cuda_built = true;
#endif
  f.cuda_node = ::access("/dev/nvidia0", R_OK | W_OK) == 0;
}

}  // namespace

double wanted_bytes_per_second(const RigConfig& rig) {
  double sum = 0;
  for (const CameraConfig& camera : rig.cameras) {
    drivers::CameraRequest request = camera.request;
    if (camera.source == CameraSource::virtual_) {
      request.size = request.size.value_or(rig.virtual_rig.draw.layout.size);
      request.frame_rate = request.frame_rate.value_or(rig.virtual_rig.draw.rate);
    }
    if (!request.size || !request.frame_rate) continue;
    sum += camera.count * static_cast<double>(request.size->width) * request.size->height *
           bytes_per_pixel(request.format.value_or(PixelFormat::gray8)) * request.frame_rate->value();
  }
  return sum;
}

Hertz frame_rate(const RigConfig& rig) {
  for (const CameraConfig& camera : rig.cameras) {
    if (camera.request.frame_rate) return *camera.request.frame_rate;
    if (camera.source == CameraSource::virtual_) return rig.virtual_rig.draw.rate;
  }
  return Hertz(0);
}

Result<double> write_speed(const fs::path& folder, std::uint64_t bytes, Seconds at_most) {
  constexpr std::size_t kBlock = 4 << 20;
  constexpr std::uint64_t kSync = 32 << 20;
  const auto refused = [&](const char* what) {
    return Error{ErrorKind::io, fmt::format("{}: {}", what, std::strerror(errno)), folder.string(),
                 "name a folder that can be written to"};
  };
  std::vector<std::uint64_t> block(kBlock / sizeof(std::uint64_t));
  for (std::size_t i = 0; i < block.size(); ++i) block[i] = mix64(i);
  std::string name = folder / ".emberlock-doctor-XXXXXX";
  const UniqueFd file(::mkostemp(name.data(), O_CLOEXEC));
  if (file.get() < 0) return refused("a file can't be made");
  ::unlink(name.c_str());  // nothing stays behind, whatever ends this
  const SteadyClock clock;
  const TimePoint start = clock.now();
  std::uint64_t written = 0;
  Seconds passed;
  while (written < bytes && passed < at_most) {
    block.front() = written;
    const ssize_t n = ::write(file.get(), block.data(), std::min<std::uint64_t>(kBlock, bytes - written));
    if (n <= 0) return refused("it can't be written to");
    written += static_cast<std::uint64_t>(n);
    if ((written % kSync == 0 || written == bytes) && ::fdatasync(file.get()) != 0)
      return refused("it can't be written to");
    if (written % kSync == 0 || written == bytes) passed = clock.now() - start;
  }
  return static_cast<double>(written) / passed.value();
}

Facts collect(const CollectOptions& options) {
  Facts f;
  DaemonConfig config;
  std::error_code ignored;
  DaemonFolders folders = daemon_folders();
  if (fs::exists(options.config_file, ignored)) {
    f.config_file = options.config_file;
    f.config_problems = check_config(options.config_file);
    if (auto loaded = read_file(options.config_file, std::size_t{1} << 20)) {
      ConfigReading reading = read_config(*loaded, options.config_file);
      if (reading.problems.empty()) config = std::move(reading.config);
    }
    if (options.config_file == CollectOptions().config_file) folders = system_daemon_folders();
  } else if (config.server.socket.empty()) {
    config.server.socket = usual_socket();
  }
  fill_in(config, folders, fs::read_symlink("/proc/self/exe", ignored));
  look_at_user(f);
  look_at_rules(f);
  look_at_limits(f);
  look_at_devices(f);
  look_at_kernel(f);
  look_at_processes(f);
  look_at_disk(f, config.recording, options);
  f.wanted_bytes_per_s = wanted_bytes_per_second(config.rig);
  f.strobe = config.rig.strobe.source;
  f.dial = config.rig.strobe.dial;
  f.frame_rate = frame_rate(config.rig);
  look_at_daemon(f, config.server.socket);
  look_at_cuda(f);
  return f;
}

}  // namespace emberlock::rig::doctor
