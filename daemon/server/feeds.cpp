// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/feeds.h"

#include <algorithm>
#include <utility>

namespace emberlock::daemon {

v1::DaemonStatus without_history(const v1::DaemonStatus& status) {
  v1::DaemonStatus brief = status;
  if (brief.has_alignment()) brief.mutable_alignment()->clear_history();
  return brief;
}

Next<v1::DaemonStatus> HistoryFeed::next(TimePoint /*now*/) {
  auto status = board_.status();
  const auto& history = status->alignment().history();
  Last last{.rounds = history.size()};
  if (!history.empty()) {
    const v1::RoundPoint& newest = *history.rbegin();
    last.round = newest.round();
    last.at_s = newest.at_s();
  }
  if (last == told_) return {};
  told_ = last;
  return {.message = std::move(status)};
}

Next<v1::DaemonStatus> StatusFeed::next(TimePoint now) {
  auto status = board_.status();
  if (revision_ == status->revision()) return {};
  if (revision_ && now < at_ + kApart) return {.again = at_ + kApart};
  revision_ = status->revision();
  at_ = now;
  return {.message = std::move(status)};
}

Next<v1::Notice> NoticeFeed::next(TimePoint /*now*/) {
  if (read_.empty()) {
    auto notices = board_.notices(after_);
    if (notices.empty()) return {};
    after_ = notices.back().id();
    read_.assign(std::make_move_iterator(notices.begin()), std::make_move_iterator(notices.end()));
  }
  auto notice = std::make_shared<const v1::Notice>(std::move(read_.front()));
  read_.pop_front();
  return {.message = std::move(notice)};
}

PictureFeed::PictureFeed(Board& board, const v1::WatchPicturesRequest& request)
    : board_(board),
      cameras_(request.camera_ids().begin(), request.camera_ids().end()),
      apart_(period(Hertz(request.rate_hz() > 0 ? request.rate_hz() : kRateHz))),
      wanted_(board.want_pictures()) {}

Next<v1::Picture> PictureFeed::next(TimePoint now) {
  Next<v1::Picture> next;
  TimePoint due;
  for (auto& [camera, picture] : board_.pictures()) {
    if (!cameras_.empty() && !cameras_.contains(camera)) continue;
    const Last& last = last_[camera];
    if (last.picture == picture) continue;
    if (const TimePoint earliest = last.due - kEarly * apart_; now < earliest) {
      next.again = std::min(next.again.value_or(earliest), earliest);
    } else if (!next.message || last.due < due) {
      due = last.due;
      next.message = picture;
    }
  }
  if (!next.message) return next;
  // The average rate is kept, but pictures missed in a pause aren't made up for.
  last_[next.message->camera_id()] = {next.message, std::max(due + apart_, now + (1 - kEarly) * apart_)};
  next.again.reset();
  return next;
}

Next<v1::IterationPreview> IterationFeed::next(TimePoint /*now*/) {
  const auto all = board_.iterations(0);
  if (all.empty()) return {};
  if (all.back()->reconstruction() != reconstruction_ || all.back()->frame() != frame_) {
    reconstruction_ = all.back()->reconstruction();
    frame_ = all.back()->frame();
    seen_ = 0;
  }
  if (seen_ >= all.size()) return {};
  return {.message = all[seen_++]};
}

}  // namespace emberlock::daemon
