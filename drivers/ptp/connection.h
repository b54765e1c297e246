// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "drivers/ptp/container.h"
#include "drivers/ptp/session.h"
#include "drivers/ptp/usb_transport.h"

namespace emberlock::drivers {

/// A PTP device with an open session.
struct PtpConnection {
  UsbPtpDevice usb;
  PtpDeviceInfo info;
  std::string id;  ///< see CameraInfo::id
  std::unique_ptr<PtpSession> session;
};

/// Connects to the same camera at every call.
using PtpConnect = std::function<Result<PtpConnection>()>;

/// The id of a device: the serial number that it reports over PTP, else that in its USB descriptor, else its
/// USB path. Characters that are invalid in folder names are replaced by '_'.
std::string ptp_id(const UsbPtpDevice& usb, const std::string& ptp_serial);

/// The id without querying the device: as at the last connection, else from its USB descriptor.
std::string ptp_id(const UsbPtpDevice& usb);

/// Opens the device at its USB address within 1.5 s, or 3 s if it must be recovered first. Errors: as
/// open_usb_ptp and PtpSession::open.
Result<PtpConnection> connect_ptp(const UsbPtpDevice& usb);
/// Finds the device by its id and opens it. If necessary, other free devices are queried for their ids; no
/// query is started after 2 s.
Result<PtpConnection> connect_ptp(const std::string& id);

/// Whether CHDK's operation may be sent: for other makers, 0x9999 means something else.
bool may_run_chdk(const PtpConnection& connection);

}  // namespace emberlock::drivers
