// SPDX-License-Identifier: Apache-2.0
// The march and what stands around it, stage by stage, in the paper's set-up (recon/synthetic, paper_scene):
// ten views of 640 x 480, 128^3 voxels, and a table over voxels, views and threads. Where there is a GPU, its
// stages too; a repeat ends when the GPU is done.
//   bench_march [--benchmark_filter=REGEX]      voxels:512 runs only where a filter asks for it
// Google Benchmark's own columns are means. The counters hold the least wall and core time of the repeats,
// because a busy machine slows means:
//   ms, core_ms        a repeat's wall time; the CPU time of all threads together
//   samples/s          RGB samples by wall time; a sample marched there and back counts once
//   samples/s/core     the same by core seconds, as all that follow
//   GUPS               key points added to, 1e9 a second: 8 a sample of the adjoint
//   near_B/s           bytes of key points that the samples ask for, mostly met by the caches
//   far_B/s, of_triad  bytes from memory if each were fetched once a repeat, and over what the triad reaches;
//                      above 1 where the caches keep all of it from one repeat to the next
//   crossings/s/core   in the whole cube: samples that Joseph's method (1982) takes on the same rays, one at
//                      each plane of key points across the ray's main axis
//   peak_MB, start_MB  resident memory: most during the solve, and with the pictures alone before it
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <malloc.h>
#include <sys/resource.h>

#include "recon/adjust/choose_effects.h"
#include "recon/adjust/engine.h"
#include "recon/adjust/solver.h"
#include "recon/compute/cuda_device.h"
#include "recon/hull/hull.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "recon/views/flame_mask.h"

namespace {

using namespace emberlock;

constexpr double kSigma = 32.8;  // 1/m, the flame's own
constexpr double kKeyPoint = sizeof(recon::Rgba);

/// The least wall and core seconds of the repeats.
class Least {
 public:
  template <class Work>
  void operator()(const Work& work) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t core_start = std::clock();
    work();
    core = std::min(core, static_cast<double>(std::clock() - core_start) / CLOCKS_PER_SEC);
    wall = std::min(wall, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  double wall = std::numeric_limits<double>::infinity();
  double core = std::numeric_limits<double>::infinity();
};

template <class Work>
Least repeat(benchmark::State& state, const recon::ComputeOptions& compute, const Work& work) {
  Least least;
  for (auto _ : state)
    least([&] {
      work();
      if (compute.device == recon::Device::cuda) recon::finish_gpu_work();
    });
  state.counters["ms"] = 1e3 * least.wall;
  state.counters["core_ms"] = 1e3 * least.core;
  return least;
}

// --- memory

/// McCalpin's STREAM triad (1995), a = b + s c, over arrays that no cache holds; three words a step.
Least triad(int threads, int repeats) {
  constexpr std::size_t kWords = std::size_t{1} << 24;
  std::vector<float> a(kWords), b(kWords, 1.F), c(kWords, 2.F);
  recon::Pool pool(threads);
  Least least;
  for (int r = 0; r < repeats; ++r)
    least([&] {
      pool.run(64, [&](int task) {
        const recon::Slice part = recon::slice(kWords, 64, task);
        for (std::size_t i = part.begin; i < part.end; ++i) a[i] = b[i] + 3.F * c[i];
      });
      benchmark::DoNotOptimize(a.data());
      benchmark::ClobberMemory();
    });
  return least;
}
constexpr double kTriadBytes = 3.0 * sizeof(float) * (1 << 24);

/// Bytes a core second, measured once for each number of threads.
double triad_rate(int threads) {
  static std::map<int, double> rates;
  double& rate = rates[threads];
  if (rate == 0) rate = kTriadBytes / triad(threads, 10).core;
  return rate;
}

void bandwidth(benchmark::State& state) {
  const int threads = static_cast<int>(state.range(0));
  Least least;
  for (auto _ : state) least = triad(threads, 10);
  state.counters["B/s"] = kTriadBytes / least.wall;
  state.counters["B/s/core"] = kTriadBytes / least.core;
}

double peak_megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}
/// Makes the peak what is resident now, where the system lets a process do so; elsewhere it stays.
void reset_peak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

// --- scenes and problems

/// Input views on a circle, as paper_scene's ten, without a held-out one.
recon::Scene circle_scene(int views) {
  recon::Scene scene;
  scene.box = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)};
  const recon::FlameTruth truth = recon::Flame().at(Seconds(0), recon::grid_over(scene.box, 192));
  const double focal = 320 * std::numbers::sqrt3;  // 60 degrees across
  for (int i = 0; i < views; ++i) {
    const double a = 2 * std::numbers::pi * i / views;
    const double e = (i % 2 == 0 ? 1 : -1) * std::numbers::pi / 18;
    const Eigen::Vector3d at(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
    recon::View view{
        "camera " + std::to_string(i),
        recon::look_at({{640, 480}, focal, focal, 320, 240, {}}, 0.3 * at, Eigen::Vector3d::Zero()),
        {}};
    view.image = recon::share(recon::render_view(truth.volume, truth.medium, truth.effects, view.camera));
    scene.views.push_back(std::move(view));
  }
  return scene;
}

