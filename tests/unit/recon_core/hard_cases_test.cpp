// SPDX-License-Identifier: Apache-2.0
// The march's hard cases, on every device of this machine. Those of scattering are in
// tests/integration/optics/in_scatter_test.cpp, the solvers' in hard_scenes_test.cpp.
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "recon/adjust/engine.h"
#include "recon/render/render.h"
#include "tests/support/camera_at.h"
#include "tests/support/devices.h"
#include "tests/support/key_points.h"
#include "tests/support/march_case.h"

namespace emberlock::recon {
namespace {

using test::camera_at;
Hull cube(int voxels) {
  return whole_grid(grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, voxels));
}

class MarchHardCase : public OnEachDevice {
 protected:
  /// Radiance and transmittance of the rays of one camera that meet the medium, and what the transpose makes
  /// of them.
  struct Seen {
    std::vector<Rgba> rays;
    std::vector<Rgba> transposed;
  };
  /// The same emission everywhere, 1 a voxel edge, and extinction a voxel edge.
  [[nodiscard]] Seen march(const Hull& medium, const CameraModel& camera, float sigma = 0,
                           Absorb absorb = Absorb::nothing) {
    View view{"camera", camera, share(RadianceImage(camera.intrinsics.size))};
    const Problem problem = make_problem({&view}, medium, {}, pool_);
    const auto engine = make_engine(problem, {absorb, sigma, 0, {}}, Precision::float32, pool_);
    engine->set(std::vector<Rgba>(problem.grid().size(), Rgba{{1, 1, 1, sigma}}));
    Seen seen;
    engine->residual(0);
    engine->backproject(0);
    seen.transposed = engine->gradient();
    engine->project(0);
    seen.rays = engine->residuals();
    return seen;
  }
  Pool pool_{2, GetParam()};
};

bool finite(const std::vector<Rgba>& values) {
  for (const Rgba& v : values)
    for (int c = 0; c < 4; ++c)
      if (!std::isfinite(v.c[c])) return false;
  return true;
}

TEST_P(MarchHardCase, AxisParallelRaysAlongFacesAndEdgesLoseNothing) {
  // Two voxels a side around the axes: the central ray runs along an edge, its neighbours close to faces.
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 1, 0),
        Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
    const Seen seen = march(cube(2), camera_at(0.5 * axis, {0, 0, 0}, {3, 3}, 1e4));
    ASSERT_EQ(seen.rays.size(), 9U) << axis.transpose();
    for (const Rgba& ray : seen.rays) EXPECT_NEAR(ray.c[0], 2, 1e-4) << axis.transpose();
    EXPECT_TRUE(finite(seen.transposed));
  }
}

TEST_P(MarchHardCase, RaysAlongTheOuterFacesStayFinite) {
  for (int a = 0; a < 3; ++a)
    for (const double side : {-0.1, 0.1}) {
      Eigen::Vector3d off = Eigen::Vector3d::Zero();
      off[(a + 1) % 3] = side;
      const Seen seen = march(cube(2), camera_at(off + 0.5 * Eigen::Vector3d::Unit(a), off, {3, 3}, 1e4));
      for (const Rgba& ray : seen.rays) EXPECT_TRUE(ray.c[0] >= 0 && ray.c[0] <= 2.001F) << ray.c[0];
      EXPECT_GE(seen.rays.size(), 3U);
      EXPECT_TRUE(finite(seen.transposed));
    }
}

TEST_P(MarchHardCase, CameraInsideTheVolumeSeesOnlyWhatLiesAhead) {
  const Seen seen = march(cube(10), camera_at({0.05, 0, 0}, {-1, 0, 0}, {3, 3}, 1000));
  ASSERT_EQ(seen.rays.size(), 9U);
  EXPECT_NEAR(seen.rays[4].c[0], 7.5, 1e-4);
  for (const Rgba& v : seen.transposed) EXPECT_GE(v.c[0], 0);
}

