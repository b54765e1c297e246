#include "drivers/ptp/connection.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <string_view>
#include <utility>

#include "base/clock.h"
#include "drivers/ptp/chdk.h"

namespace emberlock {
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

}  // namespace

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
  connection.session->rename("camera " + connection.id);
  return connection;
}

Result<PtpConnection> connect_ptp(const std::string& id) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::vector<UsbPtpDevice> devices, list_usb_ptp());
  // First those that look like it, so that others aren't disturbed.
  const auto looks_like_it = [&](const UsbPtpDevice& d) { return ptp_id(d, {}) == id || d.path == id; };
  std::stable_partition(devices.begin(), devices.end(), looks_like_it);
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

}  // namespace emberlock
