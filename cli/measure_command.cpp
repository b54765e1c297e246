// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/file.h"
#include "cli/commands.h"
#include "cli/numbers.h"
#include "cli/outputs.h"
#include "cli/result_files.h"
#include "cli/up_axis.h"
#include "recon/export/volume_file.h"
#include "recon/render/volume.h"
#include "recon/temperature/radiant.h"
#include "report/html.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

struct MeasureArguments {
  std::vector<std::string> volumes;
  std::string target;
  std::string sphere;
  std::string out;
  std::string up;
  int threads = 0;
};

/// A small surface: where it is and where it looks.
struct Surface {
  Eigen::Vector3d point, normal;
};

struct Targets {
  std::optional<Surface> surface;
  std::optional<recon::TargetSphere> sphere;
};

struct Measured {
  std::string name;
  recon::HotStatistics statistics;
  struct Heat {
    double power = 0;            // W
    std::optional<double> flux;  // W / m^2
    std::optional<recon::SphereFlux> sphere;
  };
  Heat heat;
  Heat error;  // by which each is off if all voxels are hotter by one sigma
};

Result<Targets> parse_targets(const MeasureArguments& arguments) {
  Targets targets;
  if (!arguments.target.empty()) {
    const auto v = parse_numbers_of<6>(arguments.target);
    const Eigen::Vector3d normal = v ? Eigen::Vector3d((*v)[3], (*v)[4], (*v)[5]) : Eigen::Vector3d::Zero();
    if (!(normal.norm() > 0))
      return Error{ErrorKind::bad_input, "\"" + arguments.target + "\" is no target", "--target",
                   "Give x,y,z,nx,ny,nz: a point in metres and the direction it looks in"};
    targets.surface = Surface{{(*v)[0], (*v)[1], (*v)[2]}, normal.normalized()};
  }
  if (!arguments.sphere.empty()) {
    const auto v = parse_numbers_of<4>(arguments.sphere);
    if (!v || !((*v)[3] > 0))
      return Error{ErrorKind::bad_input, "\"" + arguments.sphere + "\" is no sphere", "--target-sphere",
                   "Give x,y,z,radius in metres"};
    targets.sphere = recon::TargetSphere{{(*v)[0], (*v)[1], (*v)[2]}, (*v)[3]};
  }
  return targets;
}

/// A volume's file, and how it is called.
struct NamedVolume {
  std::string name;
  fs::path file;
};

/// A result's folder stands for its volume, and a sequence's for those of its frames.
Result<std::vector<NamedVolume>> volumes_in(const std::vector<std::string>& results) {
  std::vector<NamedVolume> all;
  for (const std::string& result : results) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<ResultVolume> volumes, volumes_of(result));
    warn_of_missing(missing_frames(result, volumes));
    for (const ResultVolume& volume : volumes)
      all.push_back({is_sequence(result) ? volume.file.parent_path().string() : result, volume.file});
  }
  return all;
}

Measured::Heat heat_of(const recon::HotVolume& hot, const Targets& targets,
                       const recon::ComputeOptions& compute) {
  Measured::Heat heat;
  heat.power = recon::radiated_power(hot, compute);
  if (targets.surface)
    heat.flux = recon::radiant_flux(hot, targets.surface->point, targets.surface->normal, compute);
  if (targets.sphere) heat.sphere = recon::radiant_flux(hot, *targets.sphere, compute);
  return heat;
}

Measured::Heat difference(const Measured::Heat& a, const Measured::Heat& b) {
  Measured::Heat out;
  out.power = std::abs(a.power - b.power);
  if (a.flux) out.flux = std::abs(*a.flux - *b.flux);
  if (a.sphere)
    out.sphere = recon::SphereFlux{std::abs(a.sphere->mean - b.sphere->mean),
                                   std::abs(a.sphere->most - b.sphere->most),
                                   std::abs(a.sphere->power - b.sphere->power), a.sphere->held};
  return out;
}

/// A sphere that cuts the flame catches part of it from within and part from outside.
Status check_sphere(const recon::SphereFlux& flux) {
  constexpr double kStray = 1e-3;  // of the power: voxels of noise
  if (flux.held < kStray || flux.held > 1 - kStray) return {};
  return Error{ErrorKind::bad_input,
               fmt::format("the sphere cuts the flame: it holds {:.0f} % of what radiates", 100 * flux.held),
               "--target-sphere", "Give a radius that holds all of it, or a sphere beside the flame"};
}

