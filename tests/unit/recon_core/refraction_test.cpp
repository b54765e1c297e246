// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/refraction.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "base/random.h"
#include "recon/hull/hull.h"
#include "recon/render/render.h"
#include "tests/support/brute_force.h"
#include "tests/support/devices.h"
#include "tests/support/key_points.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(RefractionTest);
ON_EACH_DEVICE(RefractionTestSlow);

using Eigen::Vector3d;
using Eigen::Vector3f;

struct Stretch {
  Vector3f origin, direction;
  double length;
};

std::vector<Stretch> chain(const RefractiveIndex& index, const Vector3f& origin, const Vector3f& direction,
                           const Grid& medium = {}) {
  std::vector<Stretch> out;
  trace(index.field(medium), origin.data(), direction.data(),
        [&](const float* o, const float* d, float length) {
          out.push_back({Vector3f(o), Vector3f(d), static_cast<double>(length)});
        });
  return out;
}

/// n - 1 as a function of the position, on a cube of `cells` cells of edge 1 centred on the origin.
RefractiveIndex sampled(int cells, const std::function<double(const Vector3d&)>& excess) {
  Grid grid;
  grid.nx = grid.ny = grid.nz = cells + 1;
  for (float& o : grid.origin) o = -0.5F * static_cast<float>(cells);
  std::vector<float> values;
  each_point(grid, [&](int i, int j, int k) {
    values.push_back(static_cast<float>(excess(place_of(grid, i, j, k))));
  });
  return {grid, values};
}

Vector3d bend(const std::vector<Stretch>& path) {
  return (path.back().direction - path.front().direction).cast<double>();
}

TEST(Refraction, EvenGasOfAnyIndexLeavesTheRayItsBits) {
  const Vector3f origin(-40.3F, 3.7F, 1.9F);
  for (const double excess : {0.0, -2e-4, 0.3}) {
    const RefractiveIndex index = sampled(32, [&](const Vector3d&) { return excess; });
    for (const Vector3f& to : {Vector3f(0, 0, 0), Vector3f(7, -3, 5), Vector3f(0, 90, 0)}) {
      const Vector3f direction = (to - origin).normalized();
      const auto path = chain(index, origin, direction);
      ASSERT_EQ(path.size(), 1u);
      EXPECT_EQ(path[0].origin, origin);
      EXPECT_EQ(path[0].direction, direction);
      EXPECT_EQ(path[0].length, static_cast<double>(kEndless));
    }
  }
}

// Bouguer: in n(r) every ray keeps n r sin(phi) = |n r x d|.
TEST(Refraction, BouguersInvariantHoldsInARadialField) {
  const auto excess = [](const Vector3d& r) { return 0.2 * std::exp(-r.squaredNorm() / 60); };
  const RefractiveIndex index = sampled(64, excess);
  for (const float off : {1.F, 4.F, 9.F}) {
    const auto path = chain(index, {-50, off, 0.3F}, {1, 0, 0});
    ASSERT_GT(path.size(), 8u);
    const double expected = std::hypot(static_cast<double>(off), 0.3);
    double turned = 0;
    for (const Stretch& s : path) {
      const Vector3d r = s.origin.cast<double>();
      const Vector3d d = s.direction.cast<double>();
      EXPECT_NEAR((1 + excess(r)) * r.cross(d).norm(), expected, 0.03) << off << " at " << r.transpose();
      turned = std::max(turned, (1 - d.x()));
    }
    EXPECT_GT(turned, 0.002) << off;
  }
}

