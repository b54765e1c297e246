// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/kept_frames.h"

#include <algorithm>
#include <utility>

namespace emberlock::daemon {
namespace {

std::size_t bytes_of(const v1::IterationPreview& frame) {
  std::size_t bytes = frame.volume().voxels().size();
  for (const v1::VolumeLayer& layer : frame.volume().layers()) bytes += layer.voxels().size();
  return bytes;
}

}  // namespace

void KeptFrames::begin(std::string reconstruction) {
  reconstruction_ = std::move(reconstruction);
  frames_.clear();
  bytes_ = 0;
}

void KeptFrames::keep(v1::IterationPreview frame) {
  frame.clear_captured_jpeg();
  frame.clear_rendered_jpeg();
  bytes_ += bytes_of(frame);
  frames_.push_back(std::make_shared<const v1::IterationPreview>(std::move(frame)));
  for (; bytes_ > most_bytes_; frames_.pop_front()) bytes_ -= bytes_of(*frames_.front());
}

std::shared_ptr<const v1::IterationPreview> KeptFrames::find(const v1::FrameRequest& request) const {
  if (request.reconstruction() != reconstruction_) return nullptr;
  const auto found = std::find_if(frames_.begin(), frames_.end(),
                                  [&](const auto& kept) { return kept->frame() == request.frame(); });
  return found == frames_.end() ? nullptr : *found;
}

}  // namespace emberlock::daemon
