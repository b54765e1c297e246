// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/shown_volume.h"

#include <cmath>
#include <cstdint>

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <gtest/gtest.h>

#include "recon/calibrate/camera_path.h"
#include "recon/export/exr_file.h"
#include "recon/export/volume_file.h"
#include "recon/render/render.h"
#include "tests/support/key_points.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

constexpr ImageSize kSize{64, 48};
constexpr double kRadius = 0.05;
constexpr double kBallExtinction = 20;
constexpr double kSource = 4000;  // levels a metre

/// A ball of even light and extinction; its upper half has 1800 K, the other 1500.
ShownVolume ball() {
  ShownVolume shown;
  Volume& v = shown.volume;
  v.grid = cube_grid(0.12, 48);
  each_point(v.grid, [&](int i, int j, int k) {
    const double inside = share_in_ball(v.grid, i, j, k, kRadius);
    for (const int c : {1, 2, 3}) v.emission.push_back(static_cast<float>(inside * kSource / c));
    v.extinction.push_back(static_cast<float>(inside * kBallExtinction));
    shown.kelvin.push_back(inside > 0 ? (k >= 24 ? 1800 : 1500) : 0);
  });
  return shown;
}

std::size_t pixel(int x, int y) { return static_cast<std::size_t>(y * kSize.width + x); }

TEST(ShownVolume, LightAndOpacityOfABallAreTheClosedForms) {
  const ShownVolume shown = ball();
  const CameraModel camera = looking({0.5, 0, 0}, {0, 0, 0}, Eigen::Vector3d::UnitZ(), kSize);
  for (const bool absorbs : {true, false}) {
    Volume volume = shown.volume;
    if (!absorbs) volume.extinction.clear();
    const std::vector<ShownView> views = LightViews(volume).of({&camera});
    ASSERT_EQ(views.size(), 1U);
    const std::size_t middle = pixel(32, 24);
    const double depth = 2 * kRadius * kBallExtinction;
    const double light = absorbs ? kSource / kBallExtinction * (1 - std::exp(-depth)) : kSource * 2 * kRadius;
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(views[0].light.rgb[3 * middle + c], light / static_cast<double>(c + 1), 0.02 * light);
    EXPECT_NEAR(views[0].opacity[middle], absorbs ? 1 - std::exp(-depth) : 0, 0.01);
    EXPECT_EQ(views[0].opacity[pixel(1, 1)], 0);
    EXPECT_EQ(views[0].light.rgb[3 * pixel(1, 1)], 0);
  }
}

TEST(ShownVolume, TemperaturesAreThoseOfTheLightAlongTheRay) {
  const ShownVolume shown = ball();
  const CameraModel level = looking({0.5, 0, 0}, {0, 0, 0}, Eigen::Vector3d::UnitZ(), kSize);
  const CameraModel above = looking({0, 0, 0.5}, {0, 0, 0}, Eigen::Vector3d::UnitX(), kSize);
  const TemperatureViews shows(shown);
  const float least = shows.least_light({level, above});
  const float brightest = LightViews(shown.volume).of({&level})[0].light.rgb[3 * pixel(32, 24)];
  EXPECT_NEAR(least, 0.02F * brightest, 0.1F * 0.02F * brightest);
  const auto views = shows.of({&level, &above}, least);
  EXPECT_NEAR(views[0][pixel(32, 20)], 1800, 1);
  EXPECT_NEAR(views[0][pixel(32, 28)], 1500, 1);
  EXPECT_EQ(views[0][pixel(1, 1)], 0) << "tells nothing";
  // The upper half is nearer: of the light 1 - e^-1 of 1 - e^-2.
  const double upper = (1 - std::exp(-1)) / (1 - std::exp(-2));
  EXPECT_NEAR(views[1][pixel(32, 24)], 1500 + 300 * upper, 6);
}

/// Light and extinction at the key points of a medium's voxels, whose values have nothing to do with each
/// other.
Volume within(const Hull& medium, std::uint64_t seed, bool absorbs) {
  Volume v{medium.grid, std::vector<float>(3 * medium.grid.size()), {}, medium.inside};
  if (absorbs) v.extinction.resize(medium.grid.size());
  std::size_t voxel = 0;
  each_point(voxels_of(medium.grid), [&](int i, int j, int k) {
    if (medium.inside[voxel++] == 0) return;
    for (int c = 0; c < 8; ++c) {
      const std::size_t p = medium.grid.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
      for (std::size_t n = 0; n < 3; ++n)
        v.emission[3 * p + n] = static_cast<float>(kSource * random_uniform(seed, n, p));
      if (absorbs) v.extinction[p] = static_cast<float>(40 * random_uniform(seed, 3, p));
    }
  });
  return v;
}