// n = 1 + g x, entered along y where n = 1: the catenary x = (cosh(g y) - 1) / g, which is the parabola
// g y^2 / 2 to first order.
TEST(Refraction, LinearIndexBendsTheRayIntoACatenary) {
  const double g = 0.01;
  const RefractiveIndex index = sampled(64, [&](const Vector3d& r) { return g * r.x(); });
  const auto path = chain(index, {0, -31.999F, 0}, {0, 1, 0});
  ASSERT_GT(path.size(), 10u);
  for (const Stretch& s : path) {
    const double y = static_cast<double>(s.origin.y()) + 32;
    if (y > 63) break;
    EXPECT_NEAR(static_cast<double>(s.origin.x()), (std::cosh(g * y) - 1) / g, 0.02) << y;
    EXPECT_NEAR(static_cast<double>(s.origin.z()), 0, 1e-6);
  }
  EXPECT_GT(static_cast<double>(path.back().origin.x()), 20);
}

// Small angles (Abel): n - 1 = -h exp(-r^2 / w^2) turns a ray that passes the axis at b by
// 2 h b sqrt(pi) / w exp(-b^2 / w^2), away from it.
TEST(Refraction, HotColumnTurnsRaysByAbelsIntegral) {
  const double h = 2.2e-4;
  for (const double w : {4.0, 8.0, 16.0}) {  // cells; central differences err by about 1 / w^2
    const RefractiveIndex index = sampled(w > 8 ? 96 : 64, [&](const Vector3d& r) {
      return -h * std::exp(-(r.x() * r.x() + r.y() * r.y()) / (w * w));
    });
    for (const double b : {-6.0, 2.5, 5.0, 8.0}) {
      const auto path = chain(index, {-100, static_cast<float>(b), 0.5F}, {1, 0, 0});
      const double expected = 2 * h * b * std::sqrt(std::numbers::pi) / w * std::exp(-b * b / (w * w));
      const double largest = h * std::sqrt(2 * std::numbers::pi / std::numbers::e);
      EXPECT_NEAR(bend(path).y(), expected, 1.3 / (w * w) * largest) << w << ", " << b;
      EXPECT_EQ(bend(path).z(), 0);
    }
  }
}

TEST(Refraction, StretchesJoinWithinTheirTolerance) {
  const RefractiveIndex index =
      sampled(64, [](const Vector3d& r) { return -0.01 * std::exp(-r.squaredNorm() / 100); });
  const auto path = chain(index, {-50, 6, 3}, Vector3f(1, 0.05F, -0.1F).normalized());
  ASSERT_GT(path.size(), 4u);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Vector3f end = path[i].origin + static_cast<float>(path[i].length) * path[i].direction;
    EXPECT_LT((path[i + 1].origin - end).norm(), 1.1 * kLargestDeparture) << i;
    EXPECT_NEAR(path[i].direction.norm(), 1, 1e-6);
  }
}

TEST(Refraction, RaysThatMissTheGasOrStartInsideIt) {
  const RefractiveIndex index =
      sampled(16, [](const Vector3d& r) { return 0.01 * std::exp(-r.squaredNorm() / 9); });
  EXPECT_EQ(chain(index, {-50, 9, 0}, {1, 0, 0}).size(), 1u);  // along a face, outside
  EXPECT_EQ(chain(index, {50, 2, 0}, {1, 0, 0}).size(), 1u);   // behind the camera
  EXPECT_GT(chain(index, {-4, 2, 0}, {1, 0, 0}).size(), 1u);   // a camera in the gas
  EXPECT_GE(chain(index, {0, -50, 8}, {0, 1, 0}).size(), 1u);  // along a face
}

TEST(Refraction, CoarserGridsOfTheMediumSeeTheSameRay) {
  const RefractiveIndex index =
      sampled(32, [](const Vector3d& r) { return -0.01 * std::exp(-r.squaredNorm() / 30); });
  Grid coarse;
  coarse.edge = 2;
  coarse.origin[0] = -3;
  const auto fine = chain(index, {-50, 3, 2}, {1, 0, 0});
  const auto same = chain(index, {-23.5F, 1.5F, 1}, {1, 0, 0}, coarse);
  EXPECT_NEAR(bend(fine).y(), bend(same).y(), 1e-6);
  EXPECT_GT(std::abs(bend(fine).y()), 1e-3);
}

