// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "tests/support/strobe_devices.h"

namespace emberlock::test {

enum class Trouble { none, silent, garbled, late };

/// Runs the simulation of a device at the gadget's end of the line, through unplugging too.
class FarEnd {
 public:
  explicit FarEnd(std::unique_ptr<StrobeDevice> device)
      : device_(std::move(device)), thread_([this] { run(); }) {}
  FarEnd(const FarEnd&) = delete;
  FarEnd& operator=(const FarEnd&) = delete;
  ~FarEnd() {
    stop_ = true;
    thread_.join();
  }

  void trouble(Trouble what) { trouble_ = what; }
  void replace(std::unique_ptr<StrobeDevice> device) {
    const std::lock_guard lock(mutex_);
    device_ = std::move(device);
  }

 private:
  void run() {
    while (!stop_) {
      const UniqueFd tty(::open("/dev/ttyGS0", O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
      if (!tty) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        continue;
      }
      termios raw{};
      ::tcgetattr(tty.get(), &raw);
      ::cfmakeraw(&raw);
      ::tcsetattr(tty.get(), TCSANOW, &raw);
      while (!stop_ && serve(tty.get())) {
      }
    }
  }
  /// False when the line is gone.
  bool serve(int tty) {
    pollfd ready{tty, POLLIN, 0};
    if (::poll(&ready, 1, 50) <= 0) return true;
    if ((ready.revents & (POLLHUP | POLLERR)) != 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      return false;
    }
    char bytes[512];
    const ssize_t count = ::read(tty, bytes, sizeof bytes);
    if (count <= 0) return false;
    const std::lock_guard lock(mutex_);
    std::string said = device_->take({bytes, static_cast<std::size_t>(count)});
    if (said.empty() || trouble_ == Trouble::silent) return true;
    if (trouble_ == Trouble::garbled) said = device_->noise() + said.back();
    if (trouble_ == Trouble::late) std::this_thread::sleep_for(std::chrono::milliseconds(600));
    return ::write(tty, said.data(), said.size()) == static_cast<ssize_t>(said.size());
  }

  std::mutex mutex_;
  std::unique_ptr<StrobeDevice> device_;
  std::atomic<Trouble> trouble_ = Trouble::none;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace emberlock::test