Result<Measured> measured(const NamedVolume& from, const Targets& targets, const Eigen::Vector3d& up,
                          const recon::ComputeOptions& compute) {
  const fs::path& file = from.file;
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Volume volume, recon::read_volume(file));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto kelvin, recon::read_values(file, "temperature", volume.grid));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto errors, recon::read_values(file, "temperature_sigma", volume.grid));
  if (!kelvin || !errors)
    return Error{ErrorKind::bad_input, "has no temperatures with their errors", file.string(),
                 "Reconstruct it with --quantity temperature"};
  const std::vector<float>& sigma = *errors;
  EMBERLOCK_ASSIGN_OR_RETURN(const auto absorption, recon::read_values(file, "absorption", volume.grid));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto falls, recon::read_values(file, "absorption_sigma", volume.grid));
  if (!absorption && volume.extinction.empty())
    return Error{ErrorKind::bad_input, "has no extinction, so that what it radiates isn't known",
                 file.string(),
                 "Reconstruct it with an absolute --response, with --effects auto or extinction=SIGMA"};
  // Emission shows where a medium absorbs; an even extinction that was given doesn't.
  recon::HotVolume hot{volume.grid, *kelvin, absorption ? *absorption : volume.extinction};
  const std::vector<float> share = recon::shares_inside(volume);
  for (std::size_t p = 0; p < share.size(); ++p) hot.absorption[p] *= share[p];
  Measured out;
  out.name = from.name;
  out.statistics = recon::statistics_of(hot, sigma, up);
  if (out.statistics.points == 0)
    return Error{ErrorKind::bad_input, "no voxel tells a temperature", file.string(),
                 "See what its report.html says of temperatures"};
  out.heat = heat_of(hot, targets, compute);
  if (out.heat.sphere) EMBERLOCK_RETURN_IF_ERROR(check_sphere(*out.heat.sphere));
  // All voxels off alike, as what is off in a response or an emitter is. Where they are hotter, less of them
  // emits the same light.
  for (std::size_t p = 0; p < hot.kelvin.size(); ++p) {
    hot.kelvin[p] += sigma[p];
    if (falls) hot.absorption[p] -= (share.empty() ? 1.0F : share[p]) * (*falls)[p];
  }
  out.error = difference(heat_of(hot, targets, compute), out.heat);
  return out;
}

/// A value and its error for a table; two empty ones without it.
std::string with_error(const std::optional<double>& value, const std::optional<double>& error) {
  return value ? fmt::format("{:.6g},{:.3g}", *value, *error) : ",";
}

std::string csv_of(const std::vector<Measured>& all) {
  std::string csv =
      "volume,power_w,power_error_w,flux_w_m2,flux_error_w_m2,sphere_mean_w_m2,sphere_mean_error_w_m2,sphere_"
      "most_w_m2,sphere_most_error_w_m2,sphere_power_w,sphere_power_error_w,mean_k,mean_error_k,most_k,most_"
      "error_k,height_m,volume_m3\n";
  for (const Measured& m : all) {
    const auto of_sphere = [&](double recon::SphereFlux::*part) {
      return m.heat.sphere ? with_error((*m.heat.sphere).*part, (*m.error.sphere).*part) : ",";
    };
    csv += fmt::format("{},{},{},{},{},{},{:.1f},{:.1f},{:.1f},{:.1f},{:.5g},{:.5g}\n", m.name,
                       with_error(m.heat.power, m.error.power), with_error(m.heat.flux, m.error.flux),
                       of_sphere(&recon::SphereFlux::mean), of_sphere(&recon::SphereFlux::most),
                       of_sphere(&recon::SphereFlux::power), m.statistics.mean, m.statistics.mean_error,
                       m.statistics.most, m.statistics.most_error, m.statistics.height, m.statistics.volume);
  }
  return csv;
}

void print(const Measured& m) {
  const recon::HotStatistics& s = m.statistics;
  std::printf("%-16s %s\n", "volume", m.name.c_str());
  std::printf("%-16s %.4g W +- %.2g, in all directions\n", "radiates", m.heat.power, m.error.power);
  if (m.heat.flux) std::printf("%-16s %.4g W / m2 +- %.2g\n", "on the target", *m.heat.flux, *m.error.flux);
  if (m.heat.sphere) {
    const recon::SphereFlux& caught = *m.heat.sphere;
    const recon::SphereFlux& error = *m.error.sphere;
    std::printf(
        "%-16s %.4g W / m2 +- %.2g on average, %.4g +- %.2g at most, %.4g W +- %.2g in all, on its %s side\n",
        "on the sphere", caught.mean, error.mean, caught.most, error.most, caught.power, error.power,
        caught.held > 0.5 ? "inner" : "outer");
  }
  std::printf("%-16s %.0f K +- %.0f on average, %.0f K +- %.0f at most\n", "temperature", s.mean,
              s.mean_error, s.most, s.most_error);
  std::printf("%-16s %.4g m high, %.4g cm3, of the voxels that tell a temperature\n", "flame", s.height,
              1e6 * s.volume);
}