TEST(Refraction, IndexOfAirByGladstoneAndDale) {
  EXPECT_NEAR(index_excess(Kelvin(293)), 2.7e-4, 1e-9);
  EXPECT_NEAR(index_excess(Kelvin(1800)), 2.7e-4 * 293 / 1800, 1e-9);
}

TEST(Refraction, AssumedGasIsHotInTheMediumAndAmbientAroundIt) {
  const Hull medium = whole_grid(cube_grid(0.2, 64));
  const Refraction refraction{Refraction::Rays::curved, Kelvin(1500), Kelvin(300)};
  const GasTemperature gas = assume_temperature(medium, {}, refraction);
  const Grid& g = gas.grid;
  EXPECT_NEAR(gas.kelvin[g.index(g.nx / 2, g.ny / 2, g.nz / 2)], 1500, 0.1);
  for (int j = 0; j < g.ny; ++j)
    for (int i = 0; i < g.nx; ++i) {
      for (const int layer : {0, 1}) {  // two layers all around, so that the gradient starts at 0
        EXPECT_EQ(gas.kelvin[g.index(i, j, layer)], 300.F);
        EXPECT_EQ(gas.kelvin[g.index(i, layer, j)], 300.F);
        EXPECT_EQ(gas.kelvin[g.index(layer, i, j)], 300.F);
        EXPECT_EQ(gas.kelvin[g.index(i, j, g.nz - 1 - layer)], 300.F);
      }
    }
}

TEST(Refraction, DarkGasIsAssumedCooler) {
  const Grid grid = cube_grid(0.2, 32);
  const Hull medium = whole_grid(grid);
  std::vector<Rgba> emission(grid.size());
  for (std::size_t p = 0; p < emission.size(); ++p)
    emission[p] = p % 33 > 16 ? Rgba{{9, 9, 9, 0}} : Rgba{{1, 1, 1, 0}};  // bright where x > 0; the mean is 5
  const GasTemperature gas = assume_temperature(medium, emission, {});
  const Grid& g = gas.grid;
  const float bright = gas.kelvin[g.index(3 * g.nx / 4 - 2, g.ny / 2, g.nz / 2)];
  const float dark = gas.kelvin[g.index(g.nx / 4 + 2, g.ny / 2, g.nz / 2)];
  EXPECT_NEAR(bright, 1800, 1);
  EXPECT_NEAR(dark, 293 + 1507 / 5.0, 10);
}

// From here on rays meet a medium: a box of 16 voxels in gas whose index rises by `kLensRise` in the middle,
// a hundred times more than a flame's falls.
constexpr double kLensRise = 0.03;
constexpr double kLensWidth = 0.06;  // metres
constexpr Kelvin kAmbient(293);

double lens(const Vector3d& r) { return kLensRise * std::exp(-r.squaredNorm() / (kLensWidth * kLensWidth)); }

GasTemperature lens_gas() {
  GasTemperature gas{cube_grid(0.4, 80), {}};
  each_point(gas.grid, [&](int i, int j, int k) {
    const double excess =
        index_excess(kAmbient) + lens(place_of(gas.grid, i, j, k)) * (1 + index_excess(kAmbient));
    gas.kelvin.push_back(static_cast<float>(index_excess(Kelvin(1)) / excess));
  });
  return gas;
}

struct Setting {
  Grid grid = cube_grid(0.2, 16);
  Volume volume{grid, std::vector<float>(3 * grid.size()), {}};
  Hull medium = medium_with_holes(grid, 0.7, 8);
  CameraModel camera = look_at({{16, 12}, 18, 18, 8, 6, {}}, Vector3d(0.3, -0.12, 0.1), Vector3d::Zero());

  Setting() {
    for (std::size_t i = 0; i < volume.emission.size(); ++i)
      volume.emission[i] = static_cast<float>(1000 * random_uniform(3, 0, i));
  }

