// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/device_list.h"

#include <algorithm>
#include <array>
#include <future>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "drivers/aravis/aravis_driver.h"
#include "drivers/ptp/driver.h"
#include "drivers/v4l2/v4l2.h"

namespace emberlock::rig {
namespace {

using nlohmann::ordered_json;

constexpr std::string_view kSerialPorts = "strobe_serial";

std::string_view name(ShutterReset reset) {
  switch (reset) {
    case ShutterReset::none:
      return "none";
    case ShutterReset::by_hand:
      return "by hand";
    case ShutterReset::on_command:
      return "on command";
  }
  return "none";
}

std::string mode_words(const drivers::CameraMode& mode) {
  return fmt::format("{} x {} {} ({}) at {:.4g}/s", mode.layout.size.width, mode.layout.size.height,
                     emberlock::name(mode.layout.format), mode.encoding, mode.frame_rate.value());
}

std::string modes_words(const drivers::CameraFound& camera, Detail detail) {
  if (camera.modes.empty()) return "can't be asked now";
  if (detail == Detail::best_mode) {
    const drivers::CameraMode best = drivers::choose_mode(camera.modes, {}, camera.id).value();
    return mode_words(best) +
           (camera.modes.size() > 1 ? fmt::format(", {} more with --modes", camera.modes.size() - 1) : "");
  }
  std::string words;
  for (const drivers::CameraMode& mode : camera.modes)
    words += (words.empty() ? "" : "\n           ") + mode_words(mode);
  return words;
}

std::string can_words(const drivers::CameraFound& camera) {
  std::string words = fmt::format("reset {}", name(camera.reset));
  if (camera.trim) {
    words += fmt::format(", trim +-{:g} ppm in steps of {:g}", camera.trim->range.value(),
                         camera.trim->step.value());
  }
  words +=
      camera.trigger == drivers::ExternalTrigger::present ? ", external trigger" : ", no external trigger";
  return words;
}

ordered_json holder_json(const std::optional<drivers::Holder>& holder) {
  if (!holder) return nullptr;
  return {{"pid", holder->pid}, {"program", holder->program}};
}

std::string holder_line(const std::optional<drivers::Holder>& holder) {
  if (!holder) return {};
  return fmt::format("  held by  {} (process {})\n", holder->program, holder->pid);
}

ordered_json camera_json(const ListedCamera& camera) {
  const drivers::CameraFound& found = camera.found;
  ordered_json modes = ordered_json::array();
  for (const drivers::CameraMode& mode : found.modes) {
    modes.push_back({{"width", mode.layout.size.width},
                     {"height", mode.layout.size.height},
                     {"format", emberlock::name(mode.layout.format)},
                     {"bit_depth", mode.layout.bit_depth},
                     {"encoding", mode.encoding},
                     {"frame_rate_hz", mode.frame_rate.value()}});
  }
  ordered_json json{{"id", found.id},
                    {"driver", camera.driver},
                    {"model", found.model},
                    {"address", found.address},
                    {"reset", name(found.reset)},
                    {"trim_range_ppm", nullptr},
                    {"external_trigger", found.trigger == drivers::ExternalTrigger::present},
                    {"link_megabits", nullptr},
                    {"held_by", holder_json(found.holder)},
                    {"notes", found.notes},
                    {"modes", std::move(modes)}};
  if (found.trim) json["trim_range_ppm"] = found.trim->range.value();
  if (found.link_megabits) json["link_megabits"] = *found.link_megabits;
  return json;
}

const std::string& id_of(const ListedCamera& camera) { return camera.found.id; }
const std::string& id_of(const drivers::StrobeFound& port) { return port.id; }

/// The items of `devices` whose ids aren't in `others`.
template <class Found>
std::vector<Found> without(const std::vector<Found>& devices, const std::vector<Found>& others) {
  std::vector<Found> left;
  std::copy_if(devices.begin(), devices.end(), std::back_inserter(left), [&](const Found& device) {
    return std::none_of(others.begin(), others.end(),
                        [&](const Found& other) { return id_of(other) == id_of(device); });
  });
  return left;
}

}  // namespace

std::span<const drivers::CameraDriver> camera_drivers() {
  static const std::array<drivers::CameraDriver, 3> drivers{drivers::v4l2_driver(), drivers::aravis_driver(),
                                                            drivers::ptp_driver()};
  return drivers;
}

DeviceList list_cameras(std::span<const drivers::CameraDriver> drivers) {
  std::vector<std::future<Result<std::vector<drivers::CameraFound>>>> asked;
  asked.reserve(drivers.size());
  for (const drivers::CameraDriver& driver : drivers)
    asked.push_back(std::async(std::launch::async, driver.find));
  DeviceList list;
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    auto found = asked[i].get();
    if (!found) {
      list.failures.push_back({drivers[i].name, found.error()});
      continue;
    }
    for (drivers::CameraFound& camera : *found) list.cameras.push_back({drivers[i].name, std::move(camera)});
  }
  std::stable_sort(list.cameras.begin(), list.cameras.end(),
                   [](const ListedCamera& a, const ListedCamera& b) {
                     return std::pair(a.driver, std::string_view(a.found.id)) <
                            std::pair(b.driver, std::string_view(b.found.id));
                   });
  return list;
}

