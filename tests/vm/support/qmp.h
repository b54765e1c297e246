// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdlib>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <unistd.h>

#include "base/result.h"
#include "base/unique_fd.h"

namespace emberlock {

/// QEMU's own monitor, as a test in the guest reaches it: plugs USB devices in and out.
class Qmp {
 public:
  static Result<Qmp> open() {
    Qmp qmp(UniqueFd(::open("/dev/virtio-ports/qmp", O_RDWR | O_CLOEXEC)));
    if (!qmp.port_)
      return Error{ErrorKind::io, "can't open the monitor's port", "/dev/virtio-ports/qmp",
                   "Run it by tests/vm/run."};
    // An answer to this after the first program's is an error, as the monitor takes commands by then: both
    // will do.
    (void)qmp.execute("qmp_capabilities");
    return qmp;
  }

  /// What the monitor returns; its error's words otherwise. Events are passed over.
  Result<nlohmann::json> execute(std::string_view command,
                                 const nlohmann::json& arguments = nlohmann::json::object()) {
    const std::string line = nlohmann::json{{"execute", command}, {"arguments", arguments}}.dump() + "\n";
    if (::write(port_.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
      return Error{ErrorKind::io, "can't write", "QEMU's monitor"};
    }
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (std::chrono::steady_clock::now() < deadline) {
      const auto end = pending_.find('\n');
      if (end == std::string::npos) {
        read_some();
        continue;
      }
      const auto answer = nlohmann::json::parse(pending_.substr(0, end));
      pending_.erase(0, end + 1);
      if (answer.contains("return")) return answer["return"];
      if (answer.contains("error")) {
        return Error{ErrorKind::bad_input, answer["error"]["desc"].get<std::string>(),
                     fmt::format("QEMU's {}", command)};
      }
    }
    return Error{ErrorKind::timed_out, fmt::format("no answer to {} in 10 s", command), "QEMU's monitor"};
  }

  /// QEMU's own MTP camera with the clips of /run/vm/mtp.
  Result<nlohmann::json> plug_mtp(std::string_view id) {
    return execute("device_add", {{"driver", "usb-mtp"},
                                  {"bus", "usb.0"},
                                  {"id", id},
                                  {"rootdir", in_share("mtp")},
                                  {"readonly", true}});
  }
  /// The CHDK camera, on a connection of its own to the responder: each plugging in begins anew.
  Result<nlohmann::json> plug_chdk(std::string_view id) {
    const nlohmann::json address = {{"type", "unix"}, {"data", {{"path", in_share("usbredir.sock")}}}};
    if (auto added =
            execute("chardev-add",
                    {{"id", fmt::format("{}_line", id)},
                     {"backend", {{"type", "socket"}, {"data", {{"addr", address}, {"server", false}}}}}});
        !added.ok()) {
      return added;
    }
    return execute(
        "device_add",
        {{"driver", "usb-redir"}, {"bus", "usb.0"}, {"id", id}, {"chardev", fmt::format("{}_line", id)}});
  }
  Result<nlohmann::json> unplug(std::string_view id) { return execute("device_del", {{"id", id}}); }

  /// What QEMU calls a file of the guest's /run/vm.
  static std::string in_share(std::string_view file) {
    const char* share = std::getenv("EMBERLOCK_VM_SHARE");
    return fmt::format("{}/{}", share != nullptr ? share : "", file);
  }

 private:
  explicit Qmp(UniqueFd port) : port_(std::move(port)) {}

  void read_some() {
    pollfd ready{port_.get(), POLLIN, 0};
    if (::poll(&ready, 1, 100) <= 0) return;
    char bytes[4096];
    const ssize_t n = ::read(port_.get(), bytes, sizeof bytes);
    if (n > 0) pending_.append(bytes, static_cast<std::size_t>(n));
  }

  UniqueFd port_;
  std::string pending_;
};

}  // namespace emberlock
