// SPDX-License-Identifier: Apache-2.0
#include "recon/render/render.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "recon/compute/pool.h"
#include "recon/effects/background.h"
#include "recon/effects/exposure.h"
#include "recon/effects/sensor.h"
#include "recon/hull/ray_list.h"
#include "recon/render/cropped_source.h"
#include "recon/render/march_table.h"
#include "recon/render/render_cuda.h"
#include "recon/render/scattered_source.h"

namespace emberlock::recon {
namespace {

constexpr Absorb absorb_of(Extinction::Model model) {
  switch (model) {
    case Extinction::Model::constant:
      return Absorb::constant;
    case Extinction::Model::field:
      return Absorb::field;
    case Extinction::Model::none:
      break;
  }
  return Absorb::nothing;
}

/// Puts the radiance and transmittance of rays in front of the image's present content.
void put_in_front(const Rgba* seen, const std::uint32_t* pixels, std::size_t count, RadianceImage& image) {
  for (std::size_t r = 0; r < count; ++r) {
    float* pixel = &image.rgb[3 * static_cast<std::size_t>(pixels[r])];
    for (int c = 0; c < 3; ++c) pixel[c] = seen[r].c[c] + seen[r].c[3] * pixel[c];
  }
}

/// Marches the rays of some cameras, which are the list's subsets, in front of their images.
void march(const RayList& list, const std::vector<Rgba>& source, Absorb absorb, float sigma, Pool& pool,
           RadianceImage* images) {
  if constexpr (kCudaBuilt) {
    if (pool.device() == Device::cuda) {
      const MarchedRays marched = march_on_cuda(list, source, absorb, sigma);
      for (int v = 0; v < list.subsets(); ++v) {
        const std::size_t first = list.before[static_cast<std::size_t>(v)].rays;
        const std::size_t last = list.before[static_cast<std::size_t>(v) + 1].rays;
        put_in_front(marched.seen.data() + first, marched.pixels.data() + first, last - first, images[v]);
      }
      return;
    }
  }
  std::vector<Rgba> seen(list.rays.size());
  MarchWork<float> work;
  work.rays = list.table();
  work.volume = source.data();
  work.sigma = sigma;
  work.residual = seen.data();
  const Travel travel = list.curved ? Travel::curved : Travel::straight;
  const auto forward = march_table<float>().forward_of(absorb, travel);
  constexpr int kTasks = 128;  // a view
  pool.run(kTasks * list.subsets(), [&](int task) {
    const int view = task / kTasks;
    const std::size_t first = list.before[static_cast<std::size_t>(view)].rays;
    const Slice mine =
        slice(list.before[static_cast<std::size_t>(view) + 1].rays - first, kTasks, task % kTasks);
    forward(work, first + mine.begin, first + mine.end);
    put_in_front(seen.data() + first + mine.begin, list.pixels.data() + first + mine.begin,
                 mine.end - mine.begin, images[view]);
  });
}

/// A volume that is ready to be marched through.
class Renderer {
 public:
  Renderer(const Volume& volume, const Hull& medium, const Effects& effects, const RenderOptions& options,
           Pool& pool)
      : effects_(effects),
        options_(options),
        pool_(pool),
        crop_(crop_to_medium(medium)),
        source_(cropped_source(volume, crop_, effects.extinction.model)),
        sigma_(static_cast<float>(effects.extinction.value.value() * static_cast<double>(volume.grid.edge))),
        blur_(effects.exposure, crop_.hull.grid) {
    if (effects.scattering.order == Scattering::Order::none) return;
    if (options.scattered == nullptr)
      found_ = find_in_scatter(volume, medium, effects, options.in_scatter, pool);
    scattered_ = options.scattered != nullptr ? options.scattered : &found_;
    if (scattered_->empty()) scattered_ = nullptr;
  }

  /// Whether each camera sees a light of its own.
  [[nodiscard]] bool one_by_one() const { return scattered_ != nullptr; }

  /// In front of the images' present content.
  void operator()(const std::vector<const CameraModel*>& cameras, RadianceImage* images) const {
    if (scattered_ == nullptr && blur_.identity()) return march_through(source_, cameras, images);
    std::vector<Rgba> source = source_;
    if (scattered_ != nullptr)
      add_in_scatter(*scattered_, cameras.front()->center(), crop_.hull.grid, effects_.extinction, pool_,
                     source);
    if (!blur_.identity()) source = blur_.forward(source, pool_);
    march_through(source, cameras, images);
  }

 private:
  void march_through(const std::vector<Rgba>& source, const std::vector<const CameraModel*>& cameras,
                     RadianceImage* images) const {
    RayListOptions clip;
    clip.step = static_cast<float>(options_.step);
    clip.subsets = static_cast<int>(cameras.size());
    clip.rule.by_view = true;
    clip.home = RayListOptions::Home::where_it_is_made;
    std::optional<RefractiveIndex> index;  // whose values the gas points to
    IndexField gas;
    if (effects_.refraction.rays == Refraction::Rays::curved) {
      index.emplace(options_.gas != nullptr ? *options_.gas
                                            : assume_temperature(crop_.hull, source, effects_.refraction),
                    effects_.refraction.ambient);
      gas = index->field(crop_.hull.grid);
      clip.gas = &gas;
    }
    march(clip_rays(cameras, crop_.hull, clip, pool_), source, absorb_of(effects_.extinction.model), sigma_,
          pool_, images);
  }

  const Effects& effects_;
  const RenderOptions& options_;
  Pool& pool_;
  CroppedHull crop_;
  std::vector<Rgba> source_;
  float sigma_;
  ExposureBlur blur_;
  ScatterField found_;
  const ScatterField* scattered_ = nullptr;
};

/// How many of the cameras from `first` on are marched at once: rays take some hundred bytes a pixel.
std::size_t together(const std::vector<const CameraModel*>& cameras, std::size_t first) {
  constexpr double kPixels = 4e6;
  constexpr std::size_t kMost = 64;
  double pixels = 0;
  std::size_t count = 0;
  while (first + count < cameras.size() && count < kMost) {
    const ImageSize size = cameras[first + count]->intrinsics.size;
    pixels += static_cast<double>(size.width) * size.height;
    if (count > 0 && pixels > kPixels) break;
    ++count;
  }
  return count;
}

}  // namespace

RadianceImage render_view(const Volume& volume, const Hull& medium, const Effects& effects,
                          const CameraModel& camera, const RenderOptions& options) {
  return std::move(render_views(volume, medium, effects, {&camera}, {options.background}, options).front());
}

std::vector<RadianceImage> render_views(const Volume& volume, const Hull& medium, const Effects& effects,
                                        const std::vector<const CameraModel*>& cameras,
                                        const std::vector<const RadianceImage*>& backgrounds,
                                        const RenderOptions& options) {
  std::vector<RadianceImage> images;
  images.reserve(cameras.size());
  for (std::size_t v = 0; v < cameras.size(); ++v)
    images.push_back(backdrop(effects.background, cameras[v]->intrinsics.size, backgrounds[v]));
  if (medium.count > 0) {
    Pool pool(options.compute);
    const Renderer render(volume, medium, effects, options, pool);
    for (std::size_t first = 0; first < cameras.size();) {
      const std::size_t count = render.one_by_one() ? 1 : together(cameras, first);
      const auto begin = cameras.begin() + static_cast<std::ptrdiff_t>(first);
      render({begin, begin + static_cast<std::ptrdiff_t>(count)}, &images[first]);
      first += count;
    }
  }
  for (RadianceImage& image : images) respond(image, effects.sensor);
  return images;
}

}  // namespace emberlock::recon
