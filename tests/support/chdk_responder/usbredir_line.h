// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include <usbredirparser.h>

#include "base/clock.h"
#include "base/unique_fd.h"
#include "tests/support/chdk_responder/chdk_device.h"

namespace emberlock::chdk_responder {

/// A Device on the end of a usbredir connection: a USB device of the still image class in QEMU's guest. The
/// socket must not block: QEMU's reader would turn in circles.
class UsbredirLine {
 public:
  UsbredirLine(UniqueFd socket, Device& device, Clock& clock);
  UsbredirLine(const UsbredirLine&) = delete;
  UsbredirLine& operator=(const UsbredirLine&) = delete;

  [[nodiscard]] int socket() const { return socket_.get(); }
  [[nodiscard]] bool wants_to_write() const { return usbredirparser_has_data_to_write(parser_.get()) > 0; }
  /// When the device has something for a question that waits.
  [[nodiscard]] std::optional<TimePoint> next_answer() const;
  /// Reads, answers and writes what can be without waiting. False: the line is gone.
  bool serve();

  void plug();
  void unplug();

 private:
  struct Waiting {
    std::uint64_t id;
    usb_redir_bulk_packet_header header;
  };
  struct Destroy {
    void operator()(usbredirparser* parser) const { usbredirparser_destroy(parser); }
  };

  void set_callbacks();
  void answer_control(std::uint64_t id, usb_redir_control_packet_header header);
  std::vector<std::uint8_t> control(const usb_redir_control_packet_header& header, int& status);
  void answer_bulk(std::uint64_t id, usb_redir_bulk_packet_header header, std::span<const std::byte> data);
  void reply_bulk(const Waiting& to, int status, std::span<const std::byte> data);
  void cancel(std::uint64_t id);
  void answer_waiting();

  UniqueFd socket_;
  Device& device_;
  Clock& clock_;
  std::unique_ptr<usbredirparser, Destroy> parser_;
  std::deque<Waiting> waiting_;
  bool halted_ = false;
  bool gone_ = false;
};

}  // namespace emberlock::chdk_responder