const recon::Scene& scene_of(int views) {
  static std::map<int, recon::Scene> scenes;
  const auto found = scenes.find(views);
  if (found != scenes.end()) return found->second;
  return scenes.emplace(views, views == 10 ? recon::paper_scene() : circle_scene(views)).first->second;
}

std::vector<const recon::View*> inputs(const recon::Scene& scene) {
  std::vector<const recon::View*> views;
  for (const recon::View& view : scene.views)
    if (view.role == recon::ViewRole::input) views.push_back(&view);
  return views;
}

recon::ComputeOptions on_cpu(int threads) { return {recon::Device::cpu, threads}; }
const recon::ComputeOptions kOnGpu = {recon::Device::cuda};
std::string suffix(const recon::ComputeOptions& compute) {
  return compute.device == recon::Device::cuda ? "/cuda" : "/threads:" + std::to_string(compute.threads);
}

recon::Hull carved(const recon::Scene& scene, const recon::Grid& grid, int threads) {
  return recon::carve(scene, recon::flame_masks(scene), grid, on_cpu(threads)).value();
}

struct Setup {
  int voxels = 128;
  int views = 10;
  bool cube = false;  ///< the whole grid is medium, as others' projectors take it
  bool operator==(const Setup&) const = default;
};

/// The last one asked for is kept: a large problem takes gigabytes.
std::optional<std::pair<Setup, recon::Problem>>& kept_problem() {
  static std::optional<std::pair<Setup, recon::Problem>> kept;
  return kept;
}
const recon::Problem& problem_of(const Setup& setup) {
  auto& kept = kept_problem();
  if (kept && kept->first == setup) return kept->second;
  kept.reset();
  const recon::Scene& scene = scene_of(setup.views);
  const recon::Grid grid = recon::grid_over(scene.box, setup.voxels);
  recon::Pool pool(0);
  kept.emplace(
      setup, recon::make_problem(inputs(scene), setup.cube ? recon::whole_grid(grid) : carved(scene, grid, 0),
                                 {}, pool));
  return kept->second;
}

struct Counts {
  double samples = 0, crossings = 0, key_points = 0, ray_bytes = 0;
};
Counts count(const recon::Problem& problem) {
  Counts counts;
  for (const recon::Run& run : problem.list.runs) {
    const float* d = problem.list.rays[run.ray].direction;
    const float main_axis = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
    counts.samples += run.count;
    counts.crossings += static_cast<double>(static_cast<float>(run.count) * run.step * main_axis);
  }
  counts.key_points = static_cast<double>(
      std::count_if(problem.share.begin(), problem.share.end(), [](float s) { return s > 0; }));
  counts.ray_bytes =
      static_cast<double>(problem.list.rays.size() * (sizeof(recon::MarchRay) + sizeof(recon::Rgba)) +
                          problem.list.runs.size() * sizeof(recon::Run));
  return counts;
}

// --- stages of the engine

enum class Stage { forward, adjoint, joint, update, iteration };
constexpr const char* kStageNames[] = {"forward", "adjoint", "joint", "update", "iteration"};
constexpr const char* kAbsorbNames[] = {"none", "constant", "field"};

struct Case {
  Stage stage;
  recon::Absorb absorb;
  Setup setup = {};
  recon::ComputeOptions compute = on_cpu(1);
  [[nodiscard]] bool goes_there() const { return stage != Stage::adjoint && stage != Stage::update; }
  [[nodiscard]] bool comes_back() const { return stage != Stage::forward && stage != Stage::update; }
  [[nodiscard]] bool updates() const { return stage == Stage::update || stage == Stage::iteration; }
};

struct Bytes {
  double near = 0, far = 0;
};
Bytes moved(const Case& c, const Counts& n) {
  const double kept_samples =
      c.absorb == recon::Absorb::field && c.stage != Stage::forward ? n.samples * kKeyPoint : 0;
  Bytes bytes;
  if (c.goes_there()) {
    bytes.near += 8 * kKeyPoint * n.samples;
    bytes.far += n.ray_bytes + kKeyPoint * n.key_points + kept_samples;
  }
  if (c.comes_back()) {  // adds: each key point is read and written
    bytes.near += 16 * kKeyPoint * n.samples;
    bytes.far += n.ray_bytes + 2 * kKeyPoint * n.key_points + kept_samples;
  }
  if (c.updates())  // x and gradient read and written, y read, the next y written, a weight
    bytes.far += (6 * kKeyPoint + sizeof(float)) * n.key_points;
  return bytes;
}