  /// The model along the true curve: Nystrom's fourth order through the analytic lens in tiny steps.
  [[nodiscard]] double brute_force(double sigma, const Ray& ray, int channel) const {
    const double step = static_cast<double>(grid.edge) / 100;
    const auto force = [](const Vector3d& r) -> Vector3d {  // n grad n
      return (1 + lens(r)) * lens(r) * -2 / (kLensWidth * kLensWidth) * r;
    };
    Vector3d r = ray.origin;
    Vector3d p = (1 + lens(r)) * ray.direction;
    double radiance = 0;
    double transmittance = 1;
    for (int i = 0; i < 6000; ++i) {
      const double ds = step * (1 + lens(r));
      const Vector3d k1 = force(r);
      const Vector3d k2 = force(r + step / 2 * p + step * step / 8 * k1);
      const Vector3d k4 = force(r + step * p + step * step / 2 * k2);
      const double s = emission_at(volume, medium, r + step / 2 * p, channel);
      r += step * p + step * step / 6 * (k1 + 2 * k2);
      p += step / 6 * (k1 + 4 * k2 + k4);
      if (s < 0) continue;
      radiance += transmittance * s * ds;
      transmittance *= std::exp(-sigma * ds);
    }
    return radiance;
  }
};

Effects curved(PerMeter extinction) {
  Effects effects = absorbing(extinction);
  effects.refraction.rays = Refraction::Rays::curved;
  return effects;
}

TEST_P(RefractionTestSlow, CurvedPicturesAgreeWithBruteForceInDouble) {
  const Setting setting;
  const GasTemperature gas = lens_gas();
  RenderOptions options;
  options.step = 0.05;
  options.gas = &gas;
  for (const double sigma : {0.0, 10.0}) {
    const RadianceImage image =
        render_view(setting.volume, setting.medium, curved(PerMeter(sigma)), setting.camera, options);
    const RadianceImage straight =
        render_view(setting.volume, setting.medium, absorbing(PerMeter(sigma)), setting.camera, options);
    double error = 0;
    double change = 0;
    for (int y = 0; y < 12; ++y)
      for (int x = 0; x < 16; ++x) {
        const int green = 3 * (16 * y + x) + 1;
        const auto at = static_cast<std::size_t>(green);
        const double truth = setting.brute_force(sigma, setting.camera.ray({x + 0.5, y + 0.5}), 1);
        error += std::pow(static_cast<double>(image.rgb[at]) - truth, 2);
        change += std::pow(static_cast<double>(straight.rgb[at]) - truth, 2);
      }
    // RMS of what bending does: 3.0 and 0.9 grey levels, met within 0.07 and 0.04.
    EXPECT_GT(std::sqrt(change / (16 * 12)), 0.8) << sigma;
    EXPECT_LT(std::sqrt(error / change), 0.05) << sigma;
  }
}

TEST_P(RefractionTest, GasAtTheSurroundingsTemperatureGivesTheStraightPicturesBits) {
  const Setting setting;
  for (const double sigma : {0.0, 10.0}) {
    Effects effects = curved(PerMeter(sigma));
    effects.refraction.flame = effects.refraction.ambient;
    EXPECT_EQ(render_view(setting.volume, setting.medium, effects, setting.camera).rgb,
              render_view(setting.volume, setting.medium, absorbing(PerMeter(sigma)), setting.camera).rgb);
  }
}

TEST_P(RefractionTest, SameBitsForAnyNumberOfThreads) {
  const Setting setting;
  RenderOptions options;
  std::vector<std::vector<float>> pictures;
  for (const int threads : {1, 2, 16}) {
    options.compute.threads = threads;
    pictures.push_back(
        render_view(setting.volume, setting.medium, curved(PerMeter(10)), setting.camera, options).rgb);
  }
  EXPECT_EQ(pictures[0], pictures[1]);
  EXPECT_EQ(pictures[0], pictures[2]);
  EXPECT_NE(pictures[0],
            render_view(setting.volume, setting.medium, absorbing(PerMeter(10)), setting.camera).rgb);
}

}  // namespace
}  // namespace emberlock::recon
