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

/// A PTP device with its session open.
struct PtpConnection {
  UsbPtpDevice usb;
  PtpDeviceInfo info;
  std::string id;  ///< as CameraInfo::id
  std::unique_ptr<PtpSession> session;
};

/// Connects to one and the same camera, each time that it is called.
using PtpConnect = std::function<Result<PtpConnection>()>;

/// The serial number that a device gives over PTP, else the one in its USB descriptor, else its USB path;
/// with what a folder's name can't have replaced by '_'.
std::string ptp_id(const UsbPtpDevice& usb, const std::string& ptp_serial);

/// The id of a device that needn't be asked: as it was when it was connected to, else by its USB descriptor.
std::string ptp_id(const UsbPtpDevice& usb);

/// Opens the device at its place on the bus: within 1.5 s, 3 s where it must be recovered first. Errors: as
/// open_usb_ptp and PtpSession::open.
Result<PtpConnection> connect_ptp(const UsbPtpDevice& usb);
/// Finds the device by its id and opens it. Others that are free are asked for theirs if need be; none is
/// begun with after 2 s.
Result<PtpConnection> connect_ptp(const std::string& id);

/// Whether CHDK may be asked for: no other maker's 0x9999 means it.
bool may_run_chdk(const PtpConnection& connection);

}  // namespace emberlock::drivers
