// SPDX-License-Identifier: Apache-2.0
#include "cli/ar_film.h"

#include <algorithm>
#include <utility>

#include "recon/preprocess/radiance.h"
#include "session/media/video_scan.h"

namespace emberlock::cli {
namespace {

Image as_rgb8(Image image) {
  if (image.layout().format == PixelFormat::rgb8) return image;
  return recon::to_rgb8(recon::to_radiance(image.view()));
}

}  // namespace

Result<ArFilm> ArFilm::of_video(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const session::VideoScan scan, session::scan_video(path));
  ArFilm film;
  film.name_ = path.string();
  film.path_ = path;
  film.size_ = scan.size;
  film.display_ = scan.display;
  film.sound_ = scan.sound;
  for (const std::int64_t ticks : scan.ticks)
    film.times_.push_back(static_cast<double>(ticks - scan.ticks.front()) * scan.tick);
  EMBERLOCK_RETURN_IF_ERROR(film.rewind());
  return film;
}

ArFilm::ArFilm(std::string name, std::vector<Image> frames, std::vector<Seconds> times)
    : name_(std::move(name)), times_(std::move(times)), held_(std::move(frames)) {
  if (!held_.empty()) size_ = held_.front().layout().size;
  for (Image& frame : held_) frame = as_rgb8(std::move(frame));
}

Hertz ArFilm::rate() const {
  std::vector<double> apart;
  for (std::size_t i = 1; i < times_.size(); ++i) apart.push_back((times_[i] - times_[i - 1]).value());
  constexpr Hertz kUsual{24};
  if (apart.empty()) return kUsual;
  const auto middle = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 2);
  std::nth_element(apart.begin(), middle, apart.end());
  return *middle > 0 ? Hertz(1 / *middle) : kUsual;
}

Result<Image> ArFilm::next() {
  const auto ended = [&] { return Error{ErrorKind::out_of_data, "the film has ended", name_}; };
  if (!file_) {
    if (at_ >= held_.size()) return ended();
    return held_[at_++];
  }
  if (at_ >= times_.size()) return ended();
  EMBERLOCK_ASSIGN_OR_RETURN(Image image, file_->next());
  const ImageSize size = image.layout().size;
  if (size != size_) return session::size_changed(name_, static_cast<std::int64_t>(at_), size, size_);
  ++at_;
  return as_rgb8(std::move(image));
}

Status ArFilm::rewind() {
  at_ = 0;
  if (path_.empty()) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(file_, session::FrameFile::open(path_));
  return {};
}

}  // namespace emberlock::cli
