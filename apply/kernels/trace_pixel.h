// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <math.h>

#include "apply/kernels/surface.h"
#include "apply/kernels/surface_light.h"
#include "recon/kernels/lens.h"

namespace emberlock::apply {

/// Places of a pixel's samples: the R2 sequence (Roberts 2018), shifted at random.
struct PlacesInPixel {
  double shift[2] = {};

  HOST_DEVICE inline PlacesInPixel(std::uint64_t seed, std::uint64_t pixel) {
    constexpr std::uint64_t kBeyondSamples = ~std::uint64_t{0};
    for (std::uint64_t a = 0; a < 2; ++a) shift[a] = random_uniform(seed, pixel, kBeyondSamples - a);
  }
  HOST_DEVICE inline void operator()(int sample, double& x, double& y) const {
    x = shift[0] + sample * 0.7548776662466927;
    y = shift[1] + sample * 0.5698402909980532;
    x -= floor(x);
    y -= floor(y);
  }
};

/// What is asked of a picture, beside its lights and triangles.
struct PixelTask {
  SurfaceTable surfaces;
  recon::PixelRays camera;
  Vec3 eye, background;
  int samples = 1;
  std::uint64_t seed = 0;
  bool bare = false;     ///< there are no surfaces
  float* rgb = nullptr;  ///< three of each pixel
  float* opacity = nullptr;
  float* error = nullptr;
};

/// One pixel of a scene's picture (scene_picture.h).
template <class Triangles, int kMost>
struct TracePixel : PixelTask {
  FallingLight<Triangles, kMost> falling;

  HOST_DEVICE inline void operator()(std::size_t pixel) const {
    if (bare)
      without_surfaces(pixel);
    else
      sampled(pixel);
  }

 private:
  static constexpr int kAtOnce = 16;  // samples of which the flames' light is taken in one march

  HOST_DEVICE inline void flames_before(std::size_t pixel, const float* distances, int wanted,
                                        recon::Rgba* light) const {
    MergedLight<FineSteps, kMost> seen;
    for (int f = 0; f < falling.count; ++f) seen.add(FineSteps::of(falling.flames[f], pixel));
    seen.up_to(distances, wanted, light);
  }
  HOST_DEVICE inline void put(std::size_t pixel, const Vec3& light, float covers, float off) const {
    rgb[3 * pixel] = light.x;
    rgb[3 * pixel + 1] = light.y;
    rgb[3 * pixel + 2] = light.z;
    opacity[pixel] = recon::clamp_to(covers, 0.F, 1.F);
    error[pixel] = off;
  }

  HOST_DEVICE inline void without_surfaces(std::size_t pixel) const {
    const float far = TriangleHit{}.distance;
    recon::Rgba all;
    flames_before(pixel, &far, 1, &all);
    put(pixel, Vec3{all.c[0], all.c[1], all.c[2]} + all.c[3] * background, 1 - all.c[3], 0);
  }

  HOST_DEVICE inline Vec3 direction_through(std::size_t pixel, double x, double y) const {
    recon::PixelRays moved = camera;  // rays go through pixels' middles
    moved.cx += 0.5 - x;
    moved.cy += 0.5 - y;
    float direction[3];
    moved(static_cast<std::uint32_t>(pixel), direction);
    return vec3_at(direction);
  }

  HOST_DEVICE inline void sampled(std::size_t pixel) const {
    const PlacesInPixel places(seed, pixel);
    double light[3] = {};
    double covers = 0;
    double mean = 0;
    double squares = 0;  // of what differs from the mean (Welford 1962)
    for (int first = 0; first < samples; first += kAtOnce) {
      const int here = samples - first < kAtOnce ? samples - first : kAtOnce;
      Vec3 directions[kAtOnce];
      TriangleHit hits[kAtOnce];
      float distances[kAtOnce];
      int order[kAtOnce];
      for (int i = 0; i < here; ++i) {
        double x = 0;
        double y = 0;
        places(first + i, x, y);
        directions[i] = direction_through(pixel, x, y);
        hits[i] = falling.triangles.first(eye, directions[i], 0);
        int at = i;
        for (; at > 0 && distances[at - 1] > hits[i].distance; --at) {
          distances[at] = distances[at - 1];
          order[at] = order[at - 1];
        }
        distances[at] = hits[i].distance;
        order[at] = i;
      }
      recon::Rgba before[kAtOnce];
      flames_before(pixel, distances, here, before);
      for (int n = 0; n < here; ++n) {
        const int i = order[n];
        const float through = before[n].c[3];
        const Vec3 behind =
            hits[i].any() ? shine(hits[i], directions[i], {seed, pixel, first + i, samples}) : background;
        const Vec3 seen = Vec3{before[n].c[0], before[n].c[1], before[n].c[2]} + through * behind;
        light[0] += double(seen.x);
        light[1] += double(seen.y);
        light[2] += double(seen.z);
        covers += hits[i].any() ? 1 : 1 - double(through);
        const double value = double(sum(seen)) / 3;
        const double off = value - mean;
        mean += off / (first + n + 1);
        squares += off * (value - mean);
      }
    }
    put(pixel,
        {static_cast<float>(light[0] / samples), static_cast<float>(light[1] / samples),
         static_cast<float>(light[2] / samples)},
        static_cast<float>(covers / samples),
        samples > 1 ? static_cast<float>(sqrt(squares / (samples - 1) / samples)) : 0);
  }

  HOST_DEVICE inline Vec3 shine(const TriangleHit& hit, const Vec3& direction, const Draw& draw) const {
    constexpr float kPi = 3.14159265F;
    const Surface surface = surfaces.at(hit, direction);
    const Vec3 place = eye + hit.distance * direction;
    const Vec3 falls = (1 / kPi) * falling.of_flames(place, surface.normal, draw) +
                       falling.outside_on_white(place, surface.normal);
    return surface.emitted + surface.albedo * falls;
  }
};

}  // namespace emberlock::apply
