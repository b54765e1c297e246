// SPDX-License-Identifier: Apache-2.0
// From an edit to the first preview that shows it: ten views of the paper's flame, a picture of 320 pixels'
// width. For each kind of edit the median and the longest of nine, and by how much the preview changed where
// it changed most.
//   bench_stylize [VOXELS WIDTHxHEIGHT [THREADS]]
// Or an example to be stylized: a flame, and a teapot with something small inside as all of its views see it.
//   bench_stylize --example FOLDER
#include "apply/stylize.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/file.h"
#include "tests/support/scene_files.h"
#include "tests/support/stylized_flame.h"
#include "tests/support/teapot.h"

namespace {

using namespace emberlock;
using apply::Operation;

struct Kind {
  std::string name;
  std::function<std::vector<Operation>(int repeat)> edits;
};

double seconds(const std::function<void()>& act) {
  const auto begin = std::chrono::steady_clock::now();
  act();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void demand(const Status& status) {
  if (status) return;
  std::fprintf(stderr, "%s\n", status.error().message().c_str());
  std::exit(1);
}

void measure(apply::Stylization& run, const Kind& kind) {
  constexpr int kWidest = 320;
  constexpr int kRepeats = 9;
  std::vector<double> times;
  double least = 1e9;
  for (int n = 0; n < kRepeats; ++n) {
    const recon::RadianceImage before = run.preview(run.shown(), 0, kWidest);
    recon::RadianceImage after;
    const std::vector<Operation> edits = kind.edits(n);
    times.push_back(seconds([&] {
      for (const Operation& edit : edits) demand(run.apply(edit));
      demand(run.pass());
      after = run.preview(run.shown(), 0, kWidest);
    }));
    double most = 0;
    for (std::size_t i = 0; i < after.rgb.size(); ++i)
      most = std::max(most, std::abs(static_cast<double>(after.rgb[i] - before.rgb[i])));
    least = std::min(least, most);
  }
  std::sort(times.begin(), times.end());
  std::printf("  %-36s %4.0f ms, at most %4.0f; changes by %3.0f grey levels\n", kind.name.c_str(),
              1e3 * times[kRepeats / 2], 1e3 * times.back(), least);
}

void bench(int voxels, ImageSize image, int threads) {
  const test::ReconstructedFlame flame = test::reconstructed_flame(image, voxels, threads);
  const auto run = test::begin_stylization(flame, apply::Colours::flame, threads);
  const std::string& name = flame.scene.views[0].name;
  const double wide = image.width;
  const auto object = test::Teapot({0, 0, 0}).write_seen_by(flame.scene.views[0].camera,
                                                            test::folder_for("bench") / "teapot.png");
  for (int n = 0; n < 3; ++n) demand(run->pass());
  std::printf("%d voxels, %d x %d, a pass and a preview %.0f ms\n", voxels, image.width, image.height,
              1e3 * seconds([&] {
                demand(run->pass());
                static_cast<void>(run->preview(run->shown(), 0, 320));
              }));
  const auto at = [&](int n) { return Eigen::Vector2d((0.44 + 0.01 * n) * wide, 0.5 * image.height); };
  const apply::Region ball{apply::Region::Shape::ellipsoid, {0, 0, 0}, {0.05, 0.05, 0.05}, Meters(0.01)};
  const std::vector<Kind> kinds = {
      {"a stroke within the flame",
       [&](int n) {
         return std::vector<Operation>{
             apply::BrushEdit{name, {at(n)}, 0.03 * wide, apply::BrushEdit::Mode::add, 60}};
       }},
      {"an object in one view",
       [&](int n) {
         apply::ObjectEdit put;
         put.view = name;
         put.file = object;
         put.position = at(n);
         return std::vector<Operation>{put};
       }},
      {"light beyond the flame, in all views",
       [&](int n) {
         const Eigen::Vector3d place(0.06, 0.02 * n - 0.08, 0.03);
         std::vector<Operation> edits;
         for (const recon::View& view : flame.scene.views)
           if (view.role == recon::ViewRole::input)
             edits.emplace_back(apply::BrushEdit{
                 view.name, {view.camera.project(place)}, 0.03 * wide, apply::BrushEdit::Mode::add, 120});
         return edits;
       }},
      {"undo", [](int) { return std::vector<Operation>{apply::Undo{}}; }},
      {"a region cut",
       [&](int n) {
         apply::Region region = ball;
         region.center.z() = 0.01 * n - 0.04;
         return std::vector<Operation>{apply::RegionEdit{region, apply::Part::cut}};
       }},
      {"a region twice as bright",
       [&](int n) {
         apply::Region region = ball;
         region.center.z() = 0.01 * n - 0.04;
         return std::vector<Operation>{apply::BrightnessEdit{region, 2}};
       }},
  };
  for (const Kind& kind : kinds) measure(*run, kind);
}

/// FOLDER/scene/transforms.json, FOLDER/teapotN.png and FOLDER/edits.json.
void write_example(const std::filesystem::path& folder) {
  recon::PaperSceneOptions options;
  options.image = {480, 360};
  const recon::Scene scene = recon::paper_scene(options);
  demand(test::write_scene(scene, folder / "scene"));
  const test::Teapot teapot({0, 0, -0.02});
  apply::EditFile edits;
  edits.voxels = 96;
  edits.passes = 40;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const recon::View& view = scene.views[v];
    const std::string name = fmt::format("teapot{}.png", v);
    teapot.write_seen_by(view.camera, folder / name);
    apply::ObjectEdit put;
    put.view = fmt::format("view{}.png", v);
    put.file = name;
    put.position = {0.5 * options.image.width, 0.5 * options.image.height};
    edits.steps.push_back({0, put});
  }
  demand(write_file_atomically(folder / "edits.json", apply::to_json(edits)));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string(argv[1]) == "--example") {
    write_example(argv[2]);
    return 0;
  }
  const int threads = argc > 3 ? std::atoi(argv[3]) : 2;
  int width = 0;
  int height = 0;
  if (argc > 2 && std::sscanf(argv[2], "%dx%d", &width, &height) == 2) {
    bench(std::atoi(argv[1]), {width, height}, threads);
    return 0;
  }
  for (const int voxels : {64, 128})
    for (const ImageSize image : {ImageSize{320, 240}, ImageSize{640, 480}}) bench(voxels, image, threads);
}
