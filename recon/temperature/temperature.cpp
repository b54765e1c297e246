// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/temperature.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <string>

#include <Eigen/Dense>

#include "recon/adjust/guard.h"
#include "recon/compute/pool.h"
#include "recon/temperature/joint_temperature.h"
#include "recon/temperature/model_errors.h"
#include "recon/temperature/self_absorption.h"
#include "recon/temperature/unmixing.h"
#include "recon/temperature/view_errors.h"
#include "recon/temperature/voxel_glow.h"

namespace emberlock::recon {
namespace {

constexpr double kShareThatIsRead = 0.005;  // of the brightest key point's emission
constexpr double kMostUncertain = 0.2;      // of a temperature
constexpr double kShareOfOthers = 0.01;     // of what was read, which no soot shows: a line is looked for
constexpr std::size_t kMostJudged = 2000;   // glows by which a line is chosen

enum class Fate : std::uint8_t { dark, told, mixed, colder, hotter, unclear, other, saturated, lines, alike };

float brightest_channel(const Volume& volume, std::size_t p) {
  return std::max({volume.emission[3 * p], volume.emission[3 * p + 1], volume.emission[3 * p + 2]});
}

Fate fate_of(const Reading& reading) {
  if (reading.told == Reading::Told::colder) return Fate::colder;
  if (reading.told == Reading::Told::hotter) return Fate::hotter;
  if (reading.told == Reading::Told::no) return Fate::unclear;
  if (reading.freedom > 0 && reading.chi_square > kNoBody * reading.freedom) return Fate::other;
  return reading.sigma < kMostUncertain * reading.kelvin ? Fate::told : Fate::unclear;
}

Fate fate_of(const Unmixed& unmixed) {
  switch (unmixed.kind) {
    case Unmixed::Kind::lines:
      return Fate::lines;
    case Unmixed::Kind::alike:
      return Fate::alike;
    case Unmixed::Kind::neither:
      return Fate::other;
    case Unmixed::Kind::unknown:
      return Fate::unclear;
    default:
      break;
  }
  const Fate fate = fate_of(unmixed.reading);
  return fate == Fate::told && unmixed.kind == Unmixed::Kind::mixed ? Fate::mixed : fate;
}

void count(TemperatureCounts& counts, Fate fate) {
  ++counts.emitting;
  switch (fate) {
    case Fate::told:
      ++counts.told;
      break;
    case Fate::mixed:
      ++counts.told;
      ++counts.mixed;
      break;
    case Fate::lines:
      ++counts.lines;
      break;
    case Fate::alike:
      ++counts.alike;
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

/// What was read of a volume, before it is summed up.
struct Readings {
  TemperatureField field;
  std::vector<Fate> fates = {};
  bool corrected = false;  ///< for soot's own absorption
};

/// Counts, mean, percentiles and errors, weighted by emission.
TemperatureField summed_up(const Volume& volume, Readings readings) {
  TemperatureField& field = readings.field;
  const std::vector<Fate>& fates = readings.fates;
  TemperatureSummary& out = field.summary;
  const double least = kShareThatCounts *
                       static_cast<double>(*std::max_element(volume.emission.begin(), volume.emission.end()));
  struct Told {
    float kelvin, sigma, weight;
  };
  std::vector<Told> told;
  double weights = 0;
  double light = 0;
  for (std::size_t p = 0; p < fates.size(); ++p) {
    const float weight = brightest_channel(volume, p);
    if (static_cast<double>(weight) < least) continue;
    count(out.counts, fates[p]);
    const float* rgb = &volume.emission[3 * p];
    const auto all = static_cast<double>(rgb[0] + rgb[1] + rgb[2]);
    light += all;
    for (std::size_t i = 0; i < out.lines.size(); ++i) {
      const float share = field.line_share[i][p];
      out.lines[i].share += static_cast<double>(share) * all;
      out.lines[i].seen += share > 0 ? 1 : 0;
    }
    if (fates[p] != Fate::told && fates[p] != Fate::mixed) continue;
    told.push_back({field.kelvin[p], field.sigma[p], weight});
    weights += static_cast<double>(weight);
    out.mean += static_cast<double>(weight) * static_cast<double>(field.kelvin[p]);
  }
  for (LineSummary& line : out.lines) line.share /= std::max(1e-30, light);
  if (told.empty()) return std::move(field);
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
  return std::move(field);
}

/// What the lines show; the field's lists of their shares, still 0.
std::vector<std::array<double, 3>> look_for(const std::vector<const LineEmitter*>& named,
                                            const CameraResponse& response, const EmitterTable& table,
                                            TemperatureField& field) {
  std::vector<std::array<double, 3>> shown;
  for (const LineEmitter* line : named) {
    shown.push_back(levels_of(response, *line));
    field.line_share.emplace_back(field.kelvin.size());
    const std::optional<Kelvin> as_if = as_if_hot(table, shown.back());
    field.summary.lines.push_back({std::string(line->name), 0, 0, as_if ? as_if->value() : 0});
  }
  return shown;
}

/// Those of one fate, spread over the volume, at most kMostJudged; none if they are too few to matter.
std::vector<Glow> glows_of(const std::vector<Fate>& fates, Fate fate, const VoxelGlow& glows) {
  const auto all = static_cast<std::size_t>(std::count(fates.begin(), fates.end(), fate));
  const auto dark = static_cast<std::size_t>(std::count(fates.begin(), fates.end(), Fate::dark));
  std::vector<Glow> out;
  if (static_cast<double>(all) < kShareOfOthers * static_cast<double>(fates.size() - dark)) return out;
  const std::size_t every = all / kMostJudged + 1;
  std::size_t met = 0;
  for (std::size_t p = 0; p < fates.size(); ++p)
    if (fates[p] == fate && met++ % every == 0) out.push_back(glows.at(p, Beside::lines));
  return out;
}

/// Adds to each temperature's error what `off` returns for a key point, in K; what becomes too uncertain
/// isn't reported.
template <class Off>
void add_error(Readings& readings, const Off& off) {
  TemperatureField& field = readings.field;
  for (std::size_t p = 0; p < field.kelvin.size(); ++p) {
    float& kelvin = field.kelvin[p];
    float& sigma = field.sigma[p];
    if (!(kelvin > 0)) continue;
    sigma = std::hypot(sigma, off(p));
    if (static_cast<double>(sigma) < kMostUncertain * static_cast<double>(kelvin)) continue;
    readings.fates[p] = Fate::unclear;
    kelvin = sigma = 0;
  }
}

/// Where the emitter isn't given, what the other kind would read is part of each temperature's error. Where
/// that doesn't explain what is seen there is nothing to add; where it has no temperature for another reason,
/// how far it is off isn't known.
void doubt_emitter(const Readings& other, Readings& readings) {
  add_error(readings, [&](std::size_t p) {
    if (other.fates[p] == Fate::other) return 0.0F;
    const float instead = other.field.kelvin[p];
    return instead > 0 ? instead - readings.field.kelvin[p] : INFINITY;
  });
}

/// What all readings of one volume share.
struct Asked {
  const Scene& scene;
  const Reconstruction& done;
  const VolumeErrors& errors;
  const CameraResponse& response;
  const SolveOptions& options;
  const Elapsed& elapsed;
};

Readings read_all(const Asked& asked, Emitter emitter, const std::vector<const LineEmitter*>& named = {},
                  std::vector<Glow>* others = nullptr) {
  const auto& [scene, done, errors, response, options, elapsed] = asked;
  const Volume& volume = done.volume;
  const Grid& grid = volume.grid;
  Readings readings;
  TemperatureField& field = readings.field;
  std::vector<Fate>& fates = readings.fates;
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
  if (!(brightest > 0)) return readings;
  const Thermometer meter(table_for(done, response, emitter));
  SelfAbsorption own;
  if (emitter == Emitter::soot) own = self_absorption(scene, done, response, emitter, options.compute);
  readings.corrected = !own.factor.empty();
  const VoxelGlow glows(done, errors, meter.table(), std::move(own), response, brightest);
  summary.by_absorption = glows.by_absorption();
  const Saturation saturation(scene);
  fates.assign(grid.size(), Fate::dark);
  std::vector<std::array<double, 2>> chi(static_cast<std::size_t>(grid.nz));  // sum, degrees of freedom
  std::optional<Unmixer> unmixer;
  if (!named.empty()) unmixer.emplace(meter, look_for(named, response, meter.table(), field));
  Pool(options.compute.threads).run(grid.nz, [&](int k) {
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const std::size_t p = grid.index(i, j, k);
        if (static_cast<double>(brightest_channel(volume, p)) < kShareThatIsRead * brightest) continue;
        const Eigen::Vector3d place = Eigen::Vector3f(grid.origin[0] + grid.edge * static_cast<float>(i),
                                                      grid.origin[1] + grid.edge * static_cast<float>(j),
                                                      grid.origin[2] + grid.edge * static_cast<float>(k))
                                          .cast<double>();
        const Glow glow = glows.at(p, named.empty() ? Beside::nothing : Beside::lines);
        const Unmixed unmixed = unmixer ? unmixer->read(glow) : Unmixed{};
        const Reading reading = unmixer ? unmixed.reading : meter.read(glow);
        fates[p] = saturation.at(place) ? Fate::saturated : unmixer ? fate_of(unmixed) : fate_of(reading);
        chi[static_cast<std::size_t>(k)][0] += reading.chi_square * (reading.freedom > 0 ? 1 : 0);
        chi[static_cast<std::size_t>(k)][1] += reading.freedom;
        for (std::size_t l = 0; l < field.line_share.size(); ++l)
          if (fates[p] != Fate::saturated && unmixed.seen[l])
            field.line_share[l][p] = static_cast<float>(unmixed.share[l]);
        if (fates[p] != Fate::told && fates[p] != Fate::mixed) continue;
        field.kelvin[p] = static_cast<float>(reading.kelvin);
        field.sigma[p] = static_cast<float>(reading.sigma);
      }
  });
  std::array<double, 2> sum = {};
  for (const auto& c : chi) sum = {sum[0] + c[0], sum[1] + c[1]};
  summary.chi_square = sum[1] > 0 ? sum[0] / sum[1] : 0;
  if (others != nullptr) *others = glows_of(fates, Fate::other, glows);
  return readings;
}

GlowField<float> glow_from(const std::vector<float>& kelvin) {
  return {std::vector<float>(kelvin.size()), kelvin};
}

/// What views that neither a solve nor a reading has seen say of solving together. Nothing where the others
/// can't be solved.
std::optional<double> shown_from_elsewhere(const Asked& asked, Emitter emitter) {
  const LeftOutGroup parts = leave_out(asked.scene, 0);
  const SolveOptions again = to_solve_again(asked.done, asked.options);
  const Result<Reconstruction> fewer =
      solve(parts.others, asked.done.volume.grid, asked.done.effects, again, asked.elapsed);
  if (!fewer.ok() || is_stopped(asked.options)) return {};
  const Readings readings =
      read_all({parts.others, *fewer, asked.errors, asked.response, asked.options, asked.elapsed}, emitter);
  const GlowField<float> read = glow_from(readings.field.kelvin);
  const EmitterTable table = table_for(*fewer, asked.response, emitter);
  GlowField<float> together = read;
  solve_together(parts.others, *fewer, table, asked.options, asked.elapsed, together);
  const Misfits left = misfits(parts.left_out, *fewer, table, asked.options, read, together);
  return left.second / left.first;
}

/// The joint solve's temperatures, where views that were left out don't speak against them. What both differ
/// by is part of their error: it shows what the prior and a glow of this kind change, and a reading's own
/// error doesn't hold that.
void take_together(const Asked& asked, Emitter emitter, Readings& readings) {
  if (readings.corrected || !can_solve_together(asked.done.effects)) return;
  TemperatureField& field = readings.field;
  const std::vector<float> read = field.kelvin;
  if (std::none_of(read.begin(), read.end(), [](float kelvin) { return kelvin > 0; })) return;
  const EmitterTable table = table_for(asked.done, asked.response, emitter);
  JointSolve& joint = field.summary.joint;
  try {
    joint.left_out = shown_from_elsewhere(asked, emitter);
    if (!joint.is_believed()) return;
    GlowField<float> glow = glow_from(read);
    const std::optional<double> left_out = joint.left_out;
    joint = solve_together(asked.scene, asked.done, table, asked.options, asked.elapsed, glow);
    joint.left_out = left_out;
    field.kelvin = std::move(glow.kelvin);
  } catch (const Diverged&) {  // what was read stands
    field.summary.joint_failed = true;
    return;
  } catch (const std::bad_alloc&) {
    field.summary.joint_failed = true;
    return;
  }
  for (std::size_t p = 0; p < read.size(); ++p) {
    if (!(read[p] > 0)) continue;
    float& kelvin = field.kelvin[p];
    float& sigma = field.sigma[p];
    Fate& fate = readings.fates[p];
    sigma = std::hypot(sigma, kelvin - read[p]);
    const auto t = static_cast<double>(kelvin);
    if (!(t > table.coldest().value()))
      fate = Fate::colder;
    else if (!(t < table.hottest().value()))
      fate = Fate::hotter;
    else if (!(static_cast<double>(sigma) < kMostUncertain * t))
      fate = Fate::unclear;
    if (fate != Fate::told) kelvin = sigma = 0;
  }
}

/// By Kirchhoff's law: what absorbs emits. A place's brightness fixes its absorption better than pictures
/// of what lies behind it do.
void find_absorption(const Asked& asked, Emitter emitter, TemperatureField& field) {
  const Volume& volume = asked.done.volume;
  const double brightest =
      static_cast<double>(*std::max_element(volume.emission.begin(), volume.emission.end()));
  SelfAbsorption own;
  if (emitter == Emitter::soot)
    own = self_absorption(asked.scene, asked.done, asked.response, emitter, asked.options.compute);
  const Thermometer meter(table_for(asked.done, asked.response, emitter));
  const VoxelGlow glows(asked.done, asked.errors, meter.table(), std::move(own), asked.response, brightest);
  field.absorption.resize(field.kelvin.size());
  field.absorption_sigma.resize(field.kelvin.size());
  for (std::size_t p = 0; p < field.kelvin.size(); ++p) {
    const auto kelvin = static_cast<double>(field.kelvin[p]);
    if (!(kelvin > 0)) continue;
    Glow glow = glows.at(p, Beside::nothing);
    glow.absorption_sigma = 0;  // not by what was reconstructed of it
    const auto absorption_at = [&](double hot) {
      double absorption = 0;
      static_cast<void>(meter.chi_square(glow, hot, &absorption));
      return absorption;
    };
    const double absorption = absorption_at(kelvin);
    const double if_hotter = absorption_at(kelvin + static_cast<double>(field.sigma[p]));
    field.absorption[p] = static_cast<float>(absorption);
    field.absorption_sigma[p] = static_cast<float>(absorption - if_hotter);
  }
}

TemperatureField with_absorption(const Asked& asked, Emitter emitter, bool lines, Readings readings) {
  TemperatureField field = summed_up(asked.done.volume, std::move(readings));
  if (asked.response.absolute && !lines) find_absorption(asked, emitter, field);
  return field;
}

}  // namespace

TemperatureField temperature_of(const Scene& scene, const Reconstruction& done, const VolumeErrors& errors,
                                const CameraResponse& response, std::optional<Emitter> told,
                                const SolveOptions& options, const Elapsed& elapsed,
                                const LineRequest& lines) {
  const Asked asked{scene, done, errors, response, options, elapsed};
  const Emitter emitter = taken_for(told);
  const bool paper = emitter == Emitter::paper;
  std::vector<const LineEmitter*> named = lines.named;
  std::vector<Glow> others;
  Readings read = read_all(asked, emitter, named, &others);
  if (lines.automatic && !others.empty()) {
    const LineChoice choice = choose_line(Thermometer(table_for(done, response, emitter)), response, others);
    if (choice.chosen != nullptr) {
      named = {choice.chosen};
      read = read_all(asked, emitter, named);
    }
    for (const LineEmitter* rival : choice.rivals) read.field.summary.lines_alike.emplace_back(rival->name);
  }
  if (!paper && named.empty()) take_together(asked, emitter, read);
  read.field.summary.lines_automatic = lines.automatic;
  read.field.summary.lines_tried = lines.automatic && !others.empty();
  read.field.summary.emitter_told = told.has_value();
  const std::vector<float>& kelvin = read.field.kelvin;
  if (paper || std::none_of(kelvin.begin(), kelvin.end(), [](float t) { return t > 0; }))
    return summed_up(done.volume, std::move(read));
  const Emitter instead = emitter == Emitter::grey ? Emitter::soot : Emitter::grey;
  Readings other = read_all(asked, instead, named);
  if (!told) doubt_emitter(other, read);
  read.field.summary.if_other = summed_up(done.volume, std::move(other)).summary.mean;
  if (emitter != Emitter::soot) return with_absorption(asked, emitter, !named.empty(), std::move(read));
  const Dispersion dispersion(Thermometer(table_for(done, response, emitter)), response);
  // A flame's soot may have any dispersion between the one that is read by and none, each as likely: the
  // standard uncertainty of a rectangular distribution that ends at what is read (JCGM 100:2008, 4.3.7).
  add_error(read, [&](std::size_t p) {
    return static_cast<float>(dispersion.at(static_cast<double>(read.field.kelvin[p])) / std::sqrt(3.0));
  });
  TemperatureField field = with_absorption(asked, emitter, !named.empty(), std::move(read));
  field.summary.dispersion = dispersion.at(field.summary.mean);
  return field;
}

}  // namespace emberlock::recon
