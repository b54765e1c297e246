// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <sys/types.h>

namespace emberlock::testing_support {

/// Why there can be no fake cameras here, and what to do about it; empty when there can.
const std::string& why_no_bed();

/// Aravis' own fake GigE Vision camera, a process at 127.0.0.`host` in a network of this test program's own.
/// It sends Mono8 pictures of (x + y + its frame's number) mod 255, numbered from 65401 on, and writes down
/// what it sends. Killed when it is destroyed, or the test is.
class FakeCamera {
 public:
  /// `lost_per_thousand`: of the packets of a picture.
  FakeCamera(int host, std::string serial, int lost_per_thousand = 0);
  ~FakeCamera() { kill(); }
  FakeCamera(const FakeCamera&) = delete;
  FakeCamera& operator=(const FakeCamera&) = delete;

  [[nodiscard]] const std::string& serial() const { return serial_; }
  [[nodiscard]] std::string address() const { return "127.0.0." + std::to_string(host_); }

  void start();
  void kill();
  void freeze() const;  ///< neither sends nor answers, as a camera that hangs
  void thaw() const;

  /// Whether it has bound its control port.
  [[nodiscard]] bool listens() const;
  /// What it says that it sent since it was started last, in order; those of which it kept a packet back.
  struct Sent {
    std::vector<std::uint64_t> frames;
    std::set<std::uint64_t> incomplete;
  };
  [[nodiscard]] Sent sent() const;

 private:
  int host_;
  std::string serial_;
  int lost_per_thousand_;
  std::filesystem::path log_;
  pid_t pid_ = 0;
};

}  // namespace emberlock::testing_support
