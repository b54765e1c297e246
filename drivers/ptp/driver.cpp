// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/driver.h"

#include <algorithm>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/clock.h"
#include "drivers/ptp/chdk_camera.h"
#include "drivers/ptp/live_view.h"

namespace emberlock::drivers {
namespace {

constexpr Seconds kLook = milliseconds(300);

void describe_chdk(PtpConnection& connection, CameraFound& found) {
  Chdk chdk(*connection.session);
  const auto version = chdk.version();
  if (!version.ok()) {
    found.notes.push_back("it doesn't answer to CHDK: " + version.error().message());
    return;
  }
  found.notes.push_back(fmt::format("CHDK {}.{}", version->major, version->minor));
  found.reset = ShutterReset::on_command;
  if (!chdk.ask_for_live_view().ok()) return;
  const auto answer = connection.session->finish(kLook);
  if (!answer.ok()) return;
  const auto view = parse_live_view(answer->data);
  if (view.ok() && *view) {
    found.modes = chdk_modes((*view)->size);
  } else {
    found.notes.emplace_back("it shows no live view now; it is asked to when it is opened");
  }
}

CameraFound look_at(const UsbPtpDevice& usb) {
  CameraFound found;
  found.id = ptp_id(usb);
  found.model = usb.name;
  found.address = usb.path;
  if (usb.megabits > 0) found.link_megabits = usb.megabits;
  auto connection = connect_ptp(usb);
  if (!connection.ok()) {
    found.holder = holder_of(usb.node());
    found.notes.push_back(connection.error().message());
    return found;
  }
  found.id = connection->id;
  found.model = connection->info.model;
  if (may_run_chdk(*connection)) {
    describe_chdk(*connection, found);
  } else if (usb.vendor == kCanonUsbVendor) {
    found.notes.emplace_back(
        "without CHDK: its clips can be downloaded, it can't be filmed with or reset from here");
  } else {
    found.notes.emplace_back(
        "not a Canon: its clips can be downloaded, it can't be filmed with or reset from here");
  }
  return found;
}

Result<std::vector<CameraFound>> find() {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<UsbPtpDevice> devices, list_usb_ptp());
  // All devices are queried at the same time, because a hanging one uses its whole deadline.
  std::vector<CameraFound> found(devices.size());
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    threads.emplace_back([&found, &devices, i] { found[i] = look_at(devices[i]); });
  }
  for (std::thread& thread : threads) thread.join();
  // A serial number that several devices share isn't an identity.
  const std::vector<CameraFound> all = found;
  for (CameraFound& camera : found) {
    const auto same =
        std::count_if(all.begin(), all.end(), [&](const CameraFound& o) { return o.id == camera.id; });
    if (same < 2) continue;
    camera.notes.push_back("another one has the same serial number, " + camera.id);
    camera.id = camera.address;
  }
  return found;
}

Result<std::unique_ptr<Camera>> open(const std::string& id, const CameraRequest& request) {
  auto camera = ChdkCamera::open([id] { return connect_ptp(id); }, request, std::make_shared<SteadyClock>());
  if (!camera.ok()) return camera.error();
  return std::unique_ptr<Camera>(std::move(*camera));
}

}  // namespace

CameraDriver ptp_driver() { return {"ptp", find, open}; }

}  // namespace emberlock::drivers
