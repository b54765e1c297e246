// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/viewer_messages.h"

#include <utility>

#include "daemon/server/feeds.h"

namespace emberlock::daemon {
namespace {

ViewerMessages::Shared shared(WatchMessage message) {
  return std::make_shared<const WatchMessage>(std::move(message));
}

}  // namespace

ViewerMessages::Shared ViewerMessages::of(const std::shared_ptr<const v1::DaemonStatus>& status) {
  if (status_.of != status) status_ = {status, shared(watch_message(without_history(*status)))};
  return status_.made;
}

ViewerMessages::Shared ViewerMessages::history_of(const std::shared_ptr<const v1::DaemonStatus>& status) {
  if (history_.of != status) history_ = {status, shared(history_message(*status))};
  return history_.made;
}

ViewerMessages::Shared ViewerMessages::of(const std::shared_ptr<const v1::Picture>& picture) {
  auto& last = pictures_[picture->camera_id()];
  if (last.of != picture) last = {picture, shared(watch_message(*picture))};
  return last.made;
}

std::vector<ViewerMessages::Shared> ViewerMessages::of(
    const std::shared_ptr<const v1::IterationPreview>& preview) {
  if (iteration_.of != preview) {
    iteration_ = {preview, {}};
    for (WatchMessage& message : watch_messages(*preview))
      iteration_.made.push_back(shared(std::move(message)));
  }
  return iteration_.made;
}

}  // namespace emberlock::daemon
