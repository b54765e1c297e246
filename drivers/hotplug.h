// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"

struct udev;
struct udev_monitor;

namespace emberlock::drivers {

enum class Hotplug { came, went };

struct HotplugEvent {
  Hotplug what = Hotplug::came;
  std::string subsystem;  ///< "video4linux", "usb", "tty"
  std::string node;       ///< "/dev/video3"
};

/// Reports devices that are plugged in or out. Events come from udev if it runs (the nodes then have their
/// links and groups already), else from the kernel. Network cameras are not reported. One owner thread.
class HotplugMonitor {
 public:
  /// Error io: the system provides no such events.
  static Result<HotplugMonitor> open(const std::vector<std::string>& subsystems);
  /// The next event; waits at most `deadline`. Only plugging in and out is reported, and only for devices
  /// with a node (not for a USB device's interfaces).
  std::optional<HotplugEvent> next(Seconds deadline);

 private:
  struct Release {
    void operator()(udev* context) const;
    void operator()(udev_monitor* monitor) const;
  };
  HotplugMonitor(std::unique_ptr<udev, Release> context, std::unique_ptr<udev_monitor, Release> monitor);
  std::unique_ptr<udev, Release> context_;
  std::unique_ptr<udev_monitor, Release> monitor_;
};

}  // namespace emberlock::drivers
