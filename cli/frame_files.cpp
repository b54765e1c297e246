// SPDX-License-Identifier: Apache-2.0
#include "cli/frame_files.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/export/picture.h"
#include "recon/preprocess/radiance.h"

namespace emberlock::cli {

namespace fs = std::filesystem;

Status check_frames(const FrameFormat& format, ImageSize size, double brightness) {
  constexpr int kMost = 4096;
  constexpr double kFar = 1e6;
  const auto within = [](double value, double least, double most) { return value >= least && value <= most; };
  if (!within(size.width, 16, kMost) || !within(size.height, 16, kMost))
    return Error{ErrorKind::bad_input, fmt::format("\"{}x{}\" is out of range", size.width, size.height),
                 "--image", "Give sides of 16 to 4096"};
  if (format.format == "mp4" && (size.width % 2 != 0 || size.height % 2 != 0))
    return Error{ErrorKind::bad_input, "a video for players has even sides", "--image", "Give even ones"};
  if (!within(brightness, 1 / kFar, kFar))
    return Error{ErrorKind::bad_input, "is out of range", "--brightness", "Give a factor of 1e-6 to 1e6"};
  if (!within(format.rate, 1, 240))
    return Error{ErrorKind::bad_input, "is out of range", "--rate", "Give 1 to 240 frames a second"};
  return {};
}

Picture picture_of(const recon::RadianceImage& light, const std::vector<float>& opacity, bool transparent) {
  if (!transparent) return {recon::to_rgb8(light), {}};
  recon::RadianceImage bare(light.size);
  std::vector<std::uint8_t> covers(opacity.size());
  for (std::size_t i = 0; i < covers.size(); ++i) {
    const float* rgb = &light.rgb[3 * i];
    const float alpha =
        std::clamp(std::max({opacity[i], rgb[0] / kWhite, rgb[1] / kWhite, rgb[2] / kWhite}), 0.0F, 1.0F);
    covers[i] = static_cast<std::uint8_t>(std::lround(kWhite * alpha));
    for (std::size_t c = 0; c < 3; ++c) bare.rgb[3 * i + c] = alpha > 0 ? rgb[c] / alpha : 0;
  }
  return {recon::to_rgb8(bare), std::move(covers)};
}

Result<FrameFiles> FrameFiles::create(const FrameFormat& format, const fs::path& folder,
                                      const std::string& name, ImageSize size,
                                      const session::VideoDisplay& display) {
  FrameFiles files(folder);
  if (!format.video()) return files;
  const session::VideoWriter::Coding coding = format.coding();
  const char* const ending = coding == session::VideoWriter::Coding::lossless ? ".mkv" : ".mp4";
  EMBERLOCK_ASSIGN_OR_RETURN(
      files.video_, session::VideoWriter::create(folder / (name + ending), {size, PixelFormat::rgb8, 8},
                                                 Hertz(format.rate), 0, coding, display));
  return files;
}

Status FrameFiles::put(const Picture& picture) {
  if (video_) return video_->show(picture.rgb);
  const fs::path path = next(".png");
  return picture.opacity.empty() ? recon::write_png(picture.rgb.view(), path)
                                 : recon::write_png(picture.rgb.view(), picture.opacity, path);
}

Status FrameFiles::put_exr(const recon::RadianceImage& light, const std::vector<float>& opacity,
                           const std::vector<recon::ExrChannel>& further) {
  std::vector<float> channel[3];
  for (std::size_t c = 0; c < 3; ++c) {
    channel[c].resize(opacity.size());
    for (std::size_t i = 0; i < opacity.size(); ++i) channel[c][i] = light.rgb[3 * i + c] / kWhite;
  }
  std::vector<recon::ExrChannel> all{{"R", channel[0]}, {"G", channel[1]}, {"B", channel[2]}, {"A", opacity}};
  for (const recon::ExrChannel& one : further) all.push_back(one);
  return put_exr(light.size, all);
}

Status FrameFiles::put_exr(ImageSize size, const std::vector<recon::ExrChannel>& channels) {
  return recon::write_exr(size, channels, next(".exr"));
}

fs::path FrameFiles::next(const char* ending) {
  return folder_ / fmt::format("frame-{:04}{}", number_++, ending);
}

}  // namespace emberlock::cli
