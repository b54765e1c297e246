// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/connection.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "base/clock.h"
#include "drivers/ptp/chdk.h"

namespace emberlock::drivers {
namespace {

constexpr Seconds kSearchDeadline{2};

std::string fit_for_a_folder(std::string text) {
  constexpr std::string_view kAllowed = " ._:-";
  for (char& c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && kAllowed.find(c) == std::string_view::npos)
      c = '_';
  }
  return text;
}

bool is_blank(const std::string& serial) {
  return std::all_of(serial.begin(), serial.end(), [](char c) { return c == '0' || c == ' '; });
}

/// The ids of devices that were connected before, since a held device can't be queried. A device gets a new
/// bus address each time it is plugged in.
class KnownIds {
 public:
  void remember(const UsbPtpDevice& usb, const std::string& id) {
    const std::lock_guard lock(mutex_);
    ids_[key(usb)] = id;
  }
  std::optional<std::string> of(const UsbPtpDevice& usb) const {
    const std::lock_guard lock(mutex_);
    const auto found = ids_.find(key(usb));
    return found == ids_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  static std::pair<std::string, int> key(const UsbPtpDevice& usb) { return {usb.path, usb.number}; }
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, int>, std::string> ids_;
};

KnownIds& known_ids() {
  static KnownIds ids;
  return ids;
}

}  // namespace

std::string ptp_id(const UsbPtpDevice& usb) {
  if (auto known = known_ids().of(usb)) return *std::move(known);
  return ptp_id(usb, {});
}

std::string ptp_id(const UsbPtpDevice& usb, const std::string& ptp_serial) {
  for (const std::string* serial : {&ptp_serial, &usb.serial}) {
    if (!is_blank(*serial)) return fit_for_a_folder(*serial);
  }
  return usb.path;
}

bool may_run_chdk(const PtpConnection& connection) {
  return connection.usb.vendor == kCanonUsbVendor && connection.info.has(kChdkOperation);
}

Result<PtpConnection> connect_ptp(const UsbPtpDevice& usb) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::unique_ptr<PtpTransport> transport, open_usb_ptp(usb));
  PtpConnection connection{usb, {}, {}, nullptr};
  connection.session =
      std::make_unique<PtpSession>(std::move(transport), usb.path, std::make_shared<SteadyClock>());
  EMBERLOCK_RETURN_IF_ERROR(connection.session->open());
  EMBERLOCK_ASSIGN_OR_RETURN(connection.info, connection.session->device_info());
  connection.id = ptp_id(usb, connection.info.serial);
  known_ids().remember(usb, connection.id);
  connection.session->rename("camera " + connection.id);
  return connection;
}

Result<PtpConnection> connect_ptp(const std::string& id) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::vector<UsbPtpDevice> devices, list_usb_ptp());
  // Likely devices first. Devices known to have another id are left alone.
  const auto looks_like_it = [&](const UsbPtpDevice& d) { return ptp_id(d) == id || d.path == id; };
  std::erase_if(devices, [&](const UsbPtpDevice& d) { return known_ids().of(d) && !looks_like_it(d); });
  std::stable_partition(devices.begin(), devices.end(), looks_like_it);
  // One search at a time: concurrent ones would hold each other's cameras.
  static std::mutex searching;
  const std::lock_guard lock(searching);
  SteadyClock clock;
  const TimePoint until = clock.now() + kSearchDeadline;
  std::optional<Error> why;
  for (const UsbPtpDevice& device : devices) {
    if (clock.now() > until) break;
    auto connection = connect_ptp(device);
    if (connection.ok() && (connection->id == id || device.path == id)) {
      connection->id = id;
      return connection;
    }
    if (!connection.ok() && (looks_like_it(device) || !why)) why = connection.error();
  }
  if (why) return Error{ErrorKind::device, why->message(), "camera " + id};
  return Error{ErrorKind::device, "it isn't on the USB", "camera " + id, "plug it in and switch it on"};
}

}  // namespace emberlock::drivers
