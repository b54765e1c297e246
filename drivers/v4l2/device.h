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

/// An opened device node, and the buffers that the kernel fills, once there are any.
class V4l2Device {
 public:
  /// Errors: device (not there any more, or may not be opened).
  static Result<V4l2Device> open(const std::filesystem::path& node, const std::string& where);

  /// 0, or errno; begun again when a signal came.
  [[nodiscard]] int ioctl(unsigned long request, void* argument) const;
  /// What the pure parts ask by; valid as long as the device.
  [[nodiscard]] Ioctl as_ioctl() const;
  /// The error of a call that failed so; names who has it when it is busy.
  [[nodiscard]] Error refused(const std::string& what, int error) const;
  /// That a capture by mapped buffers can be had from it, and its card's name.
  [[nodiscard]] std::optional<std::string> camera_card() const;
  /// That the kernel's USB Video Class driver has it.
  [[nodiscard]] bool is_uvc() const;
  /// Whether somebody, maybe ourselves, has its buffers.
  [[nodiscard]] bool in_use() const;

  /// Asks for so many buffers, and takes it for ourselves thereby. The flags of their timestamps.
  Result<std::uint32_t> map_buffers(std::uint32_t count);
  [[nodiscard]] std::size_t buffers() const { return buffers_.size(); }

  Status stream_on();
  /// Takes every buffer back from the kernel; what was in them is gone.
  void stream_off();

  struct Filled {
    v4l2_buffer buffer;
    std::span<const std::byte> bytes;  ///< the whole buffer
  };
  /// The next filled buffer, if there is one; errno when the device is gone or broken.
  struct Taken {
    std::optional<Filled> filled;
    int error = 0;
  };
  Taken take();
  /// Hands it to the kernel again. One that is refused is offered again by wait().
  void queue(std::uint32_t index);
  /// Waits for a filled buffer, an error or the deadline.
  void wait(Seconds deadline);

 private:
  /// A buffer of the kernel's in our address space.
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
  std::vector<bool> ours_;  ///< which buffers the kernel doesn't have
};

}  // namespace emberlock::drivers
