// SPDX-License-Identifier: Apache-2.0
#include "apply/front_files.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/kind_of_file.h"
#include "recon/export/exr_file.h"
#include "session/media/import_scan.h"
#include "session/media/video_scan.h"

namespace emberlock::apply {
namespace {

namespace fs = std::filesystem;

/// 0..255: the mean of the channels, with the format's white at 255.
std::vector<std::uint8_t> shares(const Image& image) {
  const ImageView view = image.view();
  const int count = channels(view.layout.format);
  std::vector<std::uint8_t> mask;
  mask.reserve(static_cast<std::size_t>(view.width()) * static_cast<std::size_t>(view.height()));
  for (int y = 0; y < view.height(); ++y)
    for (int x = 0; x < view.width(); ++x) {
      int sum = 0;
      for (int c = 0; c < count; ++c) sum += view.sample(x, y, c);
      mask.push_back(static_cast<std::uint8_t>(
          std::lround(255.0 * sum / (static_cast<double>(count) * view.layout.white()))));
    }
  return mask;
}

}  // namespace

Result<FrontFiles::Pictures> FrontFiles::pictures_of(const fs::path& path, const char* option,
                                                     std::int64_t frames) {
  std::error_code ec;
  Pictures pictures;
  if (!fs::exists(path, ec))
    return Error{ErrorKind::bad_input, "isn't there", std::string(option) + ' ' + path.string(),
                 "Name a picture or a folder of pictures"};
  if (!fs::is_directory(path, ec)) {
    pictures.files = {path};
    if (lower_extension(path) == ".exr") return pictures;
    EMBERLOCK_ASSIGN_OR_RETURN(const session::VideoScan scan, session::scan_video(path));
    pictures.video = scan.frames() > 1;
    if (pictures.video && scan.frames() < frames)
      return Error{ErrorKind::bad_input,
                   fmt::format("has {} frames, and the video {}", scan.frames(), frames),
                   std::string(option) + ' ' + path.string(), "Give one of each of its frames"};
    return pictures;
  }
  for (const auto& entry : fs::directory_iterator(path, ec))
    if (entry.is_regular_file() && !entry.path().filename().string().starts_with('.'))
      pictures.files.push_back(entry.path());
  std::sort(pictures.files.begin(), pictures.files.end(), [](const fs::path& a, const fs::path& b) {
    return session::natural_less(a.filename().string(), b.filename().string());
  });
  if (static_cast<std::int64_t>(pictures.files.size()) < frames)
    return Error{ErrorKind::bad_input,
                 fmt::format("holds {} pictures, and the video has {} frames", pictures.files.size(), frames),
                 std::string(option) + ' ' + path.string(), "Give one of each of its frames"};
  return pictures;
}

Result<FrontFiles> FrontFiles::open(const Sources& sources, ImageSize size, std::int64_t frames) {
  FrontFiles front;
  front.sources_ = sources;
  front.size_ = size;
  front.frames_ = frames;
  if (sources.mask) {
    EMBERLOCK_ASSIGN_OR_RETURN(front.mask_, pictures_of(*sources.mask, "--mask", frames));
  }
  if (sources.depth) {
    EMBERLOCK_ASSIGN_OR_RETURN(front.depth_, pictures_of(*sources.depth, "--depth", frames));
    if (front.depth_.video)
      return Error{ErrorKind::bad_input, "is a video, which holds no metres",
                   "--depth " + sources.depth->string(), "Give pictures of 16 bits, or OpenEXR"};
  }
  return front;
}

Status FrontFiles::size_is_right(ImageSize size, const fs::path& file) const {
  if (size == size_) return {};
  return Error{ErrorKind::bad_input,
               fmt::format("has {} x {} pixels, and the video's frames {} x {}", size.width, size.height,
                           size_.width, size_.height),
               file.string(), "Give pictures of the frames' size"};
}

Result<Image> FrontFiles::mask_image() {
  if (!mask_.video)
    return session::read_image(mask_.files[mask_.files.size() == 1 ? 0 : static_cast<std::size_t>(at_)]);
  if (!video_) {
    EMBERLOCK_ASSIGN_OR_RETURN(video_,
                               session::FrameFile::open(mask_.files[0], session::Colours::brightness));
  }
  return video_->next();
}

Result<std::vector<float>> FrontFiles::depth_of(const fs::path& file) const {
  std::vector<float> metres;
  if (lower_extension(file) == ".exr") {
    EMBERLOCK_ASSIGN_OR_RETURN(recon::ExrValues read, recon::read_exr(file, {"Z", "Y", "R"}));
    EMBERLOCK_RETURN_IF_ERROR(size_is_right(read.size, file));
    metres = std::move(read.values);
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(const Image image, session::read_image(file));
    EMBERLOCK_RETURN_IF_ERROR(size_is_right(image.layout().size, file));
    if (image.layout().format != PixelFormat::gray16)
      return Error{ErrorKind::bad_input, "isn't grey of 16 bits", file.string(),
                   "Give depth in millimetres as a PNG of 16 bits, or OpenEXR in metres"};
    const ImageView view = image.view();
    metres.reserve(static_cast<std::size_t>(size_.width) * static_cast<std::size_t>(size_.height));
    for (int y = 0; y < size_.height; ++y)
      for (int x = 0; x < size_.width; ++x)
        metres.push_back(static_cast<float>(view.sample(x, y) * sources_.depth_unit.value()));
  }
  for (float& m : metres)
    if (!(m > 0) || !std::isfinite(m)) m = 0;
  return metres;
}

Result<InFront> FrontFiles::next() {
  const bool first = at_ == 0;
  if (sources_.mask && (first || mask_.video || mask_.files.size() > 1)) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Image image, mask_image());
    EMBERLOCK_RETURN_IF_ERROR(size_is_right(
        image.layout().size, mask_.files[mask_.files.size() == 1 ? 0 : static_cast<std::size_t>(at_)]));
    last_.mask = shares(image);
  }
  if (sources_.depth && (first || depth_.files.size() > 1)) {
    EMBERLOCK_ASSIGN_OR_RETURN(
        last_.depth, depth_of(depth_.files[depth_.files.size() == 1 ? 0 : static_cast<std::size_t>(at_)]));
  }
  ++at_;
  return last_;
}

Status FrontFiles::check() {
  if (!sources_.mask && !sources_.depth) return {};
  const std::int64_t count = mask_.video || mask_.files.size() > 1 || depth_.files.size() > 1 ? frames_ : 1;
  for (std::int64_t i = 0; i < count; ++i) {
    const Result<InFront> front = next();
    if (!front) return front.error();
  }
  video_.reset();
  at_ = 0;
  return {};
}

}  // namespace emberlock::apply
