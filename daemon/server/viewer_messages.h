// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/server/watch_messages.h"

namespace emberlock::daemon {

/// The latest messages, made once for all viewers. Not thread-safe.
class ViewerMessages {
 public:
  using Shared = std::shared_ptr<const WatchMessage>;

  Shared of(const std::shared_ptr<const v1::DaemonStatus>& status);
  Shared history_of(const std::shared_ptr<const v1::DaemonStatus>& status);
  Shared of(const std::shared_ptr<const v1::Picture>& picture);
  std::vector<Shared> of(const std::shared_ptr<const v1::IterationPreview>& preview);
  /// Call it when nobody watches, to free the memory.
  void forget() { *this = {}; }

 private:
  template <class Message, class Made>
  struct Last {
    std::shared_ptr<const Message> of;
    Made made;
  };
  Last<v1::DaemonStatus, Shared> status_, history_;
  std::map<std::string, Last<v1::Picture, Shared>> pictures_;
  Last<v1::IterationPreview, std::vector<Shared>> iteration_;
};

}  // namespace emberlock::daemon
