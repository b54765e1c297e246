// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "drivers/driver.h"

// Cameras of a driver "v4l2" that a test plugs in and out, by their ids: 50 small frames a second while they
// are in, and nothing is wrong with them.
namespace emberlock::test {

/// What a camera that is plugged in does instead of filming.
enum class Ails {
  nothing,
  mute,   ///< no frame comes in time
  hangs,  ///< a call doesn't return
  ended,  ///< as a recording that is replayed
};

struct Sockets {
  std::mutex mutex;
  std::set<std::string> plugged;
  std::map<std::string, Ails> ailing;
};
inline Sockets& sockets() {
  static Sockets all;
  return all;
}
inline bool is_plugged(const std::string& id) {
  const std::lock_guard lock(sockets().mutex);
  return sockets().plugged.count(id) > 0;
}
inline void plug_in(const std::string& id) {
  const std::lock_guard lock(sockets().mutex);
  sockets().plugged.insert(id);
}
inline void unplug(const std::string& id) {
  const std::lock_guard lock(sockets().mutex);
  sockets().plugged.erase(id);
}

inline void ail(const std::string& id, Ails how) {
  const std::lock_guard lock(sockets().mutex);
  sockets().ailing[id] = how;
}
inline Ails ailing(const std::string& id) {
  const std::lock_guard lock(sockets().mutex);
  const auto found = sockets().ailing.find(id);
  return found == sockets().ailing.end() ? Ails::nothing : found->second;
}

class SocketCamera final : public drivers::Camera {
 public:
  explicit SocketCamera(std::string id) {
    info_.id = std::move(id);
    info_.model = "socket camera";
    info_.layout.size = {64, 48};
    info_.frame_rate = Hertz(50);  // its queue holds more than a second, which a busy machine may take
  }
  [[nodiscard]] const drivers::CameraInfo& info() const override { return info_; }
  [[nodiscard]] drivers::FrameCounts counts() const override { return counts_; }
  Status start() override {
    if (!is_plugged(info_.id)) return Error{ErrorKind::device, "it isn't there", info_.id, "plug it in"};
    return {};
  }
  void stop() override {}
  Result<Frame> next_frame(Seconds /*deadline*/) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    while (ailing(info_.id) == Ails::hangs) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (ailing(info_.id) == Ails::mute) return Error{ErrorKind::timed_out, "no frame", info_.id, "wait"};
    if (ailing(info_.id) == Ails::ended)
      return Error{ErrorKind::out_of_data, "the recording has ended", info_.id, {}};
    if (!is_plugged(info_.id)) return Error{ErrorKind::device, "it went away", info_.id, "plug it in"};
    Frame frame;
    frame.stamp.frame_id = counts_.delivered++;
    frame.stamp.monotonic_time = SteadyClock().now();
    frame.image = std::make_shared<Image>(info_.layout);
    return frame;
  }
  std::uint64_t pass_over(TimePoint /*until*/) override { return 0; }
  Status reset_shutter(TimePoint /*at*/) override {
    return Error{ErrorKind::device, "it can't", info_.id, {}};
  }
  Status trim_rate(PartsPerMillion /*trim*/) override {
    return Error{ErrorKind::device, "it can't", info_.id, {}};
  }

 private:
  drivers::CameraInfo info_;
  drivers::FrameCounts counts_;
};

inline std::vector<drivers::CameraDriver> socket_drivers() {
  return {{"v4l2",
           [] { return Result<std::vector<drivers::CameraFound>>(std::vector<drivers::CameraFound>{}); },
           [](const std::string& id,
              const drivers::CameraRequest& /*request*/) -> Result<std::unique_ptr<drivers::Camera>> {
             if (!is_plugged(id))
               return Error{ErrorKind::device, "there is no such camera", id, "plug it in"};
             return std::unique_ptr<drivers::Camera>(std::make_unique<SocketCamera>(id));
           }}};
}

}  // namespace emberlock::test
