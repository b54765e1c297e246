// SPDX-License-Identifier: Apache-2.0
#include "recon/synthetic/flame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>

#include "base/random.h"
#include "recon/compute/pool.h"
#include "recon/render/render.h"

namespace emberlock::recon {
namespace {

constexpr int kTable = 64;          // noise samples a period, along each axis
constexpr double kPeriod = 0.5;     // of the noise, in flame heights
constexpr float kFaintest = 0.02F;  // of the densest: less is outside the medium

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.F, 1.F);
  return t * t * (3 - 2 * t);
}

/// One plume of the envelope, in units of the flame's height; z runs from 0 at the root to 1 at the tip of
/// the tallest.
struct Plume {
  float x, y, height, radius;
};

std::vector<Plume> plumes(FlameShape shape) {
  if (shape == FlameShape::plume) return {{0, 0, 1, 0.20F}};
  return {{-0.10F, 0.02F, 1, 0.15F}, {0.19F, -0.03F, 0.62F, 0.11F}};
}

/// Narrow root, belly in the lower third, tapering tip; 1 at its widest.
float envelope(float h) { return 1.72F * std::pow(h, 0.35F) * std::pow(1 - h, 0.75F); }

}  // namespace

struct Flame::Noise {
  std::vector<float> values = std::vector<float>(static_cast<std::size_t>(kTable) * kTable * kTable);

  explicit Noise(std::uint64_t seed) {
    Pool pool(0);
    pool.run(kTable, [&](int z) {
      for (int y = 0; y < kTable; ++y)
        for (int x = 0; x < kTable; ++x) values[index(x, y, z)] = fractal(seed, x, y, z);
    });
  }

  /// In about -1..1; x, y, z in periods.
  [[nodiscard]] float operator()(float x, float y, float z) const {
    const std::array<float, 3> p = {x * kTable, y * kTable, z * kTable};
    std::array<int, 3> i{};
    std::array<float, 3> f{};
    for (std::size_t a = 0; a < 3; ++a) {
      const float low = std::floor(p[a]);
      i[a] = static_cast<int>(low);
      f[a] = p[a] - low;
    }
    const auto row = [&](int dy, int dz) {
      const float v = values[index(i[0], i[1] + dy, i[2] + dz)];
      return v + f[0] * (values[index(i[0] + 1, i[1] + dy, i[2] + dz)] - v);
    };
    const float near = row(0, 0) + f[1] * (row(1, 0) - row(0, 0));
    const float far = row(0, 1) + f[1] * (row(1, 1) - row(0, 1));
    return near + f[2] * (far - near);
  }

 private:
  static std::size_t index(int x, int y, int z) {
    constexpr int kMask = kTable - 1;
    const int at = ((z & kMask) * kTable + (y & kMask)) * kTable + (x & kMask);
    return static_cast<std::size_t>(at);
  }

  /// Periodic value noise, three octaves.
  static float fractal(std::uint64_t seed, int x, int y, int z) {
    float sum = 0;
    float amplitude = 1;
    for (int cells = 4; cells <= 16; cells *= 2) {
      sum += amplitude * lattice(seed + static_cast<std::uint64_t>(cells), cells, x, y, z);
      amplitude *= 0.5F;
    }
    return sum / 1.1F;
  }

  static float lattice(std::uint64_t seed, int cells, int x, int y, int z) {
    const int width = kTable / cells;
    const auto corner = [&](int cx, int cy, int cz) {
      const int wrap = cells - 1;
      const int at = ((cz & wrap) * cells + (cy & wrap)) * cells + (cx & wrap);
      return static_cast<float>(2 * random_uniform(seed, 0, static_cast<std::uint64_t>(at)) - 1);
    };
    const auto fade = [&](int v) {
      return smooth_step(0, 1, static_cast<float>(v % width) / static_cast<float>(width));
    };
    const int i = x / width;
    const int j = y / width;
    const int k = z / width;
    const auto line = [&](int dy, int dz) {
      return std::lerp(corner(i, j + dy, k + dz), corner(i + 1, j + dy, k + dz), fade(x));
    };
    return std::lerp(std::lerp(line(0, 0), line(1, 0), fade(y)), std::lerp(line(0, 1), line(1, 1), fade(y)),
                     fade(z));
  }
};

