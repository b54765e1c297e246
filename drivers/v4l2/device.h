// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/unique_fd.h"
#include "drivers/v4l2/modes.h"

namespace emberlock::drivers {

/// An opened device node, and the buffers that the kernel fills.
class V4l2Device {
 public:
  /// Errors: device (gone, or permission denied).
  static Result<V4l2Device> open(const std::filesystem::path& node, const std::string& where);

  /// Returns 0 or errno; repeated when interrupted by a signal.
  [[nodiscard]] int ioctl(unsigned long request, void* argument) const;
  /// The ioctl function for the pure parts; valid as long as this device.
  [[nodiscard]] Ioctl as_ioctl() const;
  /// The error of a failed call; names the holder when the device is busy.
  [[nodiscard]] Error refused(const std::string& what, int error) const;
  /// The card's name, if the device can capture with mapped buffers.
  [[nodiscard]] std::optional<std::string> camera_card() const;
  /// Whether the kernel's USB Video Class driver drives it.
  [[nodiscard]] bool is_uvc() const;
  /// Whether anybody, perhaps this process, has its buffers.
  [[nodiscard]] bool in_use() const;

  /// Requests and maps buffers, which makes this process the owner. Returns the flags of their time stamps.
  Result<std::uint32_t> map_buffers(std::uint32_t count);
  [[nodiscard]] std::size_t buffers() const { return buffers_.size(); }

  Status stream_on();
  /// Takes all buffers back from the kernel; their content is lost.
  void stream_off();

  struct Filled {
    v4l2_buffer buffer;
    std::span<const std::byte> bytes;  ///< the whole buffer
  };
  /// The next filled buffer, if there is one; or errno when the device is gone or broken.
  struct Taken {
    std::optional<Filled> filled;
    int error = 0;
  };
  Taken take();
  /// Queues a buffer in the kernel again. If the kernel refuses, wait() tries again.
  void queue(std::uint32_t index);
  /// Waits for a filled buffer, an error or the deadline.
  void wait(Seconds deadline);

 private:
  /// A mapped kernel buffer.
  class Mapped {
   public:
    explicit Mapped(std::span<std::byte> bytes) : bytes_(bytes) {}
    Mapped(Mapped&& o) noexcept : bytes_(std::exchange(o.bytes_, {})) {}
    Mapped& operator=(Mapped&& o) noexcept { return std::swap(bytes_, o.bytes_), *this; }
    Mapped(const Mapped&) = delete;
    Mapped& operator=(const Mapped&) = delete;
    ~Mapped();
    [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

   private:
    std::span<std::byte> bytes_;
  };
  V4l2Device(UniqueFd fd, std::filesystem::path node, std::string where);

  UniqueFd fd_;
  std::filesystem::path node_;
  std::string where_;
  std::vector<Mapped> buffers_;
  std::vector<bool> ours_;  ///< buffers that aren't queued in the kernel
};

}  // namespace emberlock::drivers
