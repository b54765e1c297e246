// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/pictures.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <opencv2/imgproc.hpp>
#include <turbojpeg.h>

#include "base/clock.h"
#include "base/log.h"

namespace emberlock::daemon {
namespace {

constexpr double kEarly = 0.2;  // periods by which a frame may be early, because cameras jitter

/// Each 2 x 2 cell of a mosaic becomes a pixel: half the size, without interpolated colours.
template <class Sample>
cv::Mat half_of_mosaic(const ImageView& mosaic) {
  cv::Mat colour(mosaic.height() / 2, mosaic.width() / 2, CV_MAKETYPE(cv::DataType<Sample>::depth, 3));
  for (int y = 0; y < colour.rows; ++y) {
    const auto* const upper = mosaic.row_as<Sample>(2 * y);      // R G
    const auto* const lower = mosaic.row_as<Sample>(2 * y + 1);  // G B
    auto* pixel = colour.ptr<Sample>(y);
    for (int x = 0; x < 2 * colour.cols; x += 2, pixel += 3) {
      pixel[0] = upper[x];
      pixel[1] = static_cast<Sample>((upper[x + 1] + lower[x]) / 2);
      pixel[2] = lower[x + 1];
    }
  }
  return colour;
}

cv::Mat pixels_of(const ImageView& image) {
  const bool deep = bytes_per_sample(image.layout.format) == 2;
  if (is_bayer(image.layout.format))
    return deep ? half_of_mosaic<std::uint16_t>(image) : half_of_mosaic<std::uint8_t>(image);
  // OpenCV doesn't write to it.
  auto* const bytes = const_cast<std::byte*>(image.data);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  return {image.height(), image.width(), CV_MAKETYPE(deep ? CV_16U : CV_8U, channels(image.layout.format)),
          bytes, image.stride};
}

Result<std::string> encode(const cv::Mat& pixels, int quality) {
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool grey = pixels.channels() == 1;
  const bool done =
      encoder && tjCompress2(encoder.get(), pixels.data, pixels.cols, static_cast<int>(pixels.step[0]),
                             pixels.rows, grey ? TJPF_GRAY : TJPF_RGB, &bytes, &size,
                             grey ? TJSAMP_GRAY : TJSAMP_420, quality, TJFLAG_FASTDCT) == 0;
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owned(bytes, tjFree);
  if (!done) return Error{ErrorKind::io, tjGetErrorStr2(encoder.get()), "JPEG", "is memory short?"};
  return std::string(reinterpret_cast<const char*>(bytes), size);
}

}  // namespace

ImageSize shown_size(const ImageLayout& layout, int width) {
  const int half = is_bayer(layout.format) ? 2 : 1;
  const ImageSize own{layout.size.width / half, layout.size.height / half};
  if (own.width <= width) return own;
  const double scale = static_cast<double>(width) / own.width;
  return {std::max(1, width), std::max(1, static_cast<int>(std::lround(own.height * scale)))};
}

namespace {

/// Of eight bits, in the size that is shown.
Result<cv::Mat> small_pixels(const std::string& camera_id, const Frame& frame, ImageSize shown) {
  const ImageView image = frame.image->view();
  if (image.width() < 2 || image.height() < 2 || shown.width < 1 || shown.height < 1)
    return Error{ErrorKind::bad_input, "no pixels to show", camera_id, "is its format right?"};
  cv::Mat pixels = pixels_of(image);
  const cv::Size size(shown.width, shown.height);
  if (size != pixels.size()) cv::resize(pixels, pixels, size, 0, 0, cv::INTER_AREA);
  if (pixels.depth() != CV_8U) pixels.convertTo(pixels, CV_8U, 255.0 / image.layout.white());
  return pixels;
}

}  // namespace

Result<Image> small_rgb8(const std::string& camera_id, const Frame& frame, ImageSize size) {
  EMBERLOCK_ASSIGN_OR_RETURN(cv::Mat pixels, small_pixels(camera_id, frame, size));
  Image image(ImageLayout{size, PixelFormat::rgb8, 8});
  cv::Mat target(size.height, size.width, CV_8UC3, image.bytes().data());
  if (pixels.channels() == 1)
    cv::cvtColor(pixels, target, cv::COLOR_GRAY2RGB);
  else
    pixels.copyTo(target);
  return image;
}

Result<v1::Picture> make_picture(const std::string& camera_id, const Frame& frame,
                                 const PicturesOptions& options) {
  const ImageSize size = shown_size(frame.image->layout(), options.width);
  EMBERLOCK_ASSIGN_OR_RETURN(const cv::Mat pixels, small_pixels(camera_id, frame, size));
  EMBERLOCK_ASSIGN_OR_RETURN(std::string jpeg, encode(pixels, options.quality));
  v1::Picture picture;
  picture.set_camera_id(camera_id);
  picture.set_frame_id(frame.stamp.frame_id);
  picture.set_monotonic_ns(frame.stamp.monotonic_time.ns);
  picture.set_width(static_cast<std::uint32_t>(size.width));
  picture.set_height(static_cast<std::uint32_t>(size.height));
  picture.set_jpeg(std::move(jpeg));
  return picture;
}

Pictures::Pictures(Board& board, PicturesOptions options)
    : board_(board),
      options_(options),
      apart_(period(std::min(options.rate, kFastest))),
      thread_([this] { make(); }) {}

Pictures::~Pictures() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Pictures::offer(const std::string& camera_id, const Frame& frame) {
  if (!frame.image || !board_.pictures_wanted()) return;
  {
    const std::lock_guard lock(mutex_);
    Camera& camera = cameras_[camera_id];
    if (SteadyClock().now() < camera.due - kEarly * apart_) return;
    camera.newest = frame;
  }
  changed_.notify_one();
}

/// The camera whose picture has been due for longest; null if none has a new frame.
Pictures::Camera* Pictures::next(TimePoint now, std::string& id) {
  Camera* longest = nullptr;
  for (auto& [camera_id, camera] : cameras_) {
    if (!camera.newest.image || (longest != nullptr && longest->due <= camera.due)) continue;
    longest = &camera;
    id = camera_id;
  }
  if (longest != nullptr) longest->due = std::max(longest->due + apart_, now + (1 - kEarly) * apart_);
  return longest;
}

void Pictures::make() {
  std::unique_lock lock(mutex_);
  while (true) {
    std::string id;
    Camera* camera = nullptr;
    changed_.wait(lock, [&] { return ending_ || (camera = next(SteadyClock().now(), id)) != nullptr; });
    if (ending_) return;
    const Frame frame = std::exchange(camera->newest, {});
    lock.unlock();
    if (auto picture = make_picture(id, frame, options_))
      board_.show(std::make_shared<const v1::Picture>(std::move(picture).value()));
    else
      log(LogCategory::daemon).debug("no picture: {}", picture.error().message());
    lock.lock();
  }
}

}  // namespace emberlock::daemon