namespace {

/// How much medium there is at a point, how strongly it emits and how hot it is, all 0..1; lengths in flame
/// heights. The hollow root and the dark pockets are medium that hardly emits: cool soot.
struct Field {
  const std::vector<Plume>& plumes;
  float carried;  ///< how far the turbulence has risen, flame heights

  template <class Noise>
  void at(const Noise& noise, float x, float y, float z, float& medium, float& emission, float& heat) const {
    constexpr float kScale = static_cast<float>(1 / kPeriod);
    medium = emission = heat = 0;
    const float rise = (z - carried) * kScale;
    for (const Plume& plume : plumes) {
      const float h = z / plume.height;
      if (h <= 0 || h >= 1) continue;
      const float radius = plume.radius * envelope(h);
      // The whole plume sways more the higher it is, the slower part of the noise doing the pushing.
      const float dx = x - plume.x - 0.10F * h * noise(0.13F, 0.71F, 0.4F * rise);
      const float dy = y - plume.y - 0.10F * h * noise(0.57F, 0.29F, 0.4F * rise + 0.5F);
      const float r = std::sqrt(dx * dx + dy * dy);
      if (r > 1.7F * radius) continue;
      const float turbulence = noise(x * kScale, y * kScale, rise);
      const float q = r / radius + (0.15F + 0.35F * h) * turbulence;
      const float body = smooth_step(1.0F, 0.55F, q);
      const float hollow = 1 - 0.85F * smooth_step(0.75F, 0.15F, q) * smooth_step(0.45F, 0.1F, h);
      const float holes =
          smooth_step(-0.62F, -0.3F, noise(1.7F * x * kScale + 0.3F, 1.7F * y * kScale, 1.1F * rise));
      const float tip = 0.35F + 0.65F * smooth_step(1, 0.5F, h);
      const float here = body * tip;
      if (here <= medium) continue;
      medium = here;
      emission = here * hollow * holes;
      heat = std::clamp(body * (1.15F - 0.75F * h) + 0.2F * turbulence, 0.F, 1.F);
    }
  }
};

/// Yellow where hot, orange, then deep red where it cools.
std::array<float, 3> colour(float heat) {
  return {0.75F + 0.25F * heat, 0.16F + 0.62F * heat * heat, 0.02F + 0.30F * heat * heat * heat};
}

Intrinsics pinhole(ImageSize size, double field_of_view_degrees) {
  const double f = size.width / 2.0 / std::tan(field_of_view_degrees * 3.14159265358979 / 360);
  return {size, f, f, size.width / 2.0, size.height / 2.0, {}};
}

/// On a sphere around the origin, angles in degrees.
Eigen::Vector3d on_sphere(double radius, double azimuth, double elevation) {
  const double a = azimuth * 3.14159265358979 / 180;
  const double e = elevation * 3.14159265358979 / 180;
  return radius * Eigen::Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
}

/// Scales values so that their mean over the burning key points is `mean`.
void scale_mean(std::vector<float>& values, const std::vector<std::uint8_t>& burning, PerMeter mean) {
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  const auto count = static_cast<double>(std::count(burning.begin(), burning.end(), 1));
  if (sum <= 0) return;
  const auto scale = static_cast<float>(mean.value() * count / sum);
  for (float& v : values) v *= scale;
}

void add_noise(RadianceImage& image, double sigma, std::uint64_t seed, std::uint64_t view) {
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = std::max(0.F, image.rgb[i] + static_cast<float>(sigma * random_normal(seed, view, i)));
}

void add_part(RadianceImage& sum, const RadianceImage& image, float part) {
  for (std::size_t i = 0; i < sum.rgb.size(); ++i) sum.rgb[i] += part * image.rgb[i];
}

/// Number of instants that an exposure is made of: between them the flame rises by about a voxel of the
/// truth.
int instants_of(const PaperSceneOptions& options) {
  const double rise = std::abs(options.flame.rise_speed) * options.exposure.value();
  const double voxel = 0.2 / options.truth_voxels;
  return std::clamp(static_cast<int>(std::ceil(rise / voxel)), 1, 32);
}

/// Each view sees the mean of its exposure's instants. Views of one lateness share the truth.
void film(const Flame& flame, const PaperSceneOptions& options, Scene& scene) {
  const Grid grid = grid_over(scene.box, options.truth_voxels);
  RenderOptions march;
  march.step = options.truth_step;
  std::set<Seconds> delays;
  for (const View& view : scene.views) delays.insert(view.lateness);
  std::vector<RadianceImage> images;
  images.reserve(scene.views.size());
  for (const View& view : scene.views) images.emplace_back(view.camera.intrinsics.size);
  const int instants = instants_of(options);
  for (const Seconds late : delays)
    for (int i = 0; i < instants; ++i) {
      const Seconds time = options.time + late + options.exposure * ((i + 0.5) / instants - 0.5);
      const FlameTruth truth = flame.at(time, grid);
      for (std::size_t v = 0; v < images.size(); ++v)
        if (scene.views[v].lateness == late)
          add_part(images[v],
                   render_view(truth.volume, truth.medium, truth.effects, scene.views[v].camera, march),
                   1 / static_cast<float>(instants));
    }
  for (std::size_t v = 0; v < images.size(); ++v) {
    if (options.noise > 0) add_noise(images[v], options.noise, options.flame.seed, v);
    scene.views[v].image = share(std::move(images[v]));
  }
}

/// Long before and long after `time` the flame is another one of its kind.
void film_average(const Flame& flame, const PaperSceneOptions& options, Scene& scene) {
  constexpr double kRate = 24;
  constexpr int kVoxels = 96;  // an average is smooth
  const Grid grid = grid_over(scene.box, std::min(kVoxels, options.truth_voxels));
  std::vector<RadianceImage> averages;
  for (const View& view : scene.views) averages.emplace_back(view.image->size);
  const auto part = 1 / static_cast<float>(options.averaged_frames);
  const int before = options.averaged_frames / 2;
  for (int frame = 0; frame < options.averaged_frames; ++frame) {
    const Seconds time = options.time + Seconds((frame - before) / kRate);
    const FlameTruth truth = flame.at(time, grid);
    for (std::size_t v = 0; v < averages.size(); ++v) {
      add_part(averages[v], render_view(truth.volume, truth.medium, truth.effects, scene.views[v].camera),
               part);
    }
  }
  for (std::size_t v = 0; v < averages.size(); ++v) scene.views[v].average = share(std::move(averages[v]));
}

}  // namespace

