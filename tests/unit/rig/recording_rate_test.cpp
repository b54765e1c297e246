// SPDX-License-Identifier: Apache-2.0
#include "rig/recording_rate.h"

#include <vector>

#include <gtest/gtest.h>

#include "session/files.h"
#include "session/layout.h"
#include "tests/support/recording.h"

namespace emberlock::rig {
namespace {

using test::record;
using test::small_disk_options;
using test::TempFolder;

TEST(RecordingRate, BoundsWhatNoiseTakesOnTheDisk) {
  const TempFolder temp;
  constexpr std::uint64_t kFrames = 5;
  for (const ImageLayout& layout :
       {ImageLayout{{320, 240}, PixelFormat::gray8, 8}, ImageLayout{{160, 120}, PixelFormat::gray16, 12},
        ImageLayout{{320, 240}, PixelFormat::gray16, 16}, ImageLayout{{160, 120}, PixelFormat::rgb8, 8},
        ImageLayout{{320, 240}, PixelFormat::rgb16, 16}}) {
    for (const session::Encoding encoding : {session::Encoding::ffv1, session::Encoding::raw_nut}) {
      const auto folder = temp / "s";
      std::filesystem::remove_all(folder);
      record(folder, layout, kFrames, small_disk_options(encoding));
      const auto bytes =
          static_cast<double>(std::filesystem::file_size(session::find_segment(folder, "cam0", 0)) +
                              std::filesystem::file_size(session::index_path(folder, "cam0")));
      drivers::CameraInfo camera;
      camera.layout = layout;
      camera.frame_rate = Hertz(100);
      const double bound = bytes_per_second(std::vector{camera}, encoding) * kFrames / 100;
      EXPECT_LE(bytes, bound * 1.01) << name(layout.format) << layout.bit_depth;
      EXPECT_GE(bytes, bound * .6) << name(layout.format) << layout.bit_depth;
    }
  }
}

}  // namespace
}  // namespace emberlock::rig
