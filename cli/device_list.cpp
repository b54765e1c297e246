#include "cli/device_list.h"

#include <algorithm>
#include <array>
#include <future>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "drivers/ptp/driver.h"
#include "drivers/v4l2/v4l2.h"

namespace emberlock::cli {
namespace {

using nlohmann::ordered_json;

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

std::string mode_words(const CameraMode& mode) {
  return fmt::format("{} x {} {} ({}) at {:.4g}/s", mode.layout.size.width, mode.layout.size.height,
                     emberlock::name(mode.layout.format), mode.encoding, mode.frame_rate.value());
}

std::string modes_words(const CameraFound& camera, Detail detail) {
  if (camera.modes.empty()) return "can't be asked now";
  if (detail == Detail::best_mode) {
    const CameraMode best = choose_mode(camera.modes, {}, camera.id).value();
    return mode_words(best) +
           (camera.modes.size() > 1 ? fmt::format(", {} more with --modes", camera.modes.size() - 1) : "");
  }
  std::string words;
  for (const CameraMode& mode : camera.modes)
    words += (words.empty() ? "" : "\n           ") + mode_words(mode);
  return words;
}

std::string can_words(const CameraFound& camera) {
  std::string words = fmt::format("reset {}", name(camera.reset));
  if (camera.trim) {
    words += fmt::format(", trim +-{:g} ppm in steps of {:g}", camera.trim->range.value(),
                         camera.trim->step.value());
  }
  words += camera.trigger == ExternalTrigger::present ? ", external trigger" : ", no external trigger";
  return words;
}

ordered_json camera_json(const ListedCamera& camera) {
  const CameraFound& found = camera.found;
  ordered_json modes = ordered_json::array();
  for (const CameraMode& mode : found.modes) {
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
                    {"external_trigger", found.trigger == ExternalTrigger::present},
                    {"link_megabits", nullptr},
                    {"held_by", nullptr},
                    {"notes", found.notes},
                    {"modes", std::move(modes)}};
  if (found.trim) json["trim_range_ppm"] = found.trim->range.value();
  if (found.link_megabits) json["link_megabits"] = *found.link_megabits;
  if (found.holder) json["held_by"] = {{"pid", found.holder->pid}, {"program", found.holder->program}};
  return json;
}

bool has(const DeviceList& list, const std::string& id) {
  return std::any_of(list.cameras.begin(), list.cameras.end(),
                     [&](const ListedCamera& camera) { return camera.found.id == id; });
}

}  // namespace

std::span<const CameraDriver> camera_drivers() {
  static const std::array<CameraDriver, 2> drivers{v4l2_driver(), ptp_driver()};
  return drivers;
}

DeviceList list_devices(std::span<const CameraDriver> drivers) {
  std::vector<std::future<Result<std::vector<CameraFound>>>> asked;
  asked.reserve(drivers.size());
  for (const CameraDriver& driver : drivers) asked.push_back(std::async(std::launch::async, driver.find));
  DeviceList list;
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    auto found = asked[i].get();
    if (!found) {
      list.failures.push_back(found.error());
      continue;
    }
    for (CameraFound& camera : *found) list.cameras.push_back({drivers[i].name, std::move(camera)});
  }
  std::stable_sort(list.cameras.begin(), list.cameras.end(),
                   [](const ListedCamera& a, const ListedCamera& b) {
                     return std::pair(a.driver, std::string_view(a.found.id)) <
                            std::pair(b.driver, std::string_view(b.found.id));
                   });
  return list;
}

Result<ListedCamera> find_camera(const DeviceList& list, const std::string& id) {
  std::string there;
  for (const ListedCamera& camera : list.cameras) {
    if (camera.found.id == id) return camera;
    there += (there.empty() ? "" : ", ") + camera.found.id;
  }
  return Error{ErrorKind::bad_input, "there is no such camera", id,
               there.empty() ? "no camera was found: see `emberlock devices`" : "there is " + there};
}

DeviceChanges changes(const DeviceList& before, const DeviceList& after) {
  DeviceChanges changed;
  std::copy_if(after.cameras.begin(), after.cameras.end(), std::back_inserter(changed.came),
               [&](const ListedCamera& camera) { return !has(before, camera.found.id); });
  std::copy_if(before.cameras.begin(), before.cameras.end(), std::back_inserter(changed.went),
               [&](const ListedCamera& camera) { return !has(after, camera.found.id); });
  return changed;
}

std::string device_table(const DeviceList& list, Detail detail) {
  std::string table;
  for (const ListedCamera& camera : list.cameras) {
    const CameraFound& found = camera.found;
    table += fmt::format("{}\n  is       {}, {} at {}\n  films    {}\n  can      {}\n", found.id, found.model,
                         camera.driver, found.address, modes_words(found, detail), can_words(found));
    if (found.holder)
      table += fmt::format("  held by  {} (process {})\n", found.holder->program, found.holder->pid);
    for (const std::string& note : found.notes) table += fmt::format("  note     {}\n", note);
  }
  return table;
}

std::string device_json(const DeviceList& list) {
  ordered_json cameras = ordered_json::array();
  for (const ListedCamera& camera : list.cameras) cameras.push_back(camera_json(camera));
  ordered_json failures = ordered_json::array();
  for (const Error& failure : list.failures) failures.push_back(failure.message());
  return ordered_json{{"cameras", std::move(cameras)}, {"failures", std::move(failures)}}.dump(
      -1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace emberlock::cli