TEST_P(MarchHardCase, CameraOnAKeyPointAndInACornerOfTheVolume) {
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.1, 0.1, 0.1)}) {
    const Seen seen = march(cube(2), camera_at(at, {-0.1, -0.1, -0.1}, {5, 5}, 40));
    ASSERT_EQ(seen.rays.size(), 25U);
    EXPECT_NEAR(seen.rays[12].c[0], at.x() > 0 ? std::sqrt(12.0) : std::sqrt(3.0), 1e-4);
    EXPECT_TRUE(finite(seen.transposed));
  }
}

TEST_P(MarchHardCase, CameraThatLooksAwayHasNoRays) {
  const Seen seen = march(cube(4), camera_at({0.5, 0, 0}, {1, 0, 0}, {8, 6}, 8));
  EXPECT_TRUE(seen.rays.empty());
  for (const Rgba& v : seen.transposed) EXPECT_EQ(v.c[0], 0);
}

TEST_P(MarchHardCase, SlabHasItsClosedFormFromNoExtinctionToAMillionAMetre) {
  const Hull slab = cube(16);
  const CameraModel camera = camera_at({0.5, 0, 0}, {0, 0, 0}, {1, 1}, 300);
  for (const double per_meter : {0.0, 1e-6, 1e-3, 1.0, 32.8, 1e3, 1e6}) {
    const double sigma = per_meter * static_cast<double>(slab.grid.edge);
    const double expected = sigma == 0 ? 16 : -std::expm1(-sigma * 16) / sigma;
    for (const Absorb absorb : {Absorb::constant, Absorb::field}) {
      const Seen seen = march(slab, camera, static_cast<float>(sigma), absorb);
      ASSERT_EQ(seen.rays.size(), 1U);
      EXPECT_NEAR(static_cast<double>(seen.rays[0].c[0]) / expected, 1, 1e-5) << per_meter;
      EXPECT_NEAR(seen.rays[0].c[3], std::exp(-sigma * 16), 1e-6) << per_meter;
      EXPECT_TRUE(finite(seen.transposed)) << per_meter;
    }
  }
}

