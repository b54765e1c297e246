// SPDX-License-Identifier: Apache-2.0
// Frames a second that one thread writes and reads back, by format and encoding, of a flame-like picture with
// camera noise (pure noise would flatter no codec, a flat one every codec).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <unistd.h>

#include "base/random.h"
#include "session/layout.h"
#include "session/reader.h"
#include "session/writer.h"

namespace {

using namespace emberlock;

Image flame_like(const ImageLayout& layout, std::uint64_t seed) {
  Image image(layout);
  RandomStream random(seed, 1);
  const int count = channels(layout.format);
  for (int y = 0; y < layout.size.height; ++y) {
    for (int x = 0; x < layout.size.width; ++x) {
      const double dx = (x - layout.size.width / 2.0) / layout.size.width;
      const double dy = (y - layout.size.height / 2.0) / layout.size.height;
      const double light =
          0.8 * std::exp(-30 * dx * dx - 8 * dy * dy) * (1 + 0.3 * std::sin(40 * dy + 9 * dx));
      for (int c = 0; c < count; ++c) {
        const double v = std::clamp((light / (1 + c) + random.normal(0.02, 0.006)) * layout.white(), 0.0,
                                    static_cast<double>(layout.white()));
        if (bytes_per_sample(layout.format) == 2) {
          image.row_as<std::uint16_t>(y)[x * count + c] = static_cast<std::uint16_t>(v);
        } else {
          image.row_as<std::uint8_t>(y)[x * count + c] = static_cast<std::uint8_t>(v);
        }
      }
    }
  }
  return image;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void measure(const ImageLayout& layout, session::Encoding encoding) {
  constexpr int kFrames = 60;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("emberlock-bench-" + std::to_string(::getpid()));
  std::vector<std::shared_ptr<const Image>> pictures;
  for (std::uint64_t i = 0; i < 4; ++i)
    pictures.push_back(std::make_shared<const Image>(flame_like(layout, i)));
  v1::Manifest manifest;
  v1::CameraStream& camera = *manifest.add_cameras();
  camera.set_camera_id("cam0");
  camera.set_frame_rate_hz(60);
  session::set_layout(camera, layout);
  double best_write = 1e9;
  double best_read = 1e9;
  std::uintmax_t bytes = 0;
  for (int repeat = 0; repeat < 3; ++repeat) {
    std::filesystem::remove_all(folder);
    session::WriterOptions options;
    options.encoding = encoding;
    options.min_free_bytes = 0;
    auto writer = session::SessionWriter::create(folder, manifest, options);
    auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < kFrames && writer.ok(); ++i) {
      Frame frame;
      frame.stamp.frame_id = static_cast<std::uint64_t>(i);
      frame.stamp.monotonic_time.ns = i * 16'666'667LL;
      frame.image = pictures[static_cast<std::size_t>(i) % pictures.size()];
      if (!writer->write(0, frame).ok()) return;
    }
    best_write = std::min(best_write, seconds_since(start));
    if (!writer.ok() || !writer->finish().ok()) return;
    bytes = std::filesystem::file_size(folder / "cam0" /
                                       (encoding == session::Encoding::ffv1 ? "000000.mkv" : "000000.nut"));
    auto reader = session::SessionReader::open(folder);
    start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < kFrames && reader.ok(); ++i) {
      if (!reader->read(0, i).ok()) return;
    }
    best_read = std::min(best_read, seconds_since(start));
  }
  std::filesystem::remove_all(folder);
  const double raw = static_cast<double>(layout.row_bytes()) * layout.size.height * kFrames;
  std::printf("%-8s %5s  %4d x %-4d  write %6.1f fps %6.1f MB/s  read %6.1f fps  ratio %.2f\n",
              std::string(name(layout.format)).c_str(),
              encoding == session::Encoding::ffv1      ? "ffv1"
              : encoding == session::Encoding::raw_nut ? "raw"
                                                       : "huff",
              layout.size.width, layout.size.height, kFrames / best_write, raw / best_write / 1e6,
              kFrames / best_read, raw / static_cast<double>(bytes));
}

}  // namespace

int main() {
  for (const session::Encoding encoding :
       {session::Encoding::ffv1, session::Encoding::raw_nut, session::Encoding::huffman_nut}) {
    measure({{1280, 720}, PixelFormat::gray8, 8}, encoding);
    measure({{1280, 720}, PixelFormat::gray16, 12}, encoding);
    measure({{1280, 720}, PixelFormat::rgb8, 8}, encoding);
    measure({{1280, 720}, PixelFormat::rgb16, 12}, encoding);
  }
  return 0;
}
