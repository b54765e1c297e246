// SPDX-License-Identifier: Apache-2.0
// Writes a scene to time with, and to compare it with other renderers: three flames of 128^3 voxels (or
// another number) in a room of 10380 triangles. Then draws it on a device, 1280 x 720 with 2 samples a pixel,
// once it is read, and says what each frame takes.
//   bench_scene FOLDER [VOXELS]
//   bench_scene --device cpu|cuda FOLDER [FRAMES]
#include "apply/scene.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include "recon/export/volume_file.h"
#include "recon/hull/hull.h"
#include "recon/synthetic/flame.h"
#include "tests/support/gltf_writer.h"

namespace {

using namespace emberlock;
namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr int kLightVoxels = 48;

/// A wall of 36 x 36 squares from a corner along two edges.
void add_wall(test::GltfText& gltf, const Vector3d& corner, const Vector3d& along, const Vector3d& across,
              int squares) {
  const auto first = static_cast<int>(gltf.corners.size() / 3);
  for (int j = 0; j <= squares; ++j)
    for (int i = 0; i <= squares; ++i) {
      const Vector3d p = corner + along * i / squares + across * j / squares;
      for (const double v : {p.x(), p.z(), -p.y()})
        gltf.corners.push_back(static_cast<float>(v));  // y upwards
    }
  const auto put = [&](int i, int j) {
    gltf.indices.push_back(static_cast<std::uint16_t>(first + i + (squares + 1) * j));
  };
  for (int j = 0; j < squares; ++j)
    for (int i = 0; i < squares; ++i)
      for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}) put(i + x, j + y);
}

/// Floor, back and sides of 2 m, and a pillar before the flames.
std::string room() {
  test::GltfText gltf;
  gltf.corners.clear();
  gltf.indices.clear();
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  constexpr int kSquares = 36;
  add_wall(gltf, {-1, -1, 0}, 2 * x, 2 * y, kSquares);
  add_wall(gltf, {-1, 1, 0}, 2 * x, 1.5 * z, kSquares);
  add_wall(gltf, {-1, -1, 0}, 2 * y, 1.5 * z, kSquares);
  add_wall(gltf, {1, -1, 0}, 2 * y, 1.5 * z, kSquares);
  const Vector3d foot(0.15, -0.45, 0);
  for (const auto& [corner, along] :
       {std::pair(foot, x), {foot + 0.1 * y, x}, {foot, y}, {foot + 0.1 * x, y}})
    add_wall(gltf, corner, 0.1 * along, 0.8 * z, 1);
  add_wall(gltf, foot, 0.1 * x, 0.1 * y, 1);
  add_wall(gltf, foot + 0.8 * z, 0.1 * x, 0.1 * y, 1);
  gltf.further =
      R"("materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.7, 0.6, 1], "metallicFactor": 0}}])";
  std::printf("%zu triangles\n", gltf.indices.size() / 3);
  return gltf.text();
}

/// What there is to do: rays and steps of the march through the flames, and voxels from which light is drawn.
Status count(const apply::SceneFile& file, const recon::CameraModel& camera, recon::Pool& pool) {
  recon::RayCounts all;
  std::size_t emitters = 0;
  for (const apply::PlacedResult& placed : file.flames) {
    EMBERLOCK_ASSIGN_OR_RETURN(recon::ShownVolume shown, recon::read_shown_volume(placed.result));
    const apply::Flame flame(std::move(shown), placed.world_from_flame, 1, kLightVoxels, pool);
    all = all + flame.seen_by(camera, 1, pool).rays.count();
    emitters += flame.emitters().size();
  }
  std::printf("%zu rays, %zu runs, %zu steps; %zu voxels send light\n", static_cast<std::size_t>(all.rays),
              static_cast<std::size_t>(all.runs), static_cast<std::size_t>(all.samples), emitters);
  return {};
}

Status draw(const fs::path& folder, const std::string& on, int frames) {
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Device device, recon::parse_device(on));
  EMBERLOCK_ASSIGN_OR_RETURN(device, recon::resolve(device));
  recon::Pool pool(0, device);
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::SceneFile file, apply::read_scene(folder / "scene.json"));
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::Scene scene, apply::Scene::load(file, kLightVoxels, pool));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto cameras, scene.cameras({1280, 720}, frames));
  EMBERLOCK_RETURN_IF_ERROR(count(file, cameras.front(), pool));
  apply::PictureOptions options;
  options.samples = 2;
  for (const recon::CameraModel& camera : cameras) {
    const auto start = std::chrono::steady_clock::now();
    const apply::ScenePicture picture = scene.picture(camera, options, pool);
    const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%s: %.1f ms, noise %.2f grey levels\n", recon::name(pool.device()).c_str(), 1e3 * took,
                apply::rms_error(picture));
    ++options.seed;
  }
  return {};
}

void write(const fs::path& folder, int voxels) {
  const recon::Grid grid = recon::grid_over({Vector3d::Zero(), Vector3d::Constant(0.2)}, voxels);
  std::string flames;
  for (int f = 0; f < 3; ++f) {
    recon::FlameOptions options;
    options.seed = static_cast<std::uint64_t>(f + 1);
    options.absorber = recon::Absorber::soot;
    const recon::FlameTruth truth = recon::Flame(options).at(Seconds(0), grid);
    const std::string name = fmt::format("flame-{}", f);
    fs::create_directories(folder / name);
    const Status written = recon::write_volume(truth.volume, folder / name / "volume.vdb");
    if (!written.ok()) throw std::runtime_error(written.error().message());
    flames +=
        fmt::format(R"({}{{"result": "{}", "position": [{}, {}, 0.3], "rotation": [0, 0, {}], "scale": 3}})",
                    f > 0 ? ", " : "", name, 0.45 * (f - 1), 0.3 * (f == 1), 40 * f);
  }
  std::ofstream(folder / "room.gltf") << room();
  std::ofstream(folder / "scene.json") << R"({"format": "emberlock scene", "version": 1, "flames": [)"
                                       << flames << R"(], "geometry": [{"file": "room.gltf"}],
 "camera": {"from": [0.3, -2.4, 0.9], "look_at": [0, 0, 0.45]}})"
                                       << '\n';
}

}  // namespace

int main(int argc, char** argv) try {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() > 2 && words[0] == "--device") {
    const Status drawn = draw(words[2], words[1], words.size() > 3 ? std::atoi(words[3].c_str()) : 10);
    if (!drawn.ok()) throw std::runtime_error(drawn.error().message());
  } else if (!words.empty() && words[0][0] != '-') {
    write(words[0], words.size() > 1 ? std::atoi(words[1].c_str()) : 128);
  } else {
    return std::fprintf(
               stderr, "usage: bench_scene FOLDER [VOXELS], bench_scene --device cpu|cuda FOLDER [FRAMES]\n"),
           2;
  }
  return 0;
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
