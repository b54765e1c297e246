// SPDX-License-Identifier: Apache-2.0
#include "rig/doctor/words.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <utility>
#include <variant>

#include <fmt/format.h>

namespace emberlock::rig::doctor {
namespace {

/// Of the matters, as FindingCode lists them.
constexpr std::array<std::string_view, std::variant_size_v<FindingCode>> kMatters{
    "groups", "udev rules", "cameras",       "strobe",        "holders", "meddlers",
    "limits", "usb memory", "network",       "socket buffer", "disk",    "disk speed",
    "clock",  "processor",  "configuration", "daemon",        "cuda"};

constexpr double kMega = 1e6;  // bytes

std::string bytes(std::uint64_t n) {
  if (n == UINT64_MAX) return "unlimited";
  const auto value = static_cast<double>(n);
  return value < 10 * kMega ? fmt::format("{:.0f} kB", value / 1e3) : fmt::format("{:.0f} MB", value / kMega);
}

/// What was found, and what to do.
struct Said {
  std::string found;
  std::string remedy = {};
};

/// A sentence for each code.
struct Speaker {
  const Finding& finding;
  const Facts& f;

  Said operator()(GroupFinding code) const {
    switch (code) {
      case GroupFinding::root:
        return {"this is root, who may open everything"};
      case GroupFinding::no_group:
        return {"there is no group emberlock",
                "sudo groupadd --system emberlock && sudo usermod --append --groups emberlock " + f.user +
                    "    # then log in anew"};
      case GroupFinding::member:
        return {f.user + " is in the group emberlock"};
      case GroupFinding::joined_later:
        return {f.user + " is in the group emberlock, but joined it after logging in",
                "log in anew, or: newgrp emberlock"};
      case GroupFinding::outsider:
        break;
    }
    return {f.user + " is not in the group emberlock",
            "sudo usermod --append --groups emberlock " + f.user + "    # then log in anew"};
  }

  Said operator()(RulesFinding code) const {
    if (code == RulesFinding::installed) return {f.rules->string()};
    return {
        "72-emberlock.rules is not installed: cameras keep the distribution's groups, fall asleep, and "
        "gvfs takes them",
        "sudo install -m 644 udev/72-emberlock.rules /etc/udev/rules.d/ && sudo udevadm control --reload "
        "&& sudo "
        "udevadm trigger"};
  }

  Said operator()(CameraFinding code) const {
    switch (code) {
      case CameraFinding::driver_failed:
        return {f.driver_failures.front().message(), "emberlock devices"};
      case CameraFinding::locked:
        return {fmt::format("{} can't be opened by {}{}", f.locked.front().string(), f.user,
                            f.locked.size() > 1 ? fmt::format(", nor can {} more", f.locked.size() - 1) : ""),
                "see groups and udev rules"};
      case CameraFinding::none:
        return {"none is plugged in and switched on", "emberlock devices watch    # and plug one in"};
      case CameraFinding::some:
        break;
    }
    return {fmt::format("{} there; emberlock devices lists them", f.cameras)};
  }

  Said operator()(StrobeFinding code) const {
    switch (code) {
      case StrobeFinding::none:
        return {"none is configured: cameras are recorded, not aligned"};
      case StrobeFinding::simulated:
        return {"simulated"};
      case StrobeFinding::serial:
        return {"on a serial line; emberlock strobe asks it"};
      case StrobeFinding::replayed:
        return {"a recorded one"};
      case StrobeFinding::by_hand:
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
        found +
        "; what was set is read from the frames. No comb of it measures the row time: row_time_us of each "
        "camera holds"};
  }

  Said operator()(HolderFinding code) const {
    switch (code) {
      case HolderFinding::nobody:
        return {"nobody has a camera or port"};
      case HolderFinding::ours:
        return {fmt::format("{} of them are Emberlock's own now", f.held.size())};
      case HolderFinding::others:
        break;
    }
    const auto& [id, holder] = f.held[finding.which];
    return {fmt::format("{} (process {}) has {}", holder.program, holder.pid, id),
            fmt::format("kill {}    # or close it", holder.pid)};
  }

  Said operator()(MeddlerFinding code) const {
    std::string names;
    for (const Meddler& m : f.meddlers)
      names += fmt::format("{}{} (process {})", names.empty() ? "" : ", ", m.program, m.pid);
    switch (code) {
      case MeddlerFinding::none:
        return {"no gvfs or ModemManager that takes cameras and ports"};
      case MeddlerFinding::kept_off:
        return {names + ": kept off by the udev rules"};
      case MeddlerFinding::at_large:
        break;
    }
    return {names + " take cameras and ports for themselves",
            "install the udev rules, or: systemctl --user mask gvfs-gphoto2-volume-monitor; sudo systemctl "
            "stop ModemManager"};
  }

  Said operator()(LimitFinding code) const {
    return {fmt::format("{} open files (up to {}); locked memory {}, real-time priority {}, neither of which "
                        "is asked for",
                        f.files_soft, f.files_hard, bytes(f.locked_memory), f.realtime_priority),
            code == LimitFinding::few_files ? fmt::format("ulimit -n {}", finding.files) : ""};
  }

