// SPDX-License-Identifier: Apache-2.0
#include "films/clip_reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "base/in_parallel.h"
#include "session/media/frame_file.h"
#include "session/media/sound.h"
#include "smear_sync/detect/film.h"
#include "smear_sync/detect/follow.h"

namespace emberlock::films {
namespace {

constexpr std::size_t kMostStrips = 10;
constexpr int kHalfWidth = 64;  // columns of a strip on each side of the lamp

Image columns_of(const ImageView& frame, int first, int count) {
  ImageLayout layout = frame.layout;
  layout.size.width = count;
  Image out(layout);
  const auto pixel = static_cast<std::size_t>(bytes_per_pixel(layout.format));
  for (int y = 0; y < frame.height(); ++y) {
    std::memcpy(out.row_as<std::byte>(y), frame.row(y) + pixel * static_cast<std::size_t>(first),
                layout.row_bytes());
  }
  return out;
}

ClipStrip cut_strip(const ImageView& frame, const smear::SmearReading& reading, int number) {
  const int width = std::min(2 * kHalfWidth, frame.width());
  const int centre = reading.lamp ? static_cast<int>(std::lround(reading.lamp->x)) : frame.width() / 2;
  const int even = ~1;  // keeps the phase of a Bayer mosaic
  const int left = std::clamp(centre - width / 2, 0, frame.width() - width) & even;
  ClipStrip strip{number, columns_of(frame, left, width), reading};
  if (strip.reading.lamp) strip.reading.lamp->x -= left;
  for (smear::DotReading& dot : strip.reading.dots) dot.x -= left;
  return strip;
}

/// Keeps every `stride`th frame that shows a dot. When there are too many, every other one is dropped and the
/// stride doubles.
class StripKeeper {
 public:
  void see(const ImageView& frame, const smear::SmearReading& reading, int number) {
    const bool shows = reading.state == smear::SmearState::dot || reading.state == smear::SmearState::comb;
    if (!shows) {
      if (reading.lamp && !lamp_alone_) lamp_alone_ = cut_strip(frame, reading, number);
      return;
    }
    if (shown_++ % stride_ != 0) return;
    strips_.push_back(cut_strip(frame, reading, number));
    if (strips_.size() <= kMostStrips) return;
    std::vector<ClipStrip> kept;
    for (std::size_t i = 0; i < strips_.size(); i += 2) kept.push_back(std::move(strips_[i]));
    strips_ = std::move(kept);
    stride_ *= 2;
  }
  /// If no frame shows a dot, one frame with the lamp.
  std::vector<ClipStrip> take() {
    if (strips_.empty() && lamp_alone_) strips_.push_back(std::move(*lamp_alone_));
    return std::move(strips_);
  }

 private:
  std::vector<ClipStrip> strips_;
  std::optional<ClipStrip> lamp_alone_;
  std::size_t shown_ = 0;
  std::size_t stride_ = 1;
};

using Advanced = std::function<void(double fraction)>;

Result<FilmedClip> read_clip(const std::string& file, const Advanced& advanced) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::unique_ptr<session::FrameFile> video,
                             session::FrameFile::open(file, session::Colours::brightness));
  const session::VideoClaims claims = video->claims();
  if (!claims.frames && !claims.frame_rate) {
    return Error{ErrorKind::bad_input, "is a single picture, not a video", file,
                 "give the video as the camera wrote it"};
  }
  FilmedClip clip;
  clip.reading.file = file;
  clip.reading.claimed_rate = claims.frame_rate;
  StripKeeper keeper;
  smear::FollowingDetector detector;
  for (int number = 0;; ++number) {
    const Result<Image> image = video->next();
    if (!image.ok()) {
      if (image.error().kind != ErrorKind::out_of_data) return image.error();
      break;
    }
    clip.reading.rows = image->layout().size.height;
    smear::SmearReading reading = detector.read(image->view());
    keeper.see(image->view(), reading, number);
    clip.reading.frames.push_back(std::move(reading));
    if (claims.frames.value_or(0) > 0)
      advanced(std::min(1.0, (number + 1.0) / static_cast<double>(*claims.frames)));
  }
  clip.reading.frames = smear::share_lamp(smear::settle(clip.reading.frames));
  clip.strips = keeper.take();
  if (video->pictures() == 0) {
    EMBERLOCK_ASSIGN_OR_RETURN(clip.sound, session::read_sound(file));
  }
  return clip;
}

/// Length of the common folder's name, including its last slash, so that names can be shortened.
std::size_t common_folder(const std::vector<std::string>& files) {
  std::size_t same = files.front().size();
  for (const std::string& file : files) {
    const auto [here, there] =
        std::mismatch(files.front().begin(), files.front().end(), file.begin(), file.end());
    same = std::min(same, static_cast<std::size_t>(here - files.front().begin()));
  }
  const std::size_t slash = same == 0 ? std::string::npos : files.front().rfind('/', same - 1);
  return slash == std::string::npos ? 0 : slash + 1;
}

}  // namespace

Result<std::vector<FilmedClip>> read_clips(const std::vector<std::string>& files, const Progress& progress) {
  std::vector<std::optional<Result<FilmedClip>>> read(files.size());
  const Observer observer = [&](double fraction, std::string_view file) {
    tell(progress, kNearlyDone * fraction, file);
    return true;
  };
  // A clip that can't be read doesn't keep the others from being read: all that are wrong are named.
  static_cast<void>(in_parallel(files.size(), observer, [&](std::size_t i, const Observer& part) -> Status {
    read[i] = read_clip(files[i], [&](double fraction) { part(fraction, files[i]); });
    return {};
  }));
  tell(progress, 1, "read");

  std::vector<FilmedClip> clips;
  std::optional<Error> error;
  const std::size_t folder = common_folder(files);
  for (auto& clip : read) {
    if (clip->ok()) {
      clips.push_back(std::move(*clip).value());
      clips.back().reading.name = clips.back().reading.file.substr(folder);
    } else if (!error) {
      error = clip->error();
    } else {
      error->remedy += "; and " + clip->error().message();
    }
  }
  if (error) return *error;
  return clips;
}

}  // namespace emberlock::films
