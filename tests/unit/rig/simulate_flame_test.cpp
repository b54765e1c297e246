// SPDX-License-Identifier: Apache-2.0
#include "rig/simulate/simulate_flame.h"

#include <algorithm>
#include <filesystem>

#include <gtest/gtest.h>

#include "recon/export/volume_file.h"
#include "recon/pipeline/scene.h"

namespace emberlock::rig {
namespace {

class SimulateFlameTest : public testing::Test {
 protected:
  SimulateFlameTest() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~SimulateFlameTest() override { std::filesystem::remove_all(folder_); }
  static SimulateOptions small() {
    SimulateOptions o;
    o.frames = 2;
    o.cameras = 3;
    o.image = {64, 64};
    o.cells = 16;
    o.compute = {recon::Device::cpu, 1};
    return o;
  }
  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) / "simulate-flame";
};

TEST_F(SimulateFlameTest, LeavesASessionAndItsTruth) {
  const auto film = simulate_flame(small(), folder_);
  ASSERT_TRUE(film.ok()) << film.error().message();
  EXPECT_GT(film->hottest.value(), 1500);
  EXPECT_LE(film->relative_divergence, 1e-5);
  const auto scene = recon::load_scene(folder_ / "session");
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_EQ(scene->views.size(), 3U);
  const std::filesystem::path truth = folder_ / "truth" / "frame-0001.vdb";
  const auto volume = recon::read_volume(truth);
  ASSERT_TRUE(volume.ok()) << volume.error().message();
  EXPECT_GT(*std::max_element(volume->emission.begin(), volume->emission.end()), 0);
  const auto temperature = recon::read_grid(truth, "temperature");
  ASSERT_TRUE(temperature.ok());
  EXPECT_GT(*std::max_element(temperature->begin(), temperature->end()), 1500);
  const auto velocity = recon::read_grid(truth, "velocity");
  ASSERT_TRUE(velocity.ok());
  EXPECT_EQ(velocity->size(), 3 * temperature->size());
}

TEST_F(SimulateFlameTest, RefusesWhatCannotBeFilmed) {
  SimulateOptions smoke = small();
  smoke.preset = recon::FlamePreset::smoke;
  EXPECT_EQ(simulate_flame(smoke, folder_).error().kind, ErrorKind::refused);
  SimulateOptions odd = small();
  odd.image = {63, 64};
  EXPECT_EQ(simulate_flame(odd, folder_).error().kind, ErrorKind::bad_input);
  SimulateOptions none = small();
  none.frames = 0;
  EXPECT_EQ(simulate_flame(none, folder_).error().kind, ErrorKind::bad_input);
}

TEST_F(SimulateFlameTest, EndsEarlyAsAsked) {
  const auto film = simulate_flame(small(), folder_, [](double, std::string_view) { return false; });
  ASSERT_FALSE(film.ok());
  EXPECT_EQ(film.error().kind, ErrorKind::refused);
}

}  // namespace
}  // namespace emberlock::rig