  Said operator()(UsbFinding code) const {
    if (code == UsbFinding::no_usb) return {"this machine has no USB"};
    const std::string found =
        fmt::format("{} MB for {} USB3 Vision cameras", *f.usbfs_megabytes, f.usb3_cameras);
    if (code == UsbFinding::enough_memory) return {found};
    return {found + ": frames are lost once it is full",
            fmt::format("echo {} | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb    # until the "
                        "next boot; for good add usbcore.usbfs_memory_mb={} to the kernel's command line",
                        finding.megabytes, finding.megabytes)};
  }

  Said operator()(NetworkFinding code) const {
    if (code == NetworkFinding::no_camera) return {"no GigE Vision camera answers"};
    const NetworkLink& link = f.links[finding.which];
    if (code == NetworkFinding::large_packets)
      return {fmt::format("{} carries packets of {} bytes", link.interface, link.mtu)};
    return {
        fmt::format(
            "{} leads to {} GigE cameras with packets of {} bytes: every frame takes {} times the interrupts",
            link.interface, link.cameras, link.mtu, 9000 / std::max(1, link.mtu)),
        fmt::format("sudo ip link set dev {} mtu 9000    # the switch must carry them, too", link.interface)};
  }

  Said operator()(BufferFinding code) const {
    const std::string found = "net.core.rmem_max is " + bytes(f.socket_buffer);
    if (code == BufferFinding::enough) return {found};
    return {found + ": bursts of whole frames don't fit",
            "echo net.core.rmem_max=33554432 | sudo tee /etc/sysctl.d/60-emberlock.conf && sudo sysctl "
            "--system"};
  }

  Said operator()(SpaceFinding code) const {
    if (code == SpaceFinding::unwritable)
      return {f.folder_error, fmt::format("sudo install -d -o {} {}", f.user, f.folder.string())};
    std::string found =
        fmt::format("{:.1f} GB free at {}", static_cast<double>(f.free_bytes) / 1e9, f.folder.string());
    const std::string other = "delete old sessions, or name another folder in [recording]";
    if (code == SpaceFinding::below_floor) return {found + ", which is below free_space_floor_mib", other};
    if (code == SpaceFinding::unknown_time) return {found};
    found += fmt::format(": {:.0f} minutes of raw recording", finding.recording.value() / 60);
    return {found, code == SpaceFinding::short_time ? other : ""};
  }

  Said operator()(SpeedFinding code) const {
    if (code == SpeedFinding::not_measured) return {"not measured"};
    std::string found = fmt::format("{:.0f} MB/s", *f.write_bytes_per_s / kMega);
    if (code == SpeedFinding::unknown_need) return {found};
    found += fmt::format(", the cameras send {:.0f} MB/s", f.wanted_bytes_per_s / kMega);
    if (code == SpeedFinding::enough) return {found};
    if (code == SpeedFinding::little_to_spare) found += ": little to spare";
    return {
        found,
        R"(name a folder on a faster disk in [recording], or encoding = "ffv1", which writes about half as much)"};
  }

  Said operator()(ClockFinding code) const {
    if (code == ClockFinding::synchronized) return {"kept in time by the network"};
    return {"not synchronised: recordings carry a wrong date (alignment doesn't need it)",
            "sudo timedatectl set-ntp true"};
  }

  Said operator()(GovernorFinding code) const {
    switch (code) {
      case GovernorFinding::none:
        return {"the kernel doesn't change its clock"};
      case GovernorFinding::quick:
        return {f.governor};
      case GovernorFinding::slow:
        break;
    }
    return {f.governor + ": it wakes slowly, and frames may queue up",
            "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"};
  }

  Said operator()(ConfigFinding code) const {
    switch (code) {
      case ConfigFinding::no_file:
        return {"there is no file: the defaults hold"};
      case ConfigFinding::valid:
        return {f.config_file.string()};
      case ConfigFinding::wrong:
        break;
    }
    std::string found = f.config_problems.front().message();
    if (f.config_problems.size() > 1) found += fmt::format(" (and {} more)", f.config_problems.size() - 1);
    return {found, "emberlockd --check-config --config " + f.config_file.string()};
  }

  Said operator()(DaemonFinding code) const {
    switch (code) {
      case DaemonFinding::answers:
        return {"listens at " + f.socket.string()};
      case DaemonFinding::nobody_there:
        return {"nobody listens at " + f.socket.string(), "sudo systemctl enable --now emberlockd"};
      case DaemonFinding::refused:
        break;
    }
    return {f.user + " may not use " + f.socket.string(), "see groups"};
  }

  Said operator()(CudaFinding code) const {
    switch (code) {
      case CudaFinding::not_built:
        return {"built without it: reconstructions run on the CPU"};
      case CudaFinding::ready:
        return {"/dev/nvidia0 is there"};
      case CudaFinding::closed:
        break;
    }
    return {"/dev/nvidia0 can't be opened: reconstructions run on the CPU",
            "sudo nvidia-modprobe -u -c=0    # with NVIDIA's driver installed"};
  }
};

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

FindingWords words(const Finding& finding, const Facts& facts) {
  Said said = std::visit(Speaker{finding, facts}, finding.code);
  return {std::string(kMatters[finding.code.index()]), std::move(said.found), std::move(said.remedy)};
}

}  // namespace emberlock::rig::doctor
