// SPDX-License-Identifier: Apache-2.0
#include "session/media/clip.h"

#include <utility>

#include <fmt/format.h>

namespace emberlock::session {

ClipReader::ClipReader(std::vector<ClipPart> parts, Colours colours)
    : parts_(std::move(parts)), colours_(colours) {}

std::int64_t ClipReader::frames() const { return parts_.back().first + parts_.back().scan.frames(); }

std::size_t ClipReader::part_of(std::int64_t place) const {
  std::size_t part = 0;
  while (part + 1 < parts_.size() && parts_[part + 1].first <= place) ++part;
  return part;
}

Status ClipReader::seek(std::int64_t place) {
  const std::int64_t from = place_;
  place_ = place;
  if (place >= frames()) {
    file_.reset();
    return {};
  }
  const std::size_t index = part_of(place);
  const ClipPart& part = parts_[index];
  std::int64_t ahead = place - from;
  const bool reads_on = file_ && index == open_ && part.scan.counted && from >= part.first && ahead >= 0;
  if (!reads_on) {
    EMBERLOCK_RETURN_IF_ERROR(open(index));
    ahead = place - part.first;
  }
  Status moved = part.scan.counted || ahead == 0
                     ? file_->skip(ahead)
                     : file_->seek(part.scan.ticks[static_cast<std::size_t>(ahead)]);
  if (!moved.ok()) file_.reset();  // it isn't at `place_`
  return moved;
}

Status ClipReader::open(std::size_t index) {
  const ClipPart& part = parts_[index];
  open_ = index;
  EMBERLOCK_ASSIGN_OR_RETURN(file_, FrameFile::open(part.path, colours_));
  if (file_->pictures() > part.scan.frames()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("holds {} pictures, where {} are expected as in the camera's first file",
                             file_->pictures(), part.scan.frames()),
                 part.path.string(), "Split it into one file for each picture"};
  }
  if (file_->unapplied() != part.scan.unapplied) return orientation_changed(part.path);
  return {};
}

Result<Image> ClipReader::next() {
  if (place_ >= frames()) {
    return Error{ErrorKind::out_of_data, "the film has ended", parts_.back().path.string()};
  }
  const std::size_t part = part_of(place_);
  if (!file_ || part != open_) EMBERLOCK_RETURN_IF_ERROR(seek(place_));
  const auto within = static_cast<std::size_t>(place_ - parts_[part].first);
  const auto damaged = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, what, parts_[part].path.string() + ", frame " + std::to_string(within),
                 "Copy or record it again"};
  };
  Result<Image> image = file_->next();
  if (!image) {
    file_.reset();  // it is no longer at `place_`
    if (image.error().kind != ErrorKind::out_of_data) return image.error();
    return damaged("the video ends before its time stamps do");
  }
  const auto ticks = file_->ticks();
  if (ticks && !parts_[part].scan.counted && *ticks != parts_[part].scan.ticks[within])
    return damaged("a frame before this one doesn't decode");
  if (const ImageSize size = image->layout().size; size != parts_[part].scan.size)
    return size_changed(parts_[part].path.string(), static_cast<std::int64_t>(within), size,
                        parts_[part].scan.size);
  ++place_;
  return image;
}

}  // namespace emberlock::session
