// SPDX-License-Identifier: Apache-2.0
#include "daemon/board.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

#include "base/clock.h"

namespace emberlock::daemon {
namespace {

bool has_pictures(const v1::IterationPreview& preview) {
  return preview.has_volume() || !preview.captured_jpeg().empty() || !preview.rendered_jpeg().empty();
}

bool is_of_same(const v1::IterationPreview& a, const v1::IterationPreview& b) {
  return a.reconstruction() == b.reconstruction() && a.frame() == b.frame();
}

/// What is told inside is clauses, that others build on; what people are shown begins and ends as a sentence.
/// A first word that isn't one, as "virtual-02" and "raw:", stays as it is.
std::string sentence(std::string text) {
  const auto word = std::find(text.begin(), text.end(), ' ');
  const auto in_words = [](unsigned char c) { return std::islower(c) != 0 || c == '\'' || c == ','; };
  if (word != text.begin() && std::all_of(text.begin(), word, in_words))
    text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  if (!text.empty() && std::string_view(".!?").find(text.back()) == std::string_view::npos) text += '.';
  return text;
}

void write_sentences(v1::DaemonStatus& status) {
  const auto mend = [](std::string* text) { *text = sentence(std::move(*text)); };
  mend(status.mutable_reason());
  mend(status.mutable_next_step());
  for (v1::Fault& fault : *status.mutable_faults()) {
    mend(fault.mutable_what());
    mend(fault.mutable_remedy());
  }
  for (v1::CameraStatus& camera : *status.mutable_cameras()) mend(camera.mutable_reason());
  if (status.has_strobe()) mend(status.mutable_strobe()->mutable_reason());
  if (status.has_alignment()) mend(status.mutable_alignment()->mutable_reason());
  if (status.has_recording()) mend(status.mutable_recording()->mutable_verdict());
  if (status.has_live() && !status.live().reason().empty()) mend(status.mutable_live()->mutable_reason());
  if (!status.has_reconstruction()) return;
  mend(status.mutable_reconstruction()->mutable_error());
  for (v1::SequenceFrame& frame : *status.mutable_reconstruction()->mutable_frames())
    mend(frame.mutable_error());
}

}  // namespace

void Board::show(v1::DaemonStatus status) {
  write_sentences(status);
  {
    const std::lock_guard lock(mutex_);
    status.set_revision(++revision_);
    status_ = std::make_shared<const v1::DaemonStatus>(std::move(status));
  }
  tell(Topic::status);
}

std::shared_ptr<const v1::DaemonStatus> Board::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void Board::notice(v1::Light light, const std::string& text) {
  {
    v1::Notice notice;
    notice.set_light(light);
    notice.set_utc(utc_now());
    notice.set_text(sentence(text));
    const std::lock_guard lock(mutex_);
    notice.set_id(next_notice_++);
    notices_.push_back(std::move(notice));
    if (notices_.size() > kNotices) notices_.pop_front();
  }
  tell(Topic::notices);
}

std::vector<v1::Notice> Board::notices(std::uint64_t after) const {
  const std::lock_guard lock(mutex_);
  const auto first =
      std::find_if(notices_.begin(), notices_.end(), [&](const v1::Notice& n) { return n.id() > after; });
  return {first, notices_.end()};
}

void Board::show(std::shared_ptr<const v1::Picture> picture) {
  {
    const std::lock_guard lock(mutex_);
    if (picture_watchers_ == 0) return;
    pictures_[picture->camera_id()] = std::move(picture);
  }
  tell(Topic::pictures);
}

std::map<std::string, std::shared_ptr<const v1::Picture>> Board::pictures() const {
  const std::lock_guard lock(mutex_);
  return pictures_;
}

void Board::show(std::shared_ptr<const v1::IterationPreview> preview) {
  {
    const std::lock_guard lock(mutex_);
    if (!iterations_.empty()) {
      if (!is_of_same(*iterations_.back(), *preview)) {
        iterations_.clear();
      } else if (has_pictures(*preview)) {
        for (auto& earlier : iterations_) {
          if (!has_pictures(*earlier)) continue;
          v1::IterationPreview numbers = *earlier;
          numbers.clear_captured_jpeg();
          numbers.clear_rendered_jpeg();
          numbers.clear_volume();
          earlier = std::make_shared<const v1::IterationPreview>(std::move(numbers));
        }
      }
    }
    iterations_.push_back(std::move(preview));
  }
  tell(Topic::iterations);
}

std::vector<std::shared_ptr<const v1::IterationPreview>> Board::iterations(std::size_t from) const {
  const std::lock_guard lock(mutex_);
  const std::size_t first = std::min(from, iterations_.size());
  return {iterations_.begin() + static_cast<std::ptrdiff_t>(first), iterations_.end()};
}

Subscription Board::subscribe(std::function<void(Topic)> changed) {
  const std::lock_guard lock(telling_);
  const std::uint64_t key = next_subscriber_++;
  subscribers_[key] = std::move(changed);
  return Subscription([this, key] {
    const std::lock_guard ending(telling_);
    subscribers_.erase(key);
  });
}

Subscription Board::want_pictures() {
  const std::lock_guard lock(mutex_);
  ++picture_watchers_;
  return Subscription([this] {
    const std::lock_guard ending(mutex_);
    // Whoever comes later waits for a new one rather than to see the past.
    if (--picture_watchers_ == 0) pictures_.clear();
  });
}

bool Board::pictures_wanted() const {
  const std::lock_guard lock(mutex_);
  return picture_watchers_ > 0;
}

void Board::tell(Topic topic) {
  const std::lock_guard lock(telling_);
  for (const auto& [key, changed] : subscribers_) changed(topic);
}

}  // namespace emberlock::daemon
