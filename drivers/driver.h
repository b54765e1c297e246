// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/holder.h"

// The interface of each camera driver, beside `Camera`: finding cameras and opening one.
namespace emberlock::drivers {

/// A mode in which a camera can film.
struct CameraMode {
  ImageLayout layout;    ///< of the frames that are handed on
  std::string encoding;  ///< the device's name of the format that it sends: "YUYV", "Mono12Packed"
  Hertz frame_rate;      ///< the highest
  friend bool operator==(const CameraMode&, const CameraMode&) = default;
};

enum class ExternalTrigger { absent, present };

/// A connected camera, whether it is open or not.
struct CameraFound {
  std::string id;  ///< see CameraInfo::id
  std::string model;
  std::string address;            ///< current address: "/dev/video3", "192.168.1.7", "usb 3-1"; may change
  std::vector<CameraMode> modes;  ///< empty if the camera can't be queried: it is held or doesn't answer
  ShutterReset reset = ShutterReset::none;
  std::optional<FrameRateTrim> trim = {};
  ExternalTrigger trigger = ExternalTrigger::absent;
  std::optional<double> link_megabits = {};  ///< bandwidth of its bus or network, if known
  std::optional<Holder> holder = {};         ///< the process that has the camera open
  std::vector<std::string> notes =
      {};  ///< hints for the operator: "packets of 576 bytes, the network takes 1500"
};

/// How a camera shall film. The driver chooses what is absent.
struct CameraRequest {
  std::optional<ImageSize> size = {};  ///< default: the largest
  std::optional<PixelFormat> format =
      {};  ///< default: the one that keeps most of the data that the camera sends
  std::optional<Hertz> frame_rate = {};  ///< default: the highest; rounded to a rate of the camera
  std::optional<Seconds> exposure = {};  ///< default: the camera's present setting
  std::map<std::string, std::string> controls = {};  ///< by the device's own names; set before filming
};

/// The mode that fits the request best. Error bad_input: none fits; lists what `camera` can do.
Result<CameraMode> choose_mode(std::span<const CameraMode> modes, const CameraRequest& request,
                               const std::string& camera);

/// A driver: one folder of drivers/. Thread-safe.
struct CameraDriver {
  std::string_view name;  ///< name of the folder
  /// Connected cameras. Returns within 3 s, even if a device hangs.
  Result<std::vector<CameraFound>> (*find)();
  /// Opens a camera by its id and applies `request`. Errors: bad_input (invalid request; says what the camera
  /// can do), device (absent, held, refuses).
  Result<std::unique_ptr<Camera>> (*open)(const std::string& id, const CameraRequest& request);
};

}  // namespace emberlock::drivers