TEST(ShownVolume, IsWhatWasJudgedAndNothingBeyondItsMedium) {
  const test::TempFolder folder;
  const CameraModel camera = looking({0.4, 0.1, 0.05}, {0, 0, 0}, Eigen::Vector3d::UnitZ(), kSize);
  for (int n = 0; n < 20; ++n) {
    const Hull medium = medium_with_holes(cube_grid(0.12, 3 + n), 0.05 * n + 0.04, n % 4 == 0 ? 1 : 3);
    const Volume judged = within(medium, static_cast<std::uint64_t>(n), n % 2 == 0);
    ASSERT_TRUE(write_volume(judged, folder / "volume.vdb").ok());
    const ShownVolume shown = value_of(read_shown_volume(folder / "volume.vdb"));
    EXPECT_EQ(shown.volume.inside, judged.inside);
    Effects effects;
    if (!judged.extinction.empty()) effects.extinction.model = Extinction::Model::field;
    EXPECT_EQ(LightViews(shown.volume).of({&camera})[0].light.rgb,
              render_view(judged, medium, effects, camera).rgb);
    // All light is that of the medium's voxels, for programs that interpolate beyond it too.
    const SharedVolume shared = value_of(read_shared_volume(folder / "volume.vdb"));
    EXPECT_EQ(shared.find("medium"), nullptr);
    double light = 0;
    std::size_t voxel = 0;
    each_point(voxels_of(medium.grid), [&](int i, int j, int k) {
      if (medium.inside[voxel++] == 0) return;
      for (int c = 0; c < 8; ++c)
        light += static_cast<double>(
                     judged.emission[3 * medium.grid.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))]) /
                 8;
    });
    double sum = 0;
    for (std::size_t p = 0; p < medium.grid.size(); ++p)
      sum += static_cast<double>(shared.find("emission")->values[3 * p]);
    EXPECT_NEAR(sum, light, 1e-5 * light);
  }
}

TEST(ShownVolume, IsReadFromAResultOrItsFile) {
  const test::TempFolder folder;
  const ShownVolume shown = ball();
  ASSERT_TRUE(write_volume(shown.volume, folder / "volume.vdb", {{"temperature", "K", shown.kelvin}}).ok());
  for (const auto& path : {folder / "", folder / "volume.vdb"}) {
    const auto read = value_of(read_shown_volume(path));
    EXPECT_EQ(read.kelvin, shown.kelvin);
    EXPECT_EQ(read.volume.emission, shown.volume.emission);
  }
  ASSERT_TRUE(write_volume(shown.volume, folder / "colours.vdb").ok());
  EXPECT_TRUE(read_shown_volume(folder / "colours.vdb")->kelvin.empty());
  EXPECT_FALSE(read_shown_volume(folder / "none").ok());
  // Temperatures of another volume.
  ASSERT_TRUE(
      write_volume(shown.volume, folder / "bad.vdb", {{"temperature", "K", shown.volume.emission}}).ok());
  const Error bad = read_shown_volume(folder / "bad.vdb").error();
  EXPECT_NE(bad.message().find("another size"), std::string::npos) << bad.message();
  const Box box = box_of(shown.volume.grid);
  EXPECT_LT(box.center.norm(), 1e-7);
  EXPECT_LT((box.size - Eigen::Vector3d(0.12, 0.12, 0.12)).norm(), 1e-7);
}

TEST(ExrFile, HoldsThirtyTwoBitsOfEachChannel) {
  const test::TempFolder folder;
  std::vector<float> red(12);
  for (std::size_t i = 0; i < red.size(); ++i) red[i] = 1e-3F + 1e4F * static_cast<float>(i);
  const std::vector<float> kelvin(12, 1723.456F);
  ASSERT_TRUE(write_exr({4, 3}, {{"R", red}, {"T", kelvin}}, folder / "a.exr").ok());
  Imf::InputFile file((folder / "a.exr").c_str());
  EXPECT_EQ(file.header().dataWindow().max.x, 3);
  EXPECT_EQ(file.header().dataWindow().max.y, 2);
  std::vector<float> back(12);
  std::vector<float> hot(12);
  Imf::FrameBuffer frame;
  frame.insert("R", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(back.data()), 4, 16));
  frame.insert("T", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(hot.data()), 4, 16));
  file.setFrameBuffer(frame);
  file.readPixels(0, 2);
  EXPECT_EQ(back, red);
  EXPECT_EQ(hot, kelvin);
  EXPECT_FALSE(write_exr({4, 3}, {{"R", red}}, folder / "no" / "a.exr").ok());
  EXPECT_FALSE(write_exr({4, 4}, {{"R", red}}, folder / "b.exr").ok()) << "too few values";
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_FALSE(write_exr({4, 3}, {{"R", red}}, "/dev/full").ok()) << "a full disk";
  }
}

}  // namespace
}  // namespace emberlock::recon
