// SPDX-License-Identifier: Apache-2.0
#include "session/media/clip.h"

#include <utility>

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
  place_ = place;
  file_.reset();
  if (place >= frames()) return {};
  open_ = part_of(place);
  const ClipPart& part = parts_[open_];
  EMBERLOCK_ASSIGN_OR_RETURN(file_, FrameFile::open(part.path, colours_));
  const auto within = static_cast<std::size_t>(place - part.first);
  return within == 0 ? Status{} : file_->seek(part.scan.ticks[within]);
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
    if (image.error().kind != ErrorKind::out_of_data) return image.error();
    return damaged("the video ends before its time stamps do");
  }
  const auto ticks = file_->ticks();
  if (ticks && *ticks != parts_[part].scan.ticks[within])
    return damaged("a frame before this one doesn't decode");
  if (const ImageSize size = image->layout().size; size != parts_[part].scan.size)
    return size_changed(parts_[part].path.string(), static_cast<std::int64_t>(within), size,
                        parts_[part].scan.size);
  ++place_;
  return image;
}

}  // namespace emberlock::session
