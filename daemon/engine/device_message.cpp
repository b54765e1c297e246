// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/device_message.h"

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "session/layout.h"

namespace emberlock::daemon {
namespace {

v1::CameraStream::ShutterReset reset_of(ShutterReset reset) {
  switch (reset) {
    case ShutterReset::none:
      return v1::CameraStream::NONE;
    case ShutterReset::by_hand:
      return v1::CameraStream::BY_HAND;
    case ShutterReset::on_command:
      return v1::CameraStream::ON_COMMAND;
  }
  return v1::CameraStream::SHUTTER_RESET_UNSPECIFIED;
}

/// Devices and processes are named by anybody's bytes, of which the kernel may cut the last in two; a message
/// holds UTF-8 alone. What isn't becomes U+FFFD.
std::string readable(const std::string& text) {
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  return nlohmann::json::parse(nlohmann::json(text).dump(-1, ' ', false, kReplace)).get<std::string>();
}

template <class Device>
void set_holder(Device& device, const std::optional<drivers::Holder>& holder) {
  if (!holder) return;
  device.mutable_held_by()->set_pid(holder->pid);
  device.mutable_held_by()->set_program(readable(holder->program));
}

v1::CameraMode mode_of(const drivers::CameraMode& mode) {
  v1::CameraStream layout;
  session::set_layout(layout, mode.layout);
  v1::CameraMode shown;
  shown.set_width(layout.width());
  shown.set_height(layout.height());
  shown.set_format(layout.format());
  shown.set_bit_depth(layout.bit_depth());
  shown.set_encoding(readable(mode.encoding));
  shown.set_frame_rate_hz(mode.frame_rate.value());
  return shown;
}

v1::DeviceCamera camera_of(const rig::ListedCamera& camera) {
  const drivers::CameraFound& found = camera.found;
  v1::DeviceCamera shown;
  shown.set_id(readable(found.id));
  shown.set_driver(std::string(camera.driver));
  shown.set_model(readable(found.model));
  shown.set_address(readable(found.address));
  shown.set_reset(reset_of(found.reset));
  if (found.trim) shown.set_trim_range_ppm(found.trim->range.value());
  shown.set_external_trigger(found.trigger == drivers::ExternalTrigger::present);
  if (found.link_megabits) shown.set_link_megabits(*found.link_megabits);
  set_holder(shown, found.holder);
  for (const std::string& note : found.notes) shown.add_notes(readable(note));
  for (const drivers::CameraMode& mode : found.modes) *shown.add_modes() = mode_of(mode);
  return shown;
}

}  // namespace

v1::ListDevicesResponse to_proto(const rig::DeviceList& list) {
  v1::ListDevicesResponse response;
  for (const rig::ListedCamera& camera : list.cameras) *response.add_cameras() = camera_of(camera);
  for (const drivers::StrobeFound& port : list.ports) {
    v1::SerialPort& shown = *response.add_serial_ports();
    shown.set_id(readable(port.id));
    shown.set_model(readable(port.model));
    shown.set_address(readable(port.address));
    set_holder(shown, port.holder);
  }
  for (const rig::DeviceList::Failure& failure : list.failures)
    response.add_failures(readable(failure.error.message()));
  return response;
}

}  // namespace emberlock::daemon
