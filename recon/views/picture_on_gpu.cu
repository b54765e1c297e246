// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>
#include <vector>

#include "recon/compute/cuda_launch.h"
#include "recon/compute/gpu_pictures.h"
#include "recon/views/picture_on_gpu.h"
#include "recon/views/raw_picture.h"

namespace emberlock::recon {
namespace {

/// Samples as develop() has them before it interpolates colours.
struct SamplesOnGpu {
  CudaBuffer<float> value;
  CudaBuffer<std::uint8_t> saturated;
  SampleView view;
};

SamplesOnGpu lit(const RawPicture& raw) {
  const ImageLayout& layout = raw.frame->layout();
  const CudaBuffer<std::byte> sensor(raw.frame->bytes());
  const CudaBuffer<float> exposures(raw.exposures);
  LightOfNumber light = raw.light;
  light.of_number = exposures.data();
  const bool wide = bytes_per_sample(layout.format) == 2;
  const std::size_t count = sensor.size() / (wide ? 2 : 1);
  SamplesOnGpu s{CudaBuffer<float>::unfilled(count), CudaBuffer<std::uint8_t>::unfilled(count), {}};
  s.view = {s.value.data(), s.saturated.data(), layout.size.width, layout.size.height, light.layout};
  launch(count, LightOfSample{sensor.data(), wide, light, s.view, s.value.data(), s.saturated.data()},
         "converting a sensor's numbers to light");
  return s;
}

void take(const SamplesOnGpu& from, const float* less, std::size_t period, const char* what) {
  launch(from.value.size(), TakeFromSample{from.value.data(), less, period}, what);
}

/// `dark`: the samples' background, null if there is none to take out.
CudaBuffer<float> developed(const RawPicture& raw, const CudaBuffer<float>* dark) {
  const SamplesOnGpu s = lit(raw);
  const CudaBuffer<std::uint32_t> hot(raw.hot);
  launch(hot.size(), ReplaceHotPixel{s.view, {hot.data(), hot.size()}, s.value.data(), s.saturated.data()},
         "replacing hot pixels");
  if (dark != nullptr) take(s, dark->data(), dark->size(), "taking the background out");
  if (!raw.smear_of_row.empty()) {
    const CudaBuffer<float> smear(raw.smear_of_row);
    take(s, smear.data(), smear.size(), "taking smear out");
  }
  if (raw.smear_of_other_rows) {
    TakeSmearOfRows smear = *raw.smear_of_other_rows;
    smear.s = s.view;
    smear.value = s.value.data();
    launch(static_cast<std::size_t>(s.view.width), smear, "taking smear out");
  }
  const std::size_t pixels = static_cast<std::size_t>(s.view.width) * static_cast<std::size_t>(s.view.height);
  auto rgb = CudaBuffer<float>::unfilled(3 * pixels);
  launch(pixels, DemosaicPixel{s.view, raw.demosaicing, rgb.data(), nullptr}, "interpolating colours");
  const CudaBuffer<float> flat(raw.flat);
  EqualisePixel equalise = raw.equalise;
  equalise.rgb = rgb.data();
  equalise.flat.light = flat.data();
  if (!equalise.changes_nothing()) launch(pixels, equalise, "applying gains");
  return rgb;
}

}  // namespace

std::shared_ptr<const CudaBuffer<float>> on_gpu(const SharedImage& image) {
  if (!image) return nullptr;
  // The pixels alone, which live as long as the image.
  const std::shared_ptr<const std::vector<float>> pixels(image, &image->rgb);
  const auto& raw = image->origin.raw();
  if (!raw) return on_gpu(pixels);
  const auto dark = on_gpu(raw->dark);
  return on_gpu(pixels, [&] { return developed(*raw, dark.get()); });
}

}  // namespace emberlock::recon
