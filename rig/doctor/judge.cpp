// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "rig/doctor/doctor.h"

namespace emberlock::rig::doctor {
namespace {

constexpr std::uint64_t kFewFiles = 1024;
constexpr int kJumboFrame = 8192;
constexpr std::uint64_t kSocketBuffer = 8 << 20;
constexpr int kUsbfsPerCamera = 200;  // megabytes: 50 frames of 4 MB
constexpr double kShortMinutes = 10;
constexpr double kMega = 1e6;  // bytes

Check groups(const Facts& f) {
  if (f.root) return {"groups", Health::ok, "this is root, who may open everything", ""};
  if (!f.group_exists) {
    return {"groups", f.locked.empty() ? Health::warn : Health::fail, "there is no group emberlock",
            "sudo groupadd --system emberlock && sudo usermod --append --groups emberlock " + f.user +
                "    # then log in anew"};
  }
  if (f.in_group) return {"groups", Health::ok, f.user + " is in the group emberlock", ""};
  if (f.joined_later) {
    return {"groups", Health::fail, f.user + " is in the group emberlock, but joined it after logging in",
            "log in anew, or: newgrp emberlock"};
  }
  return {"groups", Health::fail, f.user + " is not in the group emberlock",
          "sudo usermod --append --groups emberlock " + f.user + "    # then log in anew"};
}

Check devices(const Facts& f) {
  if (!f.driver_failures.empty())
    return {"cameras", Health::fail, f.driver_failures.front().message(), "emberlock devices"};
  if (!f.locked.empty()) {
    return {"cameras", Health::fail,
            fmt::format("{} can't be opened by {}{}", f.locked.front().string(), f.user,
                        f.locked.size() > 1 ? fmt::format(", nor can {} more", f.locked.size() - 1) : ""),
            "see groups and udev rules"};
  }
  if (f.cameras == 0) {
    return {"cameras", Health::warn, "none is plugged in and switched on",
            "emberlock devices watch    # and plug one in"};
  }
  return {"cameras", Health::ok, fmt::format("{} there; emberlock devices lists them", f.cameras), ""};
}

Check rules(const Facts& f) {
  if (f.rules) return {"udev rules", Health::ok, f.rules->string(), ""};
  return {"udev rules", Health::warn,
          "72-emberlock.rules is not installed: cameras keep the distribution's groups, fall asleep, and "
          "gvfs takes them",
          "sudo install -m 644 udev/72-emberlock.rules /etc/udev/rules.d/ && sudo udevadm control --reload "
          "&& sudo "
          "udevadm trigger"};
}

Check holders(const Facts& f) {
  for (const auto& [id, holder] : f.held) {
    if (holder.program.starts_with("emberlock")) continue;
    return {"holders", Health::fail, fmt::format("{} (process {}) has {}", holder.program, holder.pid, id),
            fmt::format("kill {}    # or close it", holder.pid)};
  }
  return {"holders", Health::ok,
          f.held.empty() ? "nobody has a camera or port"
                         : fmt::format("{} of them are Emberlock's own now", f.held.size()),
          ""};
}

Check meddlers(const Facts& f) {
  std::string names;
  for (const Meddler& m : f.meddlers)
    names += fmt::format("{}{} (process {})", names.empty() ? "" : ", ", m.program, m.pid);
  if (names.empty())
    return {"meddlers", Health::ok, "no gvfs or ModemManager that takes cameras and ports", ""};
  if (f.rules) return {"meddlers", Health::ok, names + ": kept off by the udev rules", ""};
  return {"meddlers", Health::warn, names + " take cameras and ports for themselves",
          "install the udev rules, or: systemctl --user mask gvfs-gphoto2-volume-monitor; sudo systemctl "
          "stop ModemManager"};
}

Check strobe(const Facts& f) {
  switch (f.strobe) {
    case StrobeSource::none:
      return {"strobe", Health::ok, "none is configured: cameras are recorded, not aligned", ""};
    case StrobeSource::virtual_:
      return {"strobe", Health::ok, "simulated", ""};
    case StrobeSource::serial:
      return {"strobe", Health::ok, "on a serial line; emberlock strobe asks it", ""};
    case StrobeSource::replay:
      return {"strobe", Health::ok, "a recorded one", ""};
    case StrobeSource::manual:
      break;
  }
  std::string found = "set by hand: ";
  if (f.frame_rate > Hertz(0)) {
    const Hertz set = f.dial.nearest(f.frame_rate);
    found += fmt::format("to {} flashes a minute ({:.3f} Hz), unless emberlock status says otherwise",
                         f.dial.per_minute(set), set.value());
  } else {
    found += "emberlock status says what to, once it aligns";
  }
  return {
      "strobe", Health::ok,
      found +
          "; what was set is read from the frames. No comb of it measures the row time: row_time_us of each "
          "camera holds",
      ""};
}

std::string bytes(std::uint64_t n) {
  if (n == UINT64_MAX) return "unlimited";
  const auto value = static_cast<double>(n);
  return value < 10 * kMega ? fmt::format("{:.0f} kB", value / 1e3) : fmt::format("{:.0f} MB", value / kMega);
}

Check limits(const Facts& f) {
  const std::string found = fmt::format(
      "{} open files (up to {}); locked memory {}, real-time priority {}, neither of which is asked for",
      f.files_soft, f.files_hard, bytes(f.locked_memory), f.realtime_priority);
  if (f.files_soft >= kFewFiles) return {"limits", Health::ok, found, ""};
  return {"limits", Health::warn, found,
          fmt::format("ulimit -n {}", std::min<std::uint64_t>(65536, std::max(f.files_hard, kFewFiles)))};
}

Check usb(const Facts& f) {
  if (!f.usbfs_megabytes) return {"usb memory", Health::ok, "this machine has no USB", ""};
  const int wanted = kUsbfsPerCamera * f.usb3_cameras;
  const std::string found =
      fmt::format("{} MB for {} USB3 Vision cameras", *f.usbfs_megabytes, f.usb3_cameras);
  if (*f.usbfs_megabytes == 0 || *f.usbfs_megabytes >= wanted) return {"usb memory", Health::ok, found, ""};
  return {
      "usb memory", Health::fail, found + ": frames are lost once it is full",
      fmt::format(
          "echo {} | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb    # until the next boot; for "
          "good add usbcore.usbfs_memory_mb={} to the kernel's command line",
          wanted, wanted)};
}

Check network(const Facts& f) {
  if (f.links.empty()) return {"network", Health::ok, "no GigE Vision camera answers", ""};
  for (const NetworkLink& link : f.links) {
    if (link.mtu >= kJumboFrame) continue;
    return {
        "network", Health::warn,
        fmt::format(
            "{} leads to {} GigE cameras with packets of {} bytes: every frame takes {} times the interrupts",
            link.interface, link.cameras, link.mtu, 9000 / std::max(1, link.mtu)),
        fmt::format("sudo ip link set dev {} mtu 9000    # the switch must carry them, too", link.interface)};
  }
  return {"network", Health::ok,
          fmt::format("{} carries packets of {} bytes", f.links.front().interface, f.links.front().mtu), ""};
}

Check socket_buffer(const Facts& f) {
  const std::string found = "net.core.rmem_max is " + bytes(f.socket_buffer);
  if (f.links.empty() || f.socket_buffer >= kSocketBuffer) return {"socket buffer", Health::ok, found, ""};
  return {
      "socket buffer", Health::warn, found + ": bursts of whole frames don't fit",
      "echo net.core.rmem_max=33554432 | sudo tee /etc/sysctl.d/60-emberlock.conf && sudo sysctl --system"};
}

Check disk_space(const Facts& f) {
  if (!f.folder_error.empty()) {
    return {"disk", Health::fail, f.folder_error,
            fmt::format("sudo install -d -o {} {}", f.user, f.folder.string())};
  }
  const double above = static_cast<double>(f.free_bytes) - static_cast<double>(f.floor_bytes);
  std::string found =
      fmt::format("{:.1f} GB free at {}", static_cast<double>(f.free_bytes) / 1e9, f.folder.string());
  const std::string other = "delete old sessions, or name another folder in [recording]";
  if (above <= 0) return {"disk", Health::fail, found + ", which is below free_space_floor_mib", other};
  if (f.wanted_bytes_per_s <= 0) return {"disk", Health::ok, found, ""};
  const double minutes = above / f.wanted_bytes_per_s / 60;
  found += fmt::format(": {:.0f} minutes of raw recording", minutes);
  if (minutes < kShortMinutes) return {"disk", Health::warn, found, other};
  return {"disk", Health::ok, found, ""};
}

Check disk_speed(const Facts& f) {
  if (!f.write_bytes_per_s) return {"disk speed", Health::ok, "not measured", ""};
  std::string found = fmt::format("{:.0f} MB/s", *f.write_bytes_per_s / kMega);
  if (f.wanted_bytes_per_s <= 0) return {"disk speed", Health::ok, found, ""};
  found += fmt::format(", the cameras send {:.0f} MB/s", f.wanted_bytes_per_s / kMega);
  const std::string other =
      R"(name a folder on a faster disk in [recording], or encoding = "ffv1", which writes about half as much)";
  if (*f.write_bytes_per_s < f.wanted_bytes_per_s) return {"disk speed", Health::fail, found, other};
  if (*f.write_bytes_per_s < 1.5 * f.wanted_bytes_per_s)
    return {"disk speed", Health::warn, found + ": little to spare", other};
  return {"disk speed", Health::ok, found, ""};
}

Check clock(const Facts& f) {
  if (f.clock_synchronized) return {"clock", Health::ok, "kept in time by the network", ""};
  return {"clock", Health::warn,
          "not synchronised: recordings carry a wrong date (alignment doesn't need it)",
          "sudo timedatectl set-ntp true"};
}

Check governor(const Facts& f) {
  if (f.governor.empty()) return {"processor", Health::ok, "the kernel doesn't change its clock", ""};
  if (f.governor == "performance" || f.governor == "schedutil")
    return {"processor", Health::ok, f.governor, ""};
  return {"processor", Health::warn, f.governor + ": it wakes slowly, and frames may queue up",
          "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"};
}

Check config(const Facts& f) {
  if (f.config_file.empty()) {
    return {"configuration", Health::ok, "there is no file: the defaults hold", ""};
  }
  if (f.config_problems.empty()) return {"configuration", Health::ok, f.config_file.string(), ""};
  std::string found = f.config_problems.front().message();
  if (f.config_problems.size() > 1) found += fmt::format(" (and {} more)", f.config_problems.size() - 1);
  return {"configuration", Health::fail, found,
          "emberlockd --check-config --config " + f.config_file.string()};
}

Check daemon(const Facts& f) {
  switch (f.daemon) {
    case Reach::answers:
      return {"daemon", Health::ok, "listens at " + f.socket.string(), ""};
    case Reach::nobody_there:
      return {"daemon", Health::warn, "nobody listens at " + f.socket.string(),
              "sudo systemctl enable --now emberlockd"};
    case Reach::refused:
      break;
  }
  return {"daemon", Health::fail, f.user + " may not use " + f.socket.string(), "see groups"};
}

Check cuda(const Facts& f) {
  if (!f.cuda_built) return {"cuda", Health::ok, "built without it: reconstructions run on the CPU", ""};
  if (f.cuda_node) return {"cuda", Health::ok, "/dev/nvidia0 is there", ""};
  return {"cuda", Health::warn, "/dev/nvidia0 can't be opened: reconstructions run on the CPU",
          "sudo nvidia-modprobe -u -c=0    # with NVIDIA's driver installed"};
}

}  // namespace

std::string_view name(Health health) {
  switch (health) {
    case Health::ok:
      return "ok";
    case Health::warn:
      return "warn";
    case Health::fail:
      break;
  }
  return "FAIL";
}

std::vector<Check> judge(const Facts& facts) {
  std::vector<Check> checks;
  for (const auto check : {groups, rules, devices, strobe, holders, meddlers, limits, usb, network,
                           socket_buffer, disk_space, disk_speed, clock, governor, config, daemon, cuda}) {
    checks.push_back(check(facts));
  }
  return checks;
}

}  // namespace emberlock::rig::doctor
