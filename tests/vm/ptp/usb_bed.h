// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/unique_fd.h"
#include "drivers/ptp/chdk.h"
#include "drivers/ptp/connection.h"
#include "tests/support/wait.h"
#include "tests/vm/support/qmp.h"

namespace emberlock {

/// Cameras plugged into the guest and pulled out of it, by QEMU's monitor; and the CHDK camera's control line
/// (tests/support/chdk_responder/main.cpp).
class UsbBed : public testing::Test {
 protected:
  UsbBed() : qmp_(Qmp::open()), control_(::open("/dev/virtio-ports/chdk", O_RDWR | O_CLOEXEC)) {
    EXPECT_TRUE(qmp_.ok()) << qmp_.error().message();
    EXPECT_TRUE(control_)
        << "/dev/virtio-ports/chdk is missing: chdk_responder isn't built beside this program";
    if (control_) tell("well");
  }
  ~UsbBed() override {
    if (control_) tell("well");
    if (chdk_plugged_) unplug_chdk();
    if (mtp_plugged_) unplug_mtp();
  }

  void plug_chdk() {
    const auto plugged = qmp_->plug_chdk("chdk");
    ASSERT_TRUE(plugged.ok()) << plugged.error().message();
    chdk_plugged_ = true;
  }
  void unplug_chdk() {
    const auto pulled = qmp_->unplug("chdk");
    EXPECT_TRUE(pulled.ok()) << pulled.error().message();
    chdk_plugged_ = false;
  }
  void plug_mtp() {
    const auto plugged = qmp_->plug_mtp("mtp");
    ASSERT_TRUE(plugged.ok()) << plugged.error().message();
    mtp_plugged_ = true;
  }
  void unplug_mtp() {
    EXPECT_TRUE(qmp_->unplug("mtp").ok());
    mtp_plugged_ = false;
  }

  /// Gives the CHDK camera an order; its answer without the "ok".
  std::string tell(std::string_view order) {
    const std::string line = fmt::format("{}\n", order);
    EXPECT_EQ(::write(control_.get(), line.data(), line.size()), static_cast<ssize_t>(line.size()));
    std::string answer;
    while (answer.find('\n') == std::string::npos) {
      pollfd ready{control_.get(), POLLIN, 0};
      if (::poll(&ready, 1, 5000) <= 0) break;
      std::array<char, 256> bytes{};
      const ssize_t n = ::read(control_.get(), bytes.data(), bytes.size());
      if (n <= 0) break;
      answer.append(bytes.data(), static_cast<std::size_t>(n));
    }
    EXPECT_EQ(answer.substr(0, 2), "ok") << order << ": " << answer;
    return answer.size() > 3 ? answer.substr(3, answer.size() - 4) : "";
  }

  /// The device of that maker, once it is on the bus.
  Result<drivers::PtpConnection> connect(bool canon) {
    Result<drivers::PtpConnection> connection = Error{ErrorKind::timed_out, "it doesn't appear on the bus"};
    test::wait_until([&] {
      const auto devices = drivers::list_usb_ptp();
      if (!devices.ok()) return false;
      for (const drivers::UsbPtpDevice& device : *devices) {
        if ((device.vendor == drivers::kCanonUsbVendor) != canon) continue;
        connection = drivers::connect_ptp(device);
        return connection.ok();
      }
      return false;
    });
    return connection;
  }

  Result<Qmp> qmp_;
  UniqueFd control_;
  SteadyClock clock_;
  bool chdk_plugged_ = false;
  bool mtp_plugged_ = false;
};

}  // namespace emberlock
