// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "emberlock/v1/services.pb.h"

namespace emberlock::daemon {

/// The volumes of a sequence's frames, without pictures: as many as fit into so many bytes, the newest.
class KeptFrames {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{256}
                                            << 20;  ///< 64^3 voxels: about 970 volumes, 200 with all layers

  explicit KeptFrames(std::size_t most_bytes = kMostBytes) : most_bytes_(most_bytes) {}

  /// Forgets those of the one before.
  void begin(std::string reconstruction);
  void keep(v1::IterationPreview frame);
  /// Null: it isn't held.
  [[nodiscard]] std::shared_ptr<const v1::IterationPreview> find(const v1::FrameRequest& request) const;

 private:
  std::size_t most_bytes_;
  std::string reconstruction_;
  std::deque<std::shared_ptr<const v1::IterationPreview>> frames_;  ///< in the order in which they were done
  std::size_t bytes_ = 0;
};

}  // namespace emberlock::daemon
