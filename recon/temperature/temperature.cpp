// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/temperature.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "recon/compute/pool.h"
#include "recon/temperature/joint_temperature.h"
#include "recon/temperature/self_absorption.h"

namespace emberlock::recon {
namespace {

constexpr double kShareThatIsRead = 0.005;  // of the brightest key point's emission
constexpr double kLeastShare = 2e-3;        // of a level: what the response and the march leave
constexpr double kAbsorptionShare = 0.5;    // of the extinction: how well pictures tell where it is
constexpr double kMostUncertain = 0.2;      // of a temperature
constexpr double kNoBody = 16;              // chi-square a freedom: four sigma
constexpr double kWhite = 254.5;            // levels
constexpr double kPaperColdest = 1000, kPaperHottest = 2300, kPaperOpacityOfAStep = 0.05;

enum class Fate : std::uint8_t { dark, told, colder, hotter, unclear, other, saturated };

float brightest_channel(const Volume& volume, std::size_t p) {
  return std::max({volume.emission[3 * p], volume.emission[3 * p + 1], volume.emission[3 * p + 2]});
}

/// Whether most of the input views that see a point are saturated where they see it.
class Saturation {
 public:
  explicit Saturation(const Scene& scene) {
    for (const View& view : scene.views) {
      if (view.role != ViewRole::input) continue;
      const bool any = view.bounds != nullptr || std::any_of(view.image->rgb.begin(), view.image->rgb.end(),
                                                             [](float v) { return v >= kWhite; });
      any_ = any_ || any;
      views_.push_back(&view);
    }
  }
  [[nodiscard]] bool at(const Eigen::Vector3d& point) const {
    if (!any_) return false;
    std::size_t seen = 0;
    std::size_t bound = 0;
    for (const View* view : views_) {
      if (!((view->camera.camera_from_world * point).z() > 0)) continue;
      const Eigen::Vector2d at = view->camera.project(point);
      const ImageSize size = view->image->size;
      if (!(at.x() >= 0 && at.y() >= 0 && at.x() < size.width && at.y() < size.height)) continue;
      const auto pixel = static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(size.width) +
                         static_cast<std::size_t>(at.x());
      ++seen;
      const float* rgb = &view->image->rgb[3 * pixel];
      const bool white = std::max({rgb[0], rgb[1], rgb[2]}) >= kWhite;
      bound += white || (view->bounds != nullptr && (*view->bounds)[pixel] != 0) ? 1 : 0;
    }
    return 2 * bound > seen;
  }

 private:
  std::vector<const View*> views_;
  bool any_ = false;
};

/// What a voxel shows, with its errors.
class Glows {
 public:
  Glows(const Reconstruction& done, const VolumeErrors& errors, const EmitterTable& table, SelfAbsorption own,
        double brightest)
      : volume_(done.volume),
        errors_(errors),
        own_(std::move(own)),
        paper_(table.emitter() == Emitter::paper),
        brightest_(brightest) {
    by_absorption_ = !paper_ && table.absolute() && !volume_.extinction.empty() &&
                     !errors.extinction.empty() && done.effects.scattering.order == Scattering::Order::none;
    opacity_ = -std::log1p(-kPaperOpacityOfAStep) / static_cast<double>(volume_.grid.edge);
  }
  [[nodiscard]] bool by_absorption() const { return by_absorption_; }

  [[nodiscard]] Glow at(std::size_t p) const {
    Glow glow;
    for (int c = 0; c < 3; ++c)
      glow.level[c] = static_cast<double>(volume_.emission[3 * p + static_cast<std::size_t>(c)]);
    Eigen::Matrix3d covariance = errors_.covariance(p);
    if (!own_.factor.empty()) {
      const Eigen::Vector3d factor = Eigen::Vector3f::Map(&own_.factor[3 * p]).cast<double>();
      glow.level = glow.level.cwiseProduct(factor);
      covariance = factor.asDiagonal() * covariance * factor.asDiagonal();
    }
    const double least = std::hypot(kLeastShare * glow.level.maxCoeff(), 1e-4 * brightest_);
    covariance.diagonal().array() += least * least;
    if (paper_) {
      glow.information(1, 1) = 1 / covariance(1, 1);
      glow.absorption = opacity_;
      glow.absorption_sigma = 1e-6 * opacity_;
      return glow;
    }
    glow.information = covariance.inverse();
    if (by_absorption_ && volume_.extinction[p] > 0) {
      glow.absorption = static_cast<double>(volume_.extinction[p]) / own_.reference;
      glow.absorption_sigma = std::hypot(static_cast<double>(errors_.extinction[p]) / own_.reference,
                                         kAbsorptionShare * glow.absorption);
    }
    return glow;
  }

