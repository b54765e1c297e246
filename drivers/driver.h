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

// What each camera driver offers beside `Camera`: to find what is there, and to open one of them.
namespace emberlock::drivers {

/// A way in which a camera can film.
struct CameraMode {
  ImageLayout layout;    ///< as frames are handed on
  std::string encoding;  ///< as the device names what it sends: "YUYV", "Mono12Packed"
  Hertz frame_rate;      ///< the fastest
  friend bool operator==(const CameraMode&, const CameraMode&) = default;
};

enum class ExternalTrigger { absent, present };

/// A camera that is there, opened by somebody or not.
struct CameraFound {
  std::string id;  ///< as CameraInfo::id
  std::string model;
  std::string address;            ///< where it is now: "/dev/video3", "192.168.1.7", "usb 3-1"; may change
  std::vector<CameraMode> modes;  ///< empty where it can't be asked: it is held, or doesn't answer
  ShutterReset reset = ShutterReset::none;
  std::optional<FrameRateTrim> trim = {};
  ExternalTrigger trigger = ExternalTrigger::absent;
  std::optional<double> link_megabits =
      {};                             ///< what its bus or network carries a second, where that can be asked
  std::optional<Holder> holder = {};  ///< the process that has it, if one has
  std::vector<std::string> notes =
      {};  ///< what an operator should know: "packets of 576 bytes, the network takes 1500"
};

/// How a camera shall film; what isn't said is the driver's choice.
struct CameraRequest {
  std::optional<ImageSize> size = {};                ///< else the largest
  std::optional<PixelFormat> format = {};            ///< else what keeps most of what the camera sends
  std::optional<Hertz> frame_rate = {};              ///< else the fastest; rounded to what the camera can
  std::optional<Seconds> exposure = {};              ///< else as the camera is set
  std::map<std::string, std::string> controls = {};  ///< by the device's own names, set before it films
};

/// The mode that suits best. Error bad_input: none does; says what `camera` can do instead.
Result<CameraMode> choose_mode(std::span<const CameraMode> modes, const CameraRequest& request,
                               const std::string& camera);

/// One folder of drivers/. Thread-safe.
struct CameraDriver {
  std::string_view name;  ///< the folder's
  /// What is there now, within 3 s, whatever hangs.
  Result<std::vector<CameraFound>> (*find)();
  /// Opens a camera by its id, set up as `request` says. Errors: bad_input (the request; says what the camera
  /// can), device (not there, held, refuses).
  Result<std::unique_ptr<Camera>> (*open)(const std::string& id, const CameraRequest& request);
};

}  // namespace emberlock::drivers
