// SPDX-License-Identifier: Apache-2.0
#include "apply/scene_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "apply/ray_light.h"
#include "apply/surface_light.h"
#include "base/quantity.h"
#include "base/random.h"

namespace emberlock::apply {
namespace {

Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
Eigen::Vector3d colour_of(const recon::Rgba& v) {
  return Eigen::Vector3f(v.c[0], v.c[1], v.c[2]).cast<double>();
}

/// Places of a pixel's samples: the R2 sequence (Roberts 2018), shifted at random.
class PlacesInPixel {
 public:
  PlacesInPixel(std::uint64_t seed, std::uint64_t pixel) {
    constexpr std::uint64_t kBeyondSamples = ~std::uint64_t{0};
    for (std::uint64_t a = 0; a < 2; ++a) shift_[a] = random_uniform(seed, pixel, kBeyondSamples - a);
  }
  [[nodiscard]] Eigen::Vector2d operator()(int sample) const {
    constexpr double kAcross = 0.7548776662466927;
    constexpr double kDown = 0.5698402909980532;
    return {wrap_positive(shift_[0] + sample * kAcross, 1), wrap_positive(shift_[1] + sample * kDown, 1)};
  }

 private:
  double shift_[2] = {};
};

class PixelTracer {
 public:
  PixelTracer(const std::vector<const Flame*>& flames, const Surroundings& around,
              const recon::CameraModel& camera, const PictureOptions& options, recon::Pool& pool)
      : flames_(flames),
        around_(around),
        camera_(camera),
        options_(options),
        outside_(around.light, flames, around.surfaces),
        lights_(flames, around.surfaces) {
    views_.reserve(flames.size());
    for (const Flame* flame : flames) views_.push_back(flame->seen_by(camera, options.step, pool));
  }

  /// Rays of one thread.
  struct Scratch {
    RayLight seen;
    SurfaceLight::Scratch surface;
  };
  void operator()(int x, int y, ScenePicture& picture, Scratch& scratch) const {
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.light.size.width) +
        static_cast<std::size_t>(x);
    scratch.seen.clear();
    for (std::size_t f = 0; f < flames_.size(); ++f) flames_[f]->add_steps(views_[f], pixel, scratch.seen);
    scratch.seen.merge();
    const Means means =
        around_.surfaces.empty() ? without_surfaces(scratch.seen) : sampled(x, y, pixel, scratch);
    for (std::size_t c = 0; c < 3; ++c)
      picture.light.rgb[3 * pixel + c] = static_cast<float>(means.light[static_cast<Eigen::Index>(c)]);
    picture.opacity[pixel] = static_cast<float>(std::clamp(means.opacity, 0.0, 1.0));
    picture.error[pixel] = static_cast<float>(means.error);
  }

 private:
  struct Means {
    Eigen::Vector3d light = Eigen::Vector3d::Zero();
    double opacity = 0, error = 0;
  };

  [[nodiscard]] Means without_surfaces(const RayLight& flames) const {
    const recon::Rgba all = flames.all();
    const double through = static_cast<double>(all.c[3]);
    return {colour_of(all) + through * vector_of(around_.background), 1 - through, 0};
  }

  [[nodiscard]] Means sampled(int x, int y, std::size_t pixel, Scratch& scratch) const {
    const PlacesInPixel places(options_.seed, pixel);
    Means means;
    double mean = 0;
    double squares = 0;  // of what differs from the mean (Welford 1962)
    for (int i = 0; i < options_.samples; ++i) {
      const recon::Ray ray = camera_.ray(Eigen::Vector2d(x, y) + places(i));
      const std::optional<Surfaces::Hit> hit = around_.surfaces.first(ray.origin, ray.direction);
      const recon::Rgba before =
          hit ? scratch.seen.up_to(static_cast<float>(hit->distance)) : scratch.seen.all();
      const double through = static_cast<double>(before.c[3]);
      const Eigen::Vector3d behind = hit ? shine(ray.origin + hit->distance * ray.direction, *hit,
                                                 {options_.seed, pixel, i, options_.samples}, scratch.surface)
                                         : vector_of(around_.background);
      const Eigen::Vector3d light = colour_of(before) + through * behind;
      means.light += light;
      means.opacity += hit ? 1 : 1 - through;
      const double off = light.mean() - mean;
      mean += off / (i + 1);
      squares += off * (light.mean() - mean);
    }
    means.light /= options_.samples;
    means.opacity /= options_.samples;
    if (options_.samples > 1) means.error = std::sqrt(squares / (options_.samples - 1) / options_.samples);
    return means;
  }

  [[nodiscard]] Eigen::Vector3d shine(const Eigen::Vector3d& place, const Surfaces::Hit& hit,
                                      const SurfaceLight::Draw& draw, SurfaceLight::Scratch& scratch) const {
    const Eigen::Vector3d falls = lights_.sample(place, hit.normal, draw, scratch) / std::numbers::pi +
                                  outside_.on_white(place, hit.normal);
    return hit.emitted + hit.albedo.cwiseProduct(falls);
  }

  const std::vector<const Flame*>& flames_;
  const Surroundings& around_;
  const recon::CameraModel& camera_;
  const PictureOptions& options_;
  OutsideLight outside_;
  SurfaceLight lights_;
  std::vector<Flame::View> views_;
};

}  // namespace

ScenePicture scene_picture(const std::vector<const Flame*>& flames, const Surroundings& around,
                           const recon::CameraModel& camera, const PictureOptions& options,
                           recon::Pool& pool) {
  const ImageSize size = camera.intrinsics.size;
  ScenePicture picture{recon::RadianceImage(size), {}, {}};
  picture.opacity.resize(picture.light.rgb.size() / 3);
  picture.error.resize(picture.opacity.size());
  const PixelTracer trace(flames, around, camera, options, pool);
  constexpr int kRows = 4;  // a task: what it allocates for its rays is then nothing
  pool.run((size.height + kRows - 1) / kRows, [&](int task) {
    PixelTracer::Scratch scratch;
    for (int y = kRows * task; y < std::min(size.height, kRows * (task + 1)); ++y)
      for (int x = 0; x < size.width; ++x) trace(x, y, picture, scratch);
  });
  return picture;
}

double rms_error(const ScenePicture& picture) {
  double sum = 0;
  for (const float e : picture.error) sum += static_cast<double>(e) * static_cast<double>(e);
  return picture.error.empty() ? 0 : std::sqrt(sum / static_cast<double>(picture.error.size()));
}

}  // namespace emberlock::apply