DeviceList list_devices() {
  DeviceList list = list_cameras(camera_drivers());
  if (auto ports = drivers::find_serial_strobes()) {
    list.ports = std::move(ports).value();
  } else {
    list.failures.push_back({kSerialPorts, ports.error()});
  }
  return list;
}

Result<ListedCamera> find_camera(const DeviceList& list, const std::string& id) {
  std::string there;
  for (const ListedCamera& camera : list.cameras) {
    if (camera.found.id == id) return camera;
    there += (there.empty() ? "" : ", ") + camera.found.id;
  }
  return Error{
      ErrorKind::bad_input, "there is no such camera", id,
      there.empty() ? "no camera was found: see `emberlock devices`" : "the cameras found are " + there};
}

DeviceList keep_unseen(const DeviceList& before, DeviceList now) {
  for (const DeviceList::Failure& failure : now.failures) {
    std::copy_if(before.cameras.begin(), before.cameras.end(), std::back_inserter(now.cameras),
                 [&](const ListedCamera& camera) { return camera.driver == failure.driver; });
    if (failure.driver == kSerialPorts) now.ports = before.ports;
  }
  return now;
}

DeviceChanges changes(const DeviceList& before, const DeviceList& after) {
  return {{without(after.cameras, before.cameras), without(after.ports, before.ports), {}},
          {without(before.cameras, after.cameras), without(before.ports, after.ports), {}}};
}

std::string device_table(const DeviceList& list, Detail detail) {
  std::string table;
  for (const ListedCamera& camera : list.cameras) {
    const drivers::CameraFound& found = camera.found;
    table += fmt::format("{}\n  is       {}, {} at {}\n  films    {}\n  can      {}\n", found.id, found.model,
                         camera.driver, found.address, modes_words(found, detail), can_words(found));
    table += holder_line(found.holder);
    for (const std::string& note : found.notes) table += fmt::format("  note     {}\n", note);
  }
  for (const drivers::StrobeFound& port : list.ports) {
    table += fmt::format(
        "{}\n  is       {}, serial port {}; `emberlock devices probe {}` asks whether it is a strobe\n",
        port.id, port.model, port.address, port.id);
    table += holder_line(port.holder);
  }
  return table;
}

std::string device_json(const DeviceList& list) {
  ordered_json cameras = ordered_json::array();
  for (const ListedCamera& camera : list.cameras) cameras.push_back(camera_json(camera));
  ordered_json ports = ordered_json::array();
  for (const drivers::StrobeFound& port : list.ports) {
    ports.push_back({{"id", port.id},
                     {"model", port.model},
                     {"address", port.address},
                     {"held_by", holder_json(port.holder)}});
  }
  ordered_json failures = ordered_json::array();
  for (const DeviceList::Failure& failure : list.failures) failures.push_back(failure.error.message());
  return ordered_json{
      {"cameras", std::move(cameras)}, {"serial_ports", std::move(ports)}, {"failures", std::move(failures)}}
      .dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace emberlock::rig
