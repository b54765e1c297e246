// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/file.h"
#include "base/frame.h"
#include "base/random.h"
#include "session/layout.h"
#include "session/reader.h"
#include "session/writer.h"
#include "tests/support/temp_folder.h"

// What tests of recordings share: frames made from a seed, and a session of them.
namespace emberlock::test {

/// Noise over the whole range of the bit depth, the extremes included: the hardest content for a lossless
/// codec.
inline Image noise_image(const ImageLayout& layout, std::uint64_t seed) {
  Image image(layout);
  RandomStream random(seed, 7);
  const int samples = layout.size.width * channels(layout.format);
  for (int y = 0; y < layout.size.height; ++y) {
    for (int i = 0; i < samples; ++i) {
      const auto v = static_cast<int>(random.bits() % (static_cast<unsigned>(layout.white()) + 1));
      if (bytes_per_sample(layout.format) == 2) {
        image.row_as<std::uint16_t>(y)[i] = static_cast<std::uint16_t>(v);
      } else {
        image.row_as<std::uint8_t>(y)[i] = static_cast<std::uint8_t>(v);
      }
    }
  }
  return image;
}

/// Frame `i` of a camera at 100 Hz, its pixels a function of (seed, i).
inline Frame noise_frame(const ImageLayout& layout, std::uint64_t i, std::uint64_t seed = 1) {
  const auto ns = static_cast<std::int64_t>(i) * 10'000'000;
  Frame frame;
  frame.stamp = {i, {ns + 5}, {1'700'000'000'000'000'000 + ns}, {1'000'000'000 + ns}, FrameStatus::complete};
  frame.image = std::make_shared<const Image>(noise_image(layout, seed * 1'000'003 + i));
  return frame;
}

inline v1::Manifest manifest_of(const std::vector<ImageLayout>& layouts) {
  v1::Manifest manifest;
  manifest.set_session_id("test");
  manifest.set_purpose("flame");
  for (std::size_t i = 0; i < layouts.size(); ++i) {
    v1::CameraStream& camera = *manifest.add_cameras();
    camera.set_camera_id("cam" + std::to_string(i));
    camera.set_frame_rate_hz(100);
    session::set_layout(camera, layouts[i]);
  }
  return manifest;
}

/// Records `frames` noise frames of one camera; throws with the message where something fails.
inline void record(const std::filesystem::path& folder, const ImageLayout& layout, std::uint64_t frames,
                   const session::WriterOptions& options) {
  const auto check = [](const auto& result) {
    if (!result.ok()) throw std::runtime_error(result.error().message());
  };
  auto writer = session::SessionWriter::create(folder, manifest_of({layout}), options);
  check(writer);
  for (std::uint64_t i = 0; i < frames; ++i) check(writer->write(0, noise_frame(layout, i)));
  check(writer->finish());
}

inline std::string bytes_of(const std::filesystem::path& path) {
  auto bytes = read_file(path);
  if (!bytes) throw std::runtime_error(bytes.error().message());
  return std::move(bytes).value();
}

inline void put_bytes(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Options for a machine whose disk may be fuller than a recorder would like.
inline session::WriterOptions small_disk_options(session::Encoding encoding = session::Encoding::ffv1) {
  session::WriterOptions options;
  options.encoding = encoding;
  options.min_free_bytes = 0;
  return options;
}

}  // namespace emberlock::test
