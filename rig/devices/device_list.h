// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "drivers/driver.h"
#include "drivers/strobe_serial/strobe_serial.h"

// All connected devices of all drivers.
namespace emberlock::rig {

struct ListedCamera {
  std::string_view driver;
  drivers::CameraFound found;
};

/// The connected devices: cameras by driver and id, and serial ports, to each of which a strobe may be
/// connected.
struct DeviceList {
  std::vector<ListedCamera> cameras;
  std::vector<drivers::StrobeFound> ports;
  struct Failure {
    std::string_view driver;
    Error error;
  };
  std::vector<Failure> failures;  ///< drivers that failed to search
};

/// The drivers of all real cameras.
std::span<const drivers::CameraDriver> camera_drivers();

/// Queries all drivers in parallel.
DeviceList list_cameras(std::span<const drivers::CameraDriver> drivers);
/// The cameras of all drivers, and the serial ports.
DeviceList list_devices();

/// The camera with this id, and its driver. Error bad_input lists the existing ones.
Result<ListedCamera> find_camera(const DeviceList& list, const std::string& id);

/// `now`, completed with the entries of `before` for drivers that failed this time.
DeviceList keep_unseen(const DeviceList& before, DeviceList now);

/// The devices added and removed between two lists, by id.
struct DeviceChanges {
  DeviceList came;
  DeviceList went;
};
DeviceChanges changes(const DeviceList& before, const DeviceList& after);

/// A list for display, one block per camera; `Detail::all_modes` includes every mode.
enum class Detail { best_mode, all_modes };
std::string device_table(const DeviceList& list, Detail detail);
/// One JSON object: {"cameras": [...], "serial_ports": [...], "failures": [...]}.
std::string device_json(const DeviceList& list);

}  // namespace emberlock::rig