std::unique_ptr<recon::Engine> engine_for(const Case& c, const recon::Problem& problem, recon::Pool& pool) {
  const auto sigma = static_cast<float>(kSigma) * problem.grid().edge;
  recon::Optics optics = recon::absorbing_optics(c.absorb == recon::Absorb::constant ? sigma : 0);
  optics.absorb = c.absorb;
  auto engine = recon::make_engine(problem, optics, recon::Precision::float32, pool);
  engine->set(std::vector<recon::Rgba>(problem.grid().size(), recon::Rgba{{3, 2, 1, sigma}}));
  std::vector<float> weights(problem.share);
  for (float& w : weights) w = w > 0 ? 1 : 0;
  engine->set_weights(weights);
  if (c.absorb == recon::Absorb::field)
    engine->set_field(weights, std::vector<float>(problem.grid().size(), sigma));
  engine->residual(0);  // what the adjoint alone starts from
  return engine;
}

void work(recon::Engine& engine, const Case& c) {
  constexpr recon::Engine::Step kSmall = {1e-7F, 0.5F};  // stays where it is, near enough
  if (c.stage == Stage::forward) {
    engine.project(0);
    return;
  }
  if (c.goes_there()) engine.residual(0);
  if (c.comes_back()) engine.backproject(0);
  if (c.updates()) engine.stiffen(1e-3F, 1);
  if (c.updates() && c.absorb == recon::Absorb::field) engine.descend_field({kSmall, 1e-3F, 1e-3F, 0.3F});
  if (c.updates() && c.absorb != recon::Absorb::field) engine.descend(kSmall);
}

void run_stage(benchmark::State& state, const Case& c) {
  const recon::Problem& problem = problem_of(c.setup);
  const Counts n = count(problem);
  recon::Pool pool(c.compute);
  const auto engine = engine_for(c, problem, pool);
  const Least least = repeat(state, c.compute, [&] { work(*engine, c); });
  if (c.compute.device == recon::Device::cuda) {
    state.counters["samples/s"] = n.samples / least.wall;
    return;
  }
  const double memory = triad_rate(c.compute.threads);
  const Bytes bytes = moved(c, n);
  state.counters["far_B/s"] = bytes.far / least.core;
  state.counters["of_triad"] = bytes.far / least.core / memory;
  if (c.stage == Stage::update) {
    state.counters["key_points/s"] = n.key_points / least.wall;
    return;
  }
  state.counters["samples"] = n.samples;
  state.counters["runs"] = static_cast<double>(problem.list.runs.size());
  state.counters["rays"] = static_cast<double>(problem.list.rays.size());
  state.counters["samples/s"] = n.samples / least.wall;
  state.counters["samples/s/core"] = n.samples / least.core;
  state.counters["near_B/s"] = bytes.near / least.core;
  if (c.stage == Stage::adjoint) state.counters["GUPS"] = 8e-9 * n.samples / least.core;
  if (c.setup.cube) state.counters["crossings/s/core"] = n.crossings / least.core;
}

// --- hull, pictures, whole frames

void masks(benchmark::State& state, const recon::ComputeOptions& compute) {
  const recon::Scene& scene = scene_of(10);
  const auto pictures = recon::flame_masks(scene, {}, compute);  // a GPU keeps their copies
  repeat(state, compute, [&] { benchmark::DoNotOptimize(recon::flame_masks(scene, {}, compute)); });
}

void hull(benchmark::State& state, const recon::ComputeOptions& compute) {
  const recon::Scene& scene = scene_of(10);
  const auto flames = recon::flame_masks(scene, {}, compute);
  const recon::Grid grid = recon::grid_over(scene.box, 128);
  repeat(state, compute, [&] { benchmark::DoNotOptimize(recon::carve(scene, flames, grid, compute)); });
}

void hull_and_rays(benchmark::State& state, const recon::ComputeOptions& compute) {
  const recon::Scene& scene = scene_of(10);
  const auto flames = recon::flame_masks(scene, {}, compute);
  const recon::Grid grid = recon::grid_over(scene.box, 128);
  recon::Pool pool(compute);
  std::size_t rays = 0;
  repeat(state, compute, [&] {
    const recon::Hull medium = recon::carve(scene, flames, grid, compute).value();
    rays = recon::make_problem(inputs(scene), medium, {}, pool).rays();
  });
  state.counters["rays"] = static_cast<double>(rays);
}

