// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include <grpcpp/client_context.h>

#include "daemon/hosts/remote_host.h"
#include "drivers/camera.h"

namespace emberlock::daemon {

/// Another host's camera. Its frames come with stamps on this host's clock; the host sends fewer while it
/// records them (hosts.proto), and those that it didn't send count as passed over. Losses are the camera's
/// own. A reset is ordered at once, and must arrive before its instant: use it on a CameraThread with
/// `reset_ahead`.
class RemoteCamera final : public drivers::Camera {
 public:
  RemoteCamera(std::shared_ptr<RemoteHost> host, drivers::CameraInfo expected);
  ~RemoteCamera() override;

  [[nodiscard]] const drivers::CameraInfo& info() const override { return info_; }
  [[nodiscard]] drivers::FrameCounts counts() const override;
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override;
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;

 private:
  static constexpr std::size_t kQueued = 16;
  static constexpr Seconds kSilence{5};  ///< after which it counts as lost, or three frames' time
  void take(const v1::LentFrame& lent);
  /// Requires the lock.
  void count(const drivers::FrameCounts& now, bool damaged);
  [[nodiscard]] Error away() const;

  const std::shared_ptr<RemoteHost> host_;
  drivers::CameraInfo info_;
  std::optional<grpc::ClientContext> call_;
  std::thread thread_;

  mutable std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Frame> frames_;
  TimePoint last_;               ///< when a frame came, or the stream began
  TimePoint wanted_from_;        ///< earlier frames show the phase before a reset
  std::optional<Status> ended_;  ///< the stream's end; absent while it runs
  drivers::FrameCounts counts_;
  std::optional<drivers::FrameCounts> told_;  ///< the host's counts, as they came last
};

}  // namespace emberlock::daemon
