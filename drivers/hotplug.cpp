// SPDX-License-Identifier: Apache-2.0
#include "drivers/hotplug.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <utility>

#include <libudev.h>
#include <poll.h>

#include "base/clock.h"

namespace emberlock::drivers {
namespace {

Error no_events(const std::string& action) {
  return {ErrorKind::io, action + ": " + std::strerror(errno), "hotplug",
          "without it devices are still found, but only when they are looked for"};
}

std::string or_empty(const char* text) { return text ? text : ""; }

}  // namespace

void HotplugMonitor::Release::operator()(udev* context) const { udev_unref(context); }
void HotplugMonitor::Release::operator()(udev_monitor* monitor) const { udev_monitor_unref(monitor); }

HotplugMonitor::HotplugMonitor(std::unique_ptr<udev, Release> context,
                               std::unique_ptr<udev_monitor, Release> monitor)
    : context_(std::move(context)), monitor_(std::move(monitor)) {}

Result<HotplugMonitor> HotplugMonitor::open(const std::vector<std::string>& subsystems) {
  std::unique_ptr<udev, Release> context(udev_new());
  if (!context) return no_events("udev_new");
  const char* source = std::filesystem::exists("/run/udev/control") ? "udev" : "kernel";
  std::unique_ptr<udev_monitor, Release> monitor(udev_monitor_new_from_netlink(context.get(), source));
  if (!monitor) return no_events("opening the netlink socket");
  for (const std::string& subsystem : subsystems) {
    if (udev_monitor_filter_add_match_subsystem_devtype(monitor.get(), subsystem.c_str(), nullptr) < 0)
      return no_events("asking for " + subsystem);
  }
  if (udev_monitor_enable_receiving(monitor.get()) < 0) return no_events("listening");
  return HotplugMonitor(std::move(context), std::move(monitor));
}

std::optional<HotplugEvent> HotplugMonitor::next(Seconds deadline) {
  SteadyClock clock;
  const TimePoint until = clock.now() + deadline;
  for (;;) {
    pollfd ready{udev_monitor_get_fd(monitor_.get()), POLLIN, 0};
    const double left = std::max(0.0, in_milliseconds(until - clock.now()));
    const int polled = ::poll(&ready, 1, static_cast<int>(std::ceil(left)));
    if (polled < 0 && errno == EINTR) continue;
    if (polled <= 0 || clock.now() > until) return {};
    const std::unique_ptr<udev_device, decltype(&udev_device_unref)> device(
        udev_monitor_receive_device(monitor_.get()), &udev_device_unref);
    if (!device) continue;
    const std::string action = or_empty(udev_device_get_action(device.get()));
    const char* const node = udev_device_get_devnode(device.get());
    if ((action != "add" && action != "remove") || node == nullptr) continue;
    return HotplugEvent{action == "add" ? Hotplug::came : Hotplug::went,
                        or_empty(udev_device_get_subsystem(device.get())), node};
  }
}

}  // namespace emberlock::drivers
