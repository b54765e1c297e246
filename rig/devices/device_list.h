// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "drivers/driver.h"
#include "drivers/strobe_serial/strobe_serial.h"

// Everything that is there, by all drivers.
namespace emberlock::rig {

struct ListedCamera {
  std::string_view driver;
  drivers::CameraFound found;
};

/// What was found: cameras by driver and id, and the serial ports, any of which may lead to a strobe.
struct DeviceList {
  std::vector<ListedCamera> cameras;
  std::vector<drivers::StrobeFound> ports;
  struct Failure {
    std::string_view driver;
    Error error;
  };
  std::vector<Failure> failures;  ///< of drivers that couldn't look
};

/// Every driver of real cameras.
std::span<const drivers::CameraDriver> camera_drivers();

/// Asks all drivers at once.
DeviceList list_cameras(std::span<const drivers::CameraDriver> drivers);
/// The cameras of all drivers, and the serial ports.
DeviceList list_devices();

/// The camera of this id, with its driver. Error bad_input names what there is instead.
Result<ListedCamera> find_camera(const DeviceList& list, const std::string& id);

/// `now`, with what drivers that couldn't look this time had `before`.
DeviceList keep_unseen(const DeviceList& before, DeviceList now);

/// What came and what went from one list to the next, by id.
struct DeviceChanges {
  DeviceList came;
  DeviceList went;
};
DeviceChanges changes(const DeviceList& before, const DeviceList& after);

/// Lines for people, a block a camera; `Detail::all_modes` with every mode.
enum class Detail { best_mode, all_modes };
std::string device_table(const DeviceList& list, Detail detail);
/// One JSON object: {"cameras": [...], "serial_ports": [...], "failures": [...]}.
std::string device_json(const DeviceList& list);

}  // namespace emberlock::rig
