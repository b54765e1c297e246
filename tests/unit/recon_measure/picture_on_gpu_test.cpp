// SPDX-License-Identifier: Apache-2.0
#include "tests/support/picture_on_gpu.h"

#include <cmath>

#include <gtest/gtest.h>

#include "recon/compute/cuda_device.h"
#include "tests/support/devices.h"
#include "tests/support/flame_frames.h"
#include "tests/support/pictures.h"

namespace emberlock::recon {
namespace {

/// A frame of 10 bits with everything that develop() takes out or evens out, as far as it is asked for.
struct Filmed {
  PixelFormat format = PixelFormat::bayer_rggb16;
  Demosaicing demosaicing = Demosaicing::bilinear;
  bool dark = true;
  bool gains = true;
  DevelopOptions::SmearRemoval smear = DevelopOptions::SmearRemoval::automatic;
  SmearPath path = SmearPath::whole_column;
};

/// A blob with a saturated core on a ramp, with noise and hot pixels.
Image shot(PixelFormat format, bool flame, std::uint64_t seed) {
  const ImageLayout layout{{67, 53}, format, bytes_per_sample(format) == 2 ? 10 : 8};
  const int n = channels(format);
  return image_of(layout, [&](int x, int y, int c) {
    const int i = n * x + c;
    const double off = (x - 30.0) * (x - 30.0) + (y - 24.0) * (y - 24.0);
    double level =
        0.03 + 0.0003 * x + 0.01 * random_normal(seed, 1, static_cast<std::uint64_t>(y * 67 * n + i));
    if (flame) level += (1.4 - 0.2 * (i % 3)) * std::exp(-off / 60);
    if ((x * 7 + y * 13) % 401 == 0) level += 0.4;
    return std::clamp(level, 0.0, 1.0) * layout.white();
  });
}

Colour uneven() {
  Colour colour;
  colour.response = {0, 0.2, 0.55, 1};
  colour.dark = {0.004, 0.006, 0.005};
  colour.gain = {1.2, 0.9, 1.4};
  colour.vignetting = {-0.1, 0.02, -0.03};
  colour.flat = {2, 3, std::vector<float>(18, 1.02F)};
  colour.flat.light[7] = 0.9F;
  colour.hot_pixels = {5, 100, 2000};
  return colour;
}

DevelopedPicture developed(const Filmed& filmed) {
  CameraFrame camera;
  camera.frame = share(shot(filmed.format, true, 1));
  if (filmed.gains) camera.colour = uneven();
  if (filmed.dark) {
    std::vector<Image> frames;
    for (std::uint64_t seed = 2; seed < 6; ++seed) frames.push_back(shot(filmed.format, false, seed));
    std::vector<ImageView> views;
    for (const Image& frame : frames) views.push_back(frame.view());
    camera.dark = share(dark_picture_of(views, camera.colour));
  }
  DevelopOptions options;
  options.demosaicing = filmed.demosaicing;
  options.smear_removal = filmed.smear;
  options.smear.fraction = {2e-3, 3e-3, 1e-3};
  options.smear.path = filmed.path;
  return develop(camera, options);
}

TEST(Origin, ACopyThatMayBeChangedHasNone) {
  DevelopedPicture picture = developed({});
  ASSERT_TRUE(picture.image.origin.raw());
  const RadianceImage copy = picture.image;  // NOLINT(performance-unnecessary-copy-initialization)
  EXPECT_FALSE(copy.origin.raw());
  RadianceImage assigned = developed({}).image;
  assigned = copy;
  EXPECT_FALSE(assigned.origin.raw());
  const RadianceImage moved = std::move(picture.image);
  EXPECT_TRUE(moved.origin.raw()) << "it is the same picture";
}

#ifdef EMBERLOCK_HAVE_CUDA
class PictureOnGpu : public OnEachDevice {};

TEST_P(PictureOnGpu, IsDevelopedThereBitByBit) {
  using Removal = DevelopOptions::SmearRemoval;
  const Filmed all[] = {
      {},
      {.demosaicing = Demosaicing::gradient},
      {.format = PixelFormat::bayer_rggb8, .dark = false},
      {.format = PixelFormat::gray8, .gains = false},
      {.format = PixelFormat::gray16, .dark = false, .gains = false},
      {.format = PixelFormat::rgb8, .smear = Removal::told},
      {.format = PixelFormat::rgb16, .dark = false, .smear = Removal::told, .path = SmearPath::rows_above},
      {.smear = Removal::told},
      {.smear = Removal::told, .path = SmearPath::rows_below},
  };
  for (const Filmed& filmed : all) {
    DevelopedPicture picture = developed(filmed);
    const SharedImage image = share(std::move(picture.image));
    const GpuWork before = gpu_work();
    const std::vector<float> pixels = test::pixels_on_gpu(image);
    ASSERT_EQ(pixels.size(), image->rgb.size());
    for (std::size_t i = 0; i < pixels.size(); ++i)
      ASSERT_EQ(pixels[i], image->rgb[i]) << "sample " << i << " of picture " << &filmed - all;
    if (filmed.dark) continue;
    const std::uint64_t copied = gpu_work().uploaded - before.uploaded;
    const std::uint64_t sensed = image->origin.raw()->frame->bytes().size();
    EXPECT_LT(copied, sensed + 6000) << "the sensor's samples, and small tables beside them";
  }
}

TEST_P(PictureOnGpu, APictureFromAFileIsMadeThereToo) {
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::bayer_rggb16, PixelFormat::rgb16}) {
    const SharedImage image = share(as_filmed(share(shot(format, true, 3))));
    EXPECT_EQ(test::pixels_on_gpu(image), image->rgb);
    EXPECT_EQ(image->rgb, to_radiance(image->origin.raw()->frame->view()).rgb);
  }
}

TEST_P(PictureOnGpu, WithoutAnOriginItIsCopied) {
  RadianceImage changed = developed({}).image;
  const SharedImage image = share(RadianceImage(changed));
  EXPECT_EQ(test::pixels_on_gpu(image), image->rgb);
}

TEST_P(PictureOnGpu, MemoryIsReservedOnce) {
  reserve_gpu_memory(std::size_t{64} << 20);
  const std::size_t reserved = reserved_gpu_memory();
  EXPECT_GE(reserved, std::size_t{64} << 20);
  reserve_gpu_memory(std::size_t{32} << 20);
  EXPECT_EQ(test::pixels_on_gpu(share(RadianceImage({640, 480}))).size(), std::size_t{3} * 640 * 480);
  EXPECT_EQ(reserved_gpu_memory(), reserved) << "both fit into what is ready";
}

INSTANTIATE_TEST_SUITE_P(Devices, PictureOnGpu, testing::ValuesIn(other_devices()),
                         [](const auto& on) { return device_name(on.param); });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(PictureOnGpu);
#endif

}  // namespace
}  // namespace emberlock::recon