/// measures.csv, and of several volumes measures.html.
Status write_measures(const std::vector<Measured>& all, const OutputRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(request));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "measures.csv", csv_of(all)));
  if (all.size() < 2) return staging.commit();
  report::HtmlPage page("Emberlock: what the flame radiates");
  const auto plot = [&](const char* title, const char* unit, const auto& value) {
    report::Series series{title, {}, {}};
    for (std::size_t i = 0; i < all.size(); ++i) {
      series.x.push_back(static_cast<double>(i));
      series.y.push_back(value(all[i]));
    }
    page.heading(title);
    page.raw(
        report::svg_plot_for_any_width({series}, {.title = title, .x_label = "volume", .y_label = unit}));
  };
  plot("radiated power", "W", [](const Measured& m) { return m.heat.power; });
  if (all.front().heat.flux)
    plot("flux on the target", "W / m2", [](const Measured& m) { return *m.heat.flux; });
  if (all.front().heat.sphere) {
    plot("mean flux on the sphere", "W / m2", [](const Measured& m) { return m.heat.sphere->mean; });
    plot("highest flux on the sphere", "W / m2", [](const Measured& m) { return m.heat.sphere->most; });
    plot("power that the sphere catches", "W", [](const Measured& m) { return m.heat.sphere->power; });
  }
  plot("mean temperature", "K", [](const Measured& m) { return m.statistics.mean; });
  plot("highest temperature", "K", [](const Measured& m) { return m.statistics.most; });
  plot("height", "m", [](const Measured& m) { return m.statistics.height; });
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "measures.html", page.str()));
  return staging.commit();
}

void measure(const MeasureArguments& arguments) {
  const Targets targets = or_fail(parse_targets(arguments));
  const std::vector<NamedVolume> volumes = or_fail(volumes_in(arguments.volumes));
  const Eigen::Vector3d up = or_fail(up_axis(arguments.up, volumes.front().file));
  const OutputRequest request{arguments.out, kMeasure, {arguments.volumes.begin(), arguments.volumes.end()}};
  if (!arguments.out.empty()) or_fail(OutputFolder::check(request));
  recon::ComputeOptions compute;
  compute.threads = arguments.threads;
  std::vector<Measured> all;
  all.reserve(volumes.size());
  for (const NamedVolume& volume : volumes) {
    all.push_back(or_fail(measured(volume, targets, up, compute)));
    print(all.back());
  }
  if (arguments.out.empty()) return;
  or_fail(write_measures(all, request));
  std::printf("%-16s %s\n", "written to", arguments.out.c_str());
}

}  // namespace

void add_measure(const Verb& app) {
  auto arguments = std::make_shared<MeasureArguments>();
  MeasureArguments& a = *arguments;
  const Verb verb = app.add_verb(
      "measure", "Measures what flames radiate: power, flux on a surface, temperatures, height and volume");
  verb.add_option(
          "VOLUMES", a.volumes,
          "Results of `reconstruct --quantity temperature`: folders, also of sequences, or volume.vdb")
      .require();
  verb.add_option(
      "--target", a.target,
      "x,y,z,nx,ny,nz: also the flux on a small surface, at a point (m) and the direction it looks in");
  verb.add_option("--target-sphere", a.sphere,
                  "x,y,z,radius (m): also the flux on a black sphere, mean and highest, and the power that "
                  "it catches; one around the flame catches on its inner side")
      .set_type("TEXT");
  verb.add_option("--up", a.up,
                  "The world's axis along which height is counted: x, y, z, -x, -y or -z [as the first "
                  "result's cameras stood, or z]")
      .set_type("TEXT");
  verb.add_option("--out", a.out, "Folder for measures.csv, and of several volumes measures.html with plots");
  verb.add_threads(a.threads);
  verb.set_action([arguments] { measure(*arguments); });
}

}  // namespace emberlock::cli