Flame::Flame(const FlameOptions& options) : options_(options), noise_(std::make_unique<Noise>(options.seed)) {
  // The gain comes from two small pictures at time 0.
  const double height = options.height.value();
  const FlameTruth truth =
      at(Seconds(0), grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(1.3 * height)}, 48));
  float brightest = 0;
  for (const double azimuth : {0.0, 90.0}) {
    const CameraModel camera =
        look_at(pinhole({96, 96}, 60), on_sphere(2 * height, azimuth, 0), Eigen::Vector3d::Zero());
    const RadianceImage image = render_view(truth.volume, truth.medium, truth.effects, camera);
    brightest = std::max(brightest, *std::max_element(image.rgb.begin(), image.rgb.end()));
  }
  if (brightest > 0) gain_ = options.peak / static_cast<double>(brightest);
}

Flame::Flame(Flame&&) noexcept = default;
Flame& Flame::operator=(Flame&&) noexcept = default;
Flame::~Flame() = default;

const FlameOptions& Flame::options() const { return options_; }

FlameTruth Flame::at(Seconds time, const Grid& grid) const {
  FlameTruth truth{{grid, std::vector<float>(3 * grid.size()), {}}, whole_grid(grid), {}};
  truth.effects.extinction = constant_extinction(options_.extinction);
  truth.effects.scattering = options_.scattering;
  const bool soot = options_.absorber == Absorber::soot && options_.extinction.value() > 0;
  if (soot) {
    truth.effects.extinction.model = Extinction::Model::field;
    truth.volume.extinction.resize(grid.size());
  }
  const double height = options_.height.value();
  const std::vector<Plume> shapes = plumes(options_.shape);
  const Field field{
      shapes, static_cast<float>(wrap_positive(time.value() * options_.rise_speed / height, kPeriod * 10))};
  const auto scale = static_cast<float>(1 / height);
  const auto gain = static_cast<float>(gain_);
  std::vector<std::uint8_t> burning(grid.size());
  Pool pool(0);
  pool.run(grid.nz, [&](int k) {
    const float z = (grid.origin[2] + static_cast<float>(k) * grid.edge) * scale + 0.5F;
    for (int j = 0; j < grid.ny; ++j) {
      const float y = (grid.origin[1] + static_cast<float>(j) * grid.edge) * scale;
      for (int i = 0; i < grid.nx; ++i) {
        const float x = (grid.origin[0] + static_cast<float>(i) * grid.edge) * scale;
        if (x * x + y * y > 0.25F) continue;
        float medium = 0;
        float emission = 0;
        float heat = 0;
        field.at(*noise_, x, y, z, medium, emission, heat);
        if (medium < kFaintest) continue;
        const std::size_t at = grid.index(i, j, k);
        burning[at] = 1;
        if (soot) truth.volume.extinction[at] = medium;
        const std::array<float, 3> c = colour(heat);
        for (std::size_t a = 0; a < 3; ++a) truth.volume.emission[3 * at + a] = gain * 1000 * emission * c[a];
      }
    }
  });
  if (soot) scale_mean(truth.volume.extinction, burning, options_.extinction);
  Hull& medium = truth.medium;
  std::size_t voxel = 0;
  medium.count = 0;
  for (int k = 0; k < grid.nz - 1; ++k)
    for (int j = 0; j < grid.ny - 1; ++j)
      for (int i = 0; i < grid.nx - 1; ++i) {
        int corners = 0;
        for (int c = 0; c < 8; ++c)
          corners += burning[grid.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))];
        medium.inside[voxel++] = corners > 0 ? 1 : 0;
        medium.count += corners > 0 ? 1 : 0;
      }
  return truth;
}