 private:
  const Volume& volume_;
  const VolumeErrors& errors_;
  SelfAbsorption own_;
  bool paper_, by_absorption_ = false;
  double brightest_, opacity_ = 0;
};

Fate fate_of(const Reading& reading) {
  if (reading.told == Reading::Told::colder) return Fate::colder;
  if (reading.told == Reading::Told::hotter) return Fate::hotter;
  if (reading.told == Reading::Told::no) return Fate::unclear;
  if (reading.freedom > 0 && reading.chi_square > kNoBody * reading.freedom) return Fate::other;
  return reading.sigma < kMostUncertain * reading.kelvin ? Fate::told : Fate::unclear;
}

void count(TemperatureCounts& counts, Fate fate) {
  ++counts.emitting;
  switch (fate) {
    case Fate::told:
      ++counts.told;
      break;
    case Fate::colder:
      ++counts.colder;
      break;
    case Fate::hotter:
      ++counts.hotter;
      break;
    case Fate::other:
      ++counts.other;
      break;
    case Fate::saturated:
      ++counts.saturated;
      break;
    default:
      ++counts.unclear;
  }
}

/// The paper's convention has no scale where the response has none: the brightest green is its hottest.
CameraResponse scaled_for_paper(CameraResponse response, double brightest_green, double opacity) {
  if (response.absolute) return response;
  response.absolute = true;
  const EmitterLevels hottest = levels_of(response, Emitter::paper, Kelvin(kPaperHottest));
  const double shown = opacity * hottest.value[1] * std::exp(hottest.log_scale);
  if (shown > 0)
    for (std::vector<double>& channel : response.level)
      for (double& v : channel) v *= brightest_green / shown;
  return response;
}

EmitterTable table_for(const Reconstruction& done, const CameraResponse& response, Emitter emitter) {
  if (emitter != Emitter::paper) return {response, emitter};
  float green = 0;
  for (std::size_t p = 0; p < done.volume.grid.size(); ++p)
    green = std::max(green, done.volume.emission[3 * p + 1]);
  const double opacity = -std::log1p(-kPaperOpacityOfAStep) / static_cast<double>(done.volume.grid.edge);
  return {scaled_for_paper(response, static_cast<double>(green), opacity), emitter, Kelvin(kPaperColdest),
          Kelvin(kPaperHottest)};
}

/// Mean, percentiles and errors, weighted by emission.
void summarise(const Volume& volume, const std::vector<Fate>& fates, double least, TemperatureField& field) {
  TemperatureSummary& out = field.summary;
  struct Told {
    float kelvin, sigma, weight;
  };
  std::vector<Told> told;
  double weights = 0;
  for (std::size_t p = 0; p < fates.size(); ++p) {
    const float weight = brightest_channel(volume, p);
    if (static_cast<double>(weight) < least) continue;
    count(out.counts, fates[p]);
    if (fates[p] != Fate::told) continue;
    told.push_back({field.kelvin[p], field.sigma[p], weight});
    weights += static_cast<double>(weight);
    out.mean += static_cast<double>(weight) * static_cast<double>(field.kelvin[p]);
  }
  if (told.empty()) return;
  out.mean /= weights;
  const auto at_share = [&](double share, float Told::*value) {
    std::sort(told.begin(), told.end(), [&](const Told& a, const Told& b) { return a.*value < b.*value; });
    double sum = 0;
    for (const Told& t : told)
      if ((sum += static_cast<double>(t.weight)) >= share * weights) return static_cast<double>(t.*value);
    return static_cast<double>(told.back().*value);
  };
  out.low = at_share(0.05, &Told::kelvin);
  out.high = at_share(0.95, &Told::kelvin);
  out.sigma = at_share(0.5, &Told::sigma);
}

/// The joint solve's temperatures. What they and what was read differ by is part of their error: it shows
/// what the prior and a glow of this kind change, and a reading's own error doesn't hold that.
void take_together(const Scene& scene, const Reconstruction& done, const EmitterTable& table,
                   const ComputeOptions& compute, const Elapsed& elapsed, TemperatureField& field,
                   std::vector<Fate>& fates) {
  const std::vector<float> read = field.kelvin;
  if (std::none_of(read.begin(), read.end(), [](float kelvin) { return kelvin > 0; })) return;
  field.summary.joint = solve_together(scene, done, table, compute, elapsed, field.kelvin);
  for (std::size_t p = 0; p < read.size(); ++p) {
    if (!(read[p] > 0)) continue;
    float& kelvin = field.kelvin[p];
    float& sigma = field.sigma[p];
    sigma = std::hypot(sigma, kelvin - read[p]);
    const auto t = static_cast<double>(kelvin);
    if (!(t > table.coldest().value()))
      fates[p] = Fate::colder;
    else if (!(t < table.hottest().value()))
      fates[p] = Fate::hotter;
    else if (!(static_cast<double>(sigma) < kMostUncertain * t))
      fates[p] = Fate::unclear;
    if (fates[p] != Fate::told) kelvin = sigma = 0;
  }
}

enum class Together { yes, no };

TemperatureField read_all(const Scene& scene, const Reconstruction& done, const VolumeErrors& errors,
                          const CameraResponse& response, Emitter emitter, Together together,
                          const ComputeOptions& compute, const Elapsed& elapsed) {
  const Volume& volume = done.volume;
  const Grid& grid = volume.grid;
  TemperatureField field;
  TemperatureSummary& summary = field.summary;
  summary.emitter = emitter;
  summary.absolute = response.absolute;
  summary.opacity = emitter == Emitter::paper ? kPaperOpacityOfAStep : 0;
  summary.solves = errors.solves;
  summary.errors_time = errors.time;
  field.kelvin.resize(grid.size());
  field.sigma.resize(grid.size());
  const double brightest =
      static_cast<double>(*std::max_element(volume.emission.begin(), volume.emission.end()));
  if (!(brightest > 0)) return field;
  const Thermometer meter(table_for(done, response, emitter));
  SelfAbsorption own;
  if (emitter == Emitter::soot) own = self_absorption(scene, done, response, emitter, compute);
  const bool corrected = !own.factor.empty();
  const Glows glows(done, errors, meter.table(), std::move(own), brightest);
  summary.by_absorption = glows.by_absorption();
  const Saturation saturation(scene);
  std::vector<Fate> fates(grid.size(), Fate::dark);
  std::vector<std::array<double, 2>> chi(static_cast<std::size_t>(grid.nz));  // sum, degrees of freedom
  Pool(compute.threads).run(grid.nz, [&](int k) {
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const std::size_t p = grid.index(i, j, k);
        if (static_cast<double>(brightest_channel(volume, p)) < kShareThatIsRead * brightest) continue;
        const Eigen::Vector3d place = Eigen::Vector3f(grid.origin[0] + grid.edge * static_cast<float>(i),
                                                      grid.origin[1] + grid.edge * static_cast<float>(j),
                                                      grid.origin[2] + grid.edge * static_cast<float>(k))
                                          .cast<double>();
        const Reading reading = meter.read(glows.at(p));
        fates[p] = saturation.at(place) ? Fate::saturated : fate_of(reading);
        chi[static_cast<std::size_t>(k)][0] += reading.chi_square * (reading.freedom > 0 ? 1 : 0);
        chi[static_cast<std::size_t>(k)][1] += reading.freedom;
        if (fates[p] != Fate::told) continue;
        field.kelvin[p] = static_cast<float>(reading.kelvin);
        field.sigma[p] = static_cast<float>(reading.sigma);
      }
  });
  if (together == Together::yes && !corrected && can_solve_together(done.effects))
    take_together(scene, done, meter.table(), compute, elapsed, field, fates);
  std::array<double, 2> sum = {};
  for (const auto& c : chi) sum = {sum[0] + c[0], sum[1] + c[1]};
  summary.chi_square = sum[1] > 0 ? sum[0] / sum[1] : 0;
  summarise(volume, fates, kShareThatCounts * brightest, field);
  return field;
}

}  // namespace

TemperatureField temperature_of(const Scene& scene, const Reconstruction& done, const VolumeErrors& errors,
                                const CameraResponse& response, Emitter emitter,
                                const ComputeOptions& compute, const Elapsed& elapsed) {
  const bool paper = emitter == Emitter::paper;
  TemperatureField field = read_all(scene, done, errors, response, emitter,
                                    paper ? Together::no : Together::yes, compute, elapsed);
  if (paper || field.summary.counts.told == 0) return field;
  const Emitter other = emitter == Emitter::grey ? Emitter::soot : Emitter::grey;
  field.summary.if_other =
      read_all(scene, done, errors, response, other, Together::no, compute, elapsed).summary.mean;
  return field;
}

}  // namespace emberlock::recon