TEST_P(MarchHardCase, VolumesOfOneVoxelOneRowAndOnePlate) {
  const CameraModel camera = camera_at({0.31, 0.17, 0.23}, {0, 0, 0}, {20, 20}, 60);
  for (const Eigen::Vector3d& size : {Eigen::Vector3d(0.02, 0.02, 0.02), Eigen::Vector3d(0.02, 0.18, 0.02),
                                      Eigen::Vector3d(0.18, 0.02, 0.02), Eigen::Vector3d(0.02, 0.02, 0.18),
                                      Eigen::Vector3d(0.18, 0.18, 0.02)}) {
    const Hull medium = whole_grid(grid_over({Eigen::Vector3d::Zero(), size}, size.maxCoeff() > 0.1 ? 9 : 1));
    const Seen seen = march(medium, camera);
    ASSERT_FALSE(seen.rays.empty()) << size.transpose();
    double left = 0;
    double right = 0;
    for (const Rgba& r : seen.rays) left += static_cast<double>(r.c[0]) * static_cast<double>(r.c[0]);
    for (const Rgba& v : seen.transposed) right += static_cast<double>(v.c[0]);  // x is 1 everywhere
    EXPECT_NEAR(left / right, 1, 1e-5) << size.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, MarchHardCase, testing::ValuesIn(devices()),
                         [](const auto& device) { return device_name(device.param); });

TEST_P(MarchHardCase, AnEmptyMediumLeavesTheBackgroundAlone) {
  Hull nothing = cube(4);
  std::fill(nothing.inside.begin(), nothing.inside.end(), std::uint8_t{0});
  nothing.count = 0;
  const Volume volume{nothing.grid, std::vector<float>(3 * nothing.grid.size(), 1000), {}};
  Effects effects = absorbing(PerMeter(1e3));
  effects.background = {Background::Kind::constant, {7, 8, 9}};
  const RadianceImage image =
      render_view(volume, nothing, effects, camera_at({0.5, 0, 0}, {0, 0, 0}, {4, 3}, 8));
  for (std::size_t i = 0; i < image.rgb.size(); ++i) EXPECT_EQ(image.rgb[i], static_cast<float>(7 + i % 3));
}

std::size_t resident_bytes() {
  std::size_t total = 0;
  std::size_t resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

/// Memory that costs only what is written to.
class SparseVolume {
 public:
  explicit SparseVolume(std::size_t size)
      : bytes_(size * sizeof(Rgba)),
        data_(static_cast<Rgba*>(::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE,
                                        MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0))) {}
  SparseVolume(SparseVolume&&) = delete;
  SparseVolume& operator=(SparseVolume&&) = delete;
  ~SparseVolume() { ::munmap(data_, bytes_); }
  [[nodiscard]] bool ok() const { return data_ != MAP_FAILED; }
  [[nodiscard]] Rgba* data() const { return data_; }

 private:
  std::size_t bytes_;
  Rgba* data_;
};

TEST(MarchHardCase, TheFarCornerOf512CubedVoxelsLooksAsInAGridOfItsOwn) {
  constexpr int kCorner = 12;  // voxels of medium a side
  Hull large{grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 512), {}, 0};
  large.inside.resize(std::size_t{512} * 512 * 512);
  for (int k = 512 - kCorner; k < 512; ++k)
    for (int j = 512 - kCorner; j < 512; ++j)
      for (int i = 512 - kCorner; i < 512; ++i, ++large.count)
        large.inside[static_cast<std::size_t>(i) +
                     512 * (static_cast<std::size_t>(j) + std::size_t{512} * k)] = 1;
  const CroppedHull small = crop_to_medium(large);
  ASSERT_EQ(small.hull.inside.size(), std::size_t{kCorner * kCorner * kCorner});

  const CameraModel camera = camera_at({0.3, 0.2, 0.25}, Eigen::Vector3d::Constant(0.0977), {20, 20}, 1000);
  const auto values = random_quads<float>(small.hull.grid.size(), 1);
  Pool pool(2);
  const RayList near = clip_rays({&camera}, small.hull, {}, pool);
  const auto expected = Marcher<float>(near).forward(Absorb::nothing, values);
  ASSERT_GT(expected.size(), 100U);

  [[maybe_unused]] const std::size_t before = resident_bytes();
  const SparseVolume volume(large.grid.size());
  const SparseVolume gradient(large.grid.size());
  ASSERT_TRUE(volume.ok() && gradient.ok());
  const Grid& g = small.hull.grid;
  const auto far_index = [&](int i, int j, int k) {
    return large.grid.index(i + 512 - kCorner, j + 512 - kCorner, k + 512 - kCorner);
  };
  each_point(g, [&](int i, int j, int k, std::size_t p) { volume.data()[far_index(i, j, k)] = values[p]; });
  const RayList list = clip_rays({&camera}, large, {}, pool);
  std::vector<Rgba> seen(list.rays.size());
  MarchWork<float> work;
  work.rays = list.table();
  work.volume = volume.data();
  work.residual = seen.data();
  work.gradient = gradient.data();
  march_table<float>().forward_of(Absorb::nothing, Travel::straight)(work, 0, seen.size());
  ASSERT_EQ(list.pixels, near.pixels);
  double left = 0;
  double right = 0;
  for (std::size_t r = 0; r < seen.size(); ++r) {
    EXPECT_NEAR(seen[r].c[1], expected[r].c[1], 1e-3) << r;
    left += static_cast<double>(seen[r].c[1]) * static_cast<double>(seen[r].c[1]);
  }
  for (std::uint32_t run = 0; run < list.runs.size(); ++run)
    march_table<float>().adjoint_of(Absorb::nothing, Travel::straight)(work, &run, 1);
  each_point(g, [&](int i, int j, int k) {
    right += static_cast<double>(volume.data()[far_index(i, j, k)].c[1]) *
             static_cast<double>(gradient.data()[far_index(i, j, k)].c[1]);
  });
  EXPECT_NEAR(left / right, 1, 1e-6);
#ifndef EMBERLOCK_SANITIZED  // whose shadow is memory too
  EXPECT_LT(resident_bytes(), before + (std::size_t{64} << 20)) << "of the 4 GiB that could be touched";
#endif
}

}  // namespace
}  // namespace emberlock::recon