Scene paper_scene(const PaperSceneOptions& options) {
  std::vector<View> views;
  const Intrinsics intrinsics = pinhole(options.image, 60);
  const auto place = [&](const std::string& name, double azimuth, double elevation, ViewRole role) {
    View view{
        name, look_at(intrinsics, on_sphere(0.3, azimuth, elevation), Eigen::Vector3d::Zero()), {}, role};
    const std::size_t i = views.size();
    view.lateness = i < options.lateness.size() ? options.lateness[i] : Seconds(0);
    views.push_back(std::move(view));
  };
  const double step = 360.0 / options.cameras;
  const double first = 90 - (std::round(options.cameras / 4.0) - 0.5) * step;
  for (int i = 0; i < options.cameras; ++i)
    place("camera " + std::to_string(i), first + step * i, i % 2 == 0 ? 10 : -10, ViewRole::input);
  place("test view", 90, 0, ViewRole::held_out);
  return filmed_scene(std::move(views), options);
}

Scene filmed_scene(std::vector<View> views, const PaperSceneOptions& options) {
  Scene scene;
  scene.box = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)};
  scene.views = std::move(views);
  const Flame flame(options.flame);
  film(flame, options, scene);
  if (options.averaged_frames > 0) film_average(flame, options, scene);
  return scene;
}

}  // namespace emberlock::recon
