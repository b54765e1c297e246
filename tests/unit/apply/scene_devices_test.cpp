// SPDX-License-Identifier: Apache-2.0
// A scene with all that it can hold, drawn by each device, and by the functors of a GPU on the CPU.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "apply/bvh.h"
#include "apply/kernels/trace_pixel.h"
#include "apply/light_tables.h"
#include "apply/scene_picture.h"
#include "recon/hull/kernel_views.h"
#include "tests/support/camera_at.h"
#include "tests/support/devices.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {

constexpr ImageSize kDrawn{40, 30};

/// A textured floor, a plate above a part of it, and bumps with smooth normals.
Mesh furnished() {
  Mesh mesh;
  mesh.textures.push_back({2, 2, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255}, {}, {}});
  test::add_square(mesh, 0, 0, 0, 2, {{0.9F, 0.8F, 0.7F}, {}, 0});
  mesh.texture_places = {{0, 0}, {3, 0}, {3, 3}, {0, 3}};
  test::add_square(mesh, 0.5, 0.1, 0.3, 0.2, {{1, 0.2F, 0.2F}, {5, 0, 0}});
  mesh.texture_places.resize(mesh.vertices.size());
  mesh.normals.resize(mesh.vertices.size(), {0, 0.6F, 0.8F});
  return mesh;
}

ON_EACH_DEVICE_SANITIZED_TOO(SceneDevices);

/// Five flames, of which one scatters, in light from outside.
class Furnished {
 public:
  explicit Furnished(recon::Device device) : pool(2, device) {
    light_.source = recon::Light::Source::distant;
    light_.place = {0.3, -0.4, 1};
    light_.strength = {12, 11, 10};
    light_.ambient = {2, 3, 4};
    for (int f = 0; f < 5; ++f) {
      const test::Values values = test::uneven(static_cast<std::uint64_t>(f), 2000, f == 2 ? 0 : 15);
      recon::Volume volume = test::volume_of({{0, 0, 0}, 0.02F, 10, 11, 12}, values);
      recon::Lighting lighting;
      if (f == 4) lighting.scattering = {recon::Scattering::Order::multiple, 0.7, 0.3};
      flames_.push_back(std::make_unique<Flame>(recon::ShownVolume{std::move(volume), lighting},
                                                test::moved(0.25 * f - 0.6, 0.1 * (f % 2), 0.05), 1, 16,
                                                pool));
      EXPECT_TRUE(flames_.back()
                      ->light_by(
                          light_, {}, [](const Eigen::Vector3d&) { return 0.5; }, pool)
                      .ok());
    }
  }
  [[nodiscard]] ScenePicture picture(std::size_t count, const Surfaces& surfaces, recon::Pool& on) const {
    std::vector<const Flame*> some;
    for (std::size_t f = 0; f < count; ++f) some.push_back(flames_[f].get());
    PictureOptions options;
    options.samples = 20;
    return scene_picture(some, {surfaces, light_, {1, 2, 3}},
                         test::camera_at({0.3, -1.6, 0.9}, {0, 0, 0.1}, kDrawn, 45), options, on);
  }

  recon::Pool pool;

 private:
  recon::Light light_;
  std::vector<std::unique_ptr<Flame>> flames_;
};

/// Of two pictures with the same random numbers: a ray may meet another triangle at an edge, or another
/// voxel.
void expect_alike(const ScenePicture& a, const ScenePicture& b) {
  float brightest = 0;
  std::size_t off = 0;
  for (std::size_t i = 0; i < a.light.rgb.size(); ++i) {
    brightest = std::max(brightest, a.light.rgb[i]);
    ASSERT_NEAR(a.opacity[i / 3], b.opacity[i / 3], 0.06F);
    const float far = std::abs(a.light.rgb[i] - b.light.rgb[i]);
    off += far > 1e-3F * (1 + std::abs(a.light.rgb[i])) ? 1 : 0;
    ASSERT_LT(far, 0.2F * (1 + a.light.rgb[i])) << i;
  }
  EXPECT_GT(brightest, 50);
  EXPECT_LT(off, a.light.rgb.size() / 50);
}

TEST_P(SceneDevices, DrawsWhatTheCpuDraws) {
  Furnished scene(device_here());
  recon::Pool cpu(2);
  const auto surfaces = Surfaces::build(furnished());
  ASSERT_TRUE(surfaces.ok());
  for (const std::size_t count : {std::size_t{3}, std::size_t{5}}) {
    const ScenePicture expected = scene.picture(count, *surfaces, cpu);
    // Twice: what is kept on a device from one picture to the next.
    for (int again = 0; again < 2; ++again)
      expect_alike(expected, scene.picture(count, *surfaces, scene.pool));
  }
}

TEST_P(SceneDevices, DrawsFlamesAloneAsTheCpuDoes) {
  Furnished scene(device_here());
  recon::Pool cpu(2);
  const auto none = Surfaces::build({});
  ASSERT_TRUE(none.ok());
  const ScenePicture expected = scene.picture(5, *none, cpu);
  const ScenePicture seen = scene.picture(5, *none, scene.pool);
  for (std::size_t i = 0; i < seen.light.rgb.size(); ++i)
    ASSERT_NEAR(seen.light.rgb[i], expected.light.rgb[i], 1e-3F * (1 + expected.light.rgb[i]));
}

/// What a GPU runs, tree and all, on the CPU.
TEST(SceneKernels, ATreeOfBoxesShowsWhatEmbreeShows) {
  recon::Pool pool(2);
  auto surfaces = Surfaces::build(furnished());
  const auto bvh = build_bvh(furnished());
  ASSERT_TRUE(surfaces.ok() && bvh.ok());
  const Flame flame({test::volume_of({{0, 0, 0.05F}, 0.02F, 10, 11, 12}, test::uneven(1, 2000, 15))}, {}, 1,
                    16, pool);
  const std::vector<const Flame*> flames{&flame};
  const recon::CameraModel camera = test::camera_at({0.3, -1.6, 0.9}, {0, 0, 0.1}, kDrawn, 45);
  PictureOptions options;
  options.samples = 8;
  const ScenePicture expected = scene_picture(flames, {*surfaces}, camera, options, pool);
  ScenePicture seen = expected;
  LightTables tables(flames, {}, surfaces->glowing());
  const Flame::View view = flame.seen_by(camera, options.step, pool);
  tables.flames[0] = flame.table(view);
  PixelTask task;
  task.surfaces = surfaces->table();
  task.camera = recon::pixel_rays(camera);
  task.eye = {0.3F, -1.6F, 0.9F};
  task.samples = options.samples;
  task.seed = options.seed;
  task.rgb = seen.light.rgb.data();
  task.opacity = seen.opacity.data();
  task.error = seen.error.data();
  const TracePixel<BvhTriangles, 4> trace{task, {tables.view(), bvh->view()}};
  std::fill(seen.light.rgb.begin(), seen.light.rgb.end(), -1.F);
  for (std::size_t p = 0; p < seen.opacity.size(); ++p) trace(p);
  expect_alike(expected, seen);
}

}  // namespace
}  // namespace emberlock::apply