void render(benchmark::State& state, recon::Absorb absorb, const recon::ComputeOptions& compute) {
  const recon::Scene& scene = scene_of(10);
  const recon::Grid grid = recon::grid_over(scene.box, 128);
  const recon::Hull medium = carved(scene, grid, 0);
  recon::Volume volume{grid, std::vector<float>(3 * grid.size(), 1000.F), {}};
  recon::Effects effects;
  if (absorb != recon::Absorb::nothing) effects = recon::absorbing(PerMeter(kSigma));
  if (absorb == recon::Absorb::field) {
    effects.extinction.model = recon::Extinction::Model::field;
    volume.extinction.assign(grid.size(), static_cast<float>(kSigma));
  }
  recon::RenderOptions options;
  options.compute = compute;
  const recon::CameraModel& camera = scene.views.back().camera;
  repeat(state, compute,
         [&] { benchmark::DoNotOptimize(recon::render_view(volume, medium, effects, camera, options)); });
}

/// From pictures to a volume, its extinction told or found first.
void frame(benchmark::State& state, bool told, int voxels, const recon::ComputeOptions& compute) {
  kept_problem().reset();
  const recon::Scene& scene = scene_of(10);
  const recon::Grid grid = recon::grid_over(scene.box, voxels);
  recon::SolveOptions options;
  options.compute = compute;
  reset_peak();
  state.counters["start_MB"] = peak_megabytes();
  repeat(state, compute, [&] {
    recon::Effects effects = recon::absorbing(PerMeter(kSigma));
    if (!told) effects = recon::choose_effects(scene, grid, {}, options).value().effects;
    benchmark::DoNotOptimize(recon::solve(scene, grid, effects, options));
  });
  state.counters["peak_MB"] = peak_megabytes();
}

// --- the list of them all

benchmark::internal::Benchmark* add(const std::string& name, int repeats, auto work, auto... arguments) {
  return benchmark::RegisterBenchmark(name.c_str(), work, arguments...)
      ->Unit(benchmark::kMillisecond)
      ->Iterations(repeats)
      ->MeasureProcessCPUTime();
}

void add_stage(const std::string& prefix, const Case& c, int repeats) {
  add(prefix + kStageNames[static_cast<int>(c.stage)] + "/" + kAbsorbNames[static_cast<int>(c.absorb)] +
          suffix(c.compute),
      repeats, run_stage, c);
}

void add_paper_setup(const recon::ComputeOptions& compute) {
  const std::string on = suffix(compute);
  for (const bool told : {true, false})
    add((told ? "solve/told" : "solve/auto") + on, 2, frame, told, 128, compute);
  for (const recon::Absorb absorb : {recon::Absorb::nothing, recon::Absorb::constant, recon::Absorb::field}) {
    for (const Stage stage : {Stage::forward, Stage::adjoint, Stage::joint, Stage::update, Stage::iteration})
      add_stage("", {stage, absorb, {}, compute}, 8);
    add("render_view/" + std::string(kAbsorbNames[static_cast<int>(absorb)]) + on, 8, render, absorb,
        compute);
  }
  add("masks" + on, 4, masks, compute);
  add("hull" + on, 4, hull, compute);
  add("hull_and_rays" + on, 4, hull_and_rays, compute);
}

void add_cube(const recon::ComputeOptions& compute) {
  for (const recon::Absorb absorb : {recon::Absorb::nothing, recon::Absorb::constant})
    for (const Stage stage : {Stage::forward, Stage::adjoint})
      add_stage("cube/", {stage, absorb, {128, 10, true}, compute}, 3);
}

void add_table() {
  for (const int voxels : {64, 128, 192, 256, 512})
    for (const int views : {4, 10, 16, 28})
      for (const int threads : {1, 2})
        add_stage("voxels:" + std::to_string(voxels) + "/views:" + std::to_string(views) + "/",
                  {Stage::iteration, recon::Absorb::constant, {voxels, views, false}, on_cpu(threads)}, 3);
}

void add_gpu_table() {
  for (const int voxels : {64, 256})
    for (const Stage stage : {Stage::forward, Stage::adjoint, Stage::iteration})
      add_stage("voxels:" + std::to_string(voxels) + "/",
                {stage, recon::Absorb::constant, {voxels, 10, false}, kOnGpu}, 8);
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::AddCustomContext("march", recon::march_table_name());
  add("triad", 1, bandwidth)->ArgName("threads")->Arg(1)->Arg(2);
  for (const int threads : {1, 2}) add_paper_setup(on_cpu(threads));
  add("solve/told/voxels:256/threads:2", 1, frame, true, 256, on_cpu(2));
  add_cube(on_cpu(1));
  add_table();
  if (recon::cuda_status().ok()) {
    add_paper_setup(kOnGpu);
    add_cube(kOnGpu);
    add_gpu_table();
  }
  const bool asked = !benchmark::GetBenchmarkFilter().empty();
  benchmark::RunSpecifiedBenchmarks(asked ? benchmark::GetBenchmarkFilter() : "-voxels:512");
}
