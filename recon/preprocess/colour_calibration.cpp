// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/colour_calibration.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "base/square.h"
#include "recon/preprocess/colour_advice.h"
#include "recon/preprocess/colour_equations.h"
#include "recon/preprocess/colour_fit.h"
#include "recon/preprocess/flat_field.h"

namespace emberlock::recon {
namespace {

constexpr int kResponsePoints = 256;
constexpr double kMostOutliers = 1.0 / 3;  // of the target's readings
constexpr double kMostOff = 0.05;          // RMS of a camera

Error bad_target(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// The cameras connected by common radiances in one channel, directly or through others: each one's group,
/// identified by its first camera.
std::vector<std::size_t> groups_of(const std::vector<ColourEquation>& equations, std::size_t cameras,
                                   std::size_t channel) {
  std::vector<std::size_t> parent(cameras);
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i];
    return i;
  };
  std::map<std::size_t, std::size_t> seen_by;
  for (const ColourEquation& e : equations) {
    if (e.channel != channel || e.outlier) continue;
    const auto [at, fresh] = seen_by.emplace(e.light, e.camera);
    if (fresh) continue;
    const std::size_t a = root(at->second);
    const std::size_t b = root(e.camera);
    parent[std::max(a, b)] = std::min(a, b);
  }
  for (std::size_t i = 0; i < cameras; ++i) parent[i] = root(i);
  return parent;
}

/// The largest group; of equally large ones the first.
std::size_t main_group(const std::vector<std::size_t>& groups) {
  std::size_t best = 0;
  std::ptrdiff_t most = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto size = std::count(groups.begin(), groups.end(), g);
    if (size > most) {
      most = size;
      best = g;
    }
  }
  return best;
}

ColourFit start_of(const Equations& equations, std::size_t cameras, const ColourOptions& options) {
  ColourFit fit;
  fit.cameras.resize(cameras);
  for (ColourUnknowns& c : fit.cameras) c.response = {options.gamma.value_or(2), 0, 0, 0};
  fit.log_light.resize(equations.lights.size());
  std::vector<double> count(fit.log_light.size());
  for (const ColourEquation& e : equations.all) {
    fit.log_light[e.light] += options.gamma.value_or(2) * std::log(e.sample) - e.known;
    count[e.light] += 1;
  }
  for (std::size_t i = 0; i < count.size(); ++i) fit.log_light[i] /= std::max(1.0, count[i]);
  return fit;
}

/// Sets the light in the corner and its standard deviation.
void tell_corner(const ColourFit& fit, std::size_t camera, CalibratedColour& out) {
  const auto at = static_cast<Eigen::Index>(10 * camera + 7);
  const Eigen::Vector3d ones = Eigen::Vector3d::Ones();
  out.corner = falloff(out.colour.vignetting, 1);
  out.corner_sigma = std::sqrt(std::max(0.0, ones.dot(fit.covariance.block<3, 3>(at, at) * ones)));
}

/// Normalises the gains so that their geometric mean over the cameras that share patches is 1, and sets their
/// standard deviations relative to it.
void tell_gains(const ColourFit& fit, const std::vector<std::size_t>& groups, std::size_t channel,
                std::vector<CalibratedColour>& out) {
  const std::size_t group = main_group(groups);
  std::vector<std::size_t> members;
  for (std::size_t i = 0; i < groups.size(); ++i)
    if (groups[i] == group) members.push_back(i);
  const auto n = static_cast<double>(members.size());
  const auto place = [&](std::size_t camera) { return static_cast<Eigen::Index>(10 * camera + 4 + channel); };
  double mean = 0;
  for (const std::size_t i : members) mean += fit.cameras[i].log_gain[channel] / n;
  Eigen::VectorXd average = Eigen::VectorXd::Zero(fit.covariance.rows());
  for (const std::size_t i : members) average[place(i)] = 1 / n;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    if (groups[i] != group) {
      out[i].shares_patches = false;
      continue;
    }
    Eigen::VectorXd own = -average;
    own[place(i)] += 1;
    out[i].colour.gain[channel] = std::exp(fit.cameras[i].log_gain[channel] - mean);
    out[i].gain_sigma[channel] = std::sqrt(std::max(0.0, own.dot(fit.covariance * own)));
  }
}

std::vector<double> response_table(const std::array<double, ResponseCurve::kParameters>& p) {
  std::vector<double> table(kResponsePoints);
  for (int i = 0; i < kResponsePoints; ++i)
    table[static_cast<std::size_t>(i)] =
        ResponseCurve::exposure(p, static_cast<double>(i) / (kResponsePoints - 1));
  table.back() = 1;
  return table;
}

void tell_residuals(const Equations& equations, const ColourFit& fit, ColourCalibration& out) {
  double squares = 0;
  int used = 0;
  std::vector<double> by_camera(out.cameras.size());
  std::vector<int> count(out.cameras.size());
  for (std::size_t i = 0; i < equations.all.size(); ++i) {
    const ColourEquation& e = equations.all[i];
    CalibratedColour& camera = out.cameras[e.camera];
    const double whole =
        std::exp(ResponseCurve::log_exposure(fit.cameras[e.camera].response.data(), e.sample, e.variance));
    const ReadingUse use = e.outlier ? ReadingUse::outlier : ReadingUse::used;
    const double dark = ResponseCurve::exposure(fit.cameras[e.camera].response, e.dark_sample);
    out.residuals.push_back({equations.reading[i], e.channel, whole - dark, std::expm1(e.residual), use});
    ++camera.uses[static_cast<std::size_t>(use)];
    if (e.outlier) continue;
    camera.darkest = std::min(camera.darkest, e.sample);
    camera.brightest = std::max(camera.brightest, e.sample);
    by_camera[e.camera] += e.residual * e.residual;
    ++count[e.camera];
    squares += e.residual * e.residual;
    ++used;
  }
  for (std::size_t i = 0; i < by_camera.size(); ++i)
    out.cameras[i].rms = std::sqrt(by_camera[i] / std::max(1, count[i]));
  out.rms = std::sqrt(squares / std::max(1, used));
}

/// Each camera's flat field, given its lens from the fit.
std::vector<FoundFlat> find_flats(const ColourReadings& readings, const ColourFit& fit, double floor) {
  std::vector<FoundFlat> flats;
  for (std::size_t i = 0; i < readings.cameras.size(); ++i) {
    const ColourCamera& camera = readings.cameras[i];
    std::vector<FlatReading> own;
    std::copy_if(readings.flats.begin(), readings.flats.end(), std::back_inserter(own),
                 [&](const FlatReading& flat) { return flat.camera == i; });
    flats.push_back(find_flat(own, fit.cameras[i], camera.dark, camera.step, floor));
  }
  return flats;
}

void put_flats(const ColourReadings& readings, const std::vector<FoundFlat>& flats, Equations& equations) {
  for (std::size_t i = 0; i < equations.all.size(); ++i) {
    const PatchReading& patch = readings.patches[equations.reading[i]];
    const ImageSize size = readings.cameras[patch.camera].size;
    equations.all[i].flat = std::log(light_at(flats[patch.camera].flat, patch.x / size.width,
                                              patch.y / size.height)[equations.all[i].channel]);
  }
}

/// The result for all cameras.
struct JointFit {
  ColourFit fit;
  std::vector<FoundFlat> flats;
};

/// Fits again with the target only, starting from a fit that flat pictures may have biased; returns `start`
/// if the target isn't sufficient.
ColourFit fit_target(const ColourReadings& readings, const Equations& equations, const ColourFit& start,
                     ColourHeld held) {
  std::vector<ColourEquation> target;
  for (std::size_t i = 0; i < equations.all.size(); ++i)
    if (!is_flat(readings.patches[equations.reading[i]])) target.push_back(equations.all[i]);
  held.vignetting = vignetting_not_told(target, readings.cameras.size());
  return target.size() == equations.all.size() ? start : fit_colour(target, start, held).value_or(start);
}

/// Patches imaged through dust would seem darker, so with flat fields the fit is repeated.
std::optional<JointFit> fit_jointly(const ColourReadings& readings, Equations& equations,
                                    const ColourFit& start, const ColourHeld& held, double floor) {
  auto fit = fit_colour(equations.all, fit_target(readings, equations, start, held), held);
  if (!fit) return std::nullopt;
  std::vector<FoundFlat> flats = find_flats(readings, *fit, floor);
  const bool any =
      std::any_of(flats.begin(), flats.end(), [](const FoundFlat& f) { return !f.flat.light.empty(); });
  if (any) {
    put_flats(readings, flats, equations);
    fit = fit_colour(equations.all, std::move(*fit), held);
    if (!fit) return std::nullopt;
    flats = find_flats(readings, *fit, floor);
  }
  return JointFit{std::move(*fit), std::move(flats)};
}

/// Error if a camera's readings contradict the fit.
Status check_fit(const ColourReadings& readings, const Equations& equations) {
  for (std::size_t camera = 0; camera < readings.cameras.size(); ++camera) {
    double squares = 0;
    double used = 0;
    double outliers = 0;
    for (std::size_t i = 0; i < equations.all.size(); ++i) {
      const ColourEquation& e = equations.all[i];
      if (e.camera != camera || is_flat(readings.patches[equations.reading[i]])) continue;
      (e.outlier ? outliers : used) += 1;
      if (!e.outlier) squares += square(e.residual);
    }
    const double off = std::sqrt(squares / std::max(1.0, used));
    if (outliers <= kMostOutliers * (used + outliers) && off <= kMostOff) continue;
    return bad_target(
        "camera " + readings.cameras[camera].id,
        fmt::format("its readings of the target contradict each other: off by {:.1f} % (RMS), and {:.0f} of "
                    "{:.0f} further than that",
                    100 * off, outliers, used + outliers),
        "Check the exposures told and colour.json's rectangles; keep the light steady; switch automatic "
        "exposure and white balance off");
  }
  return {};
}

Status check_colour_options(const ColourOptions& options) {
  if (options.gamma && !(*options.gamma >= 0.3 && *options.gamma <= 5))
    return bad_target("--gamma", "is out of range", "Give 0.3 to 5");
  return {};
}

/// A camera's colour from the fit.
CalibratedColour calibrated(const ColourCamera& camera, const ColourUnknowns& found, const FoundFlat& flat) {
  CalibratedColour out;
  out.camera = camera.id;
  out.gamma = found.response[0];
  out.colour.response = response_table(found.response);
  out.colour.vignetting = found.vignetting;
  out.colour.flat = flat.flat;
  out.flat_rms = flat.rms;
  out.flat_worst = flat.worst;
  out.colour.hot_pixels = camera.dark.hot_pixels;
  for (std::size_t c = 0; c < 3; ++c)
    out.colour.dark[c] = ResponseCurve::exposure(found.response, dark_sample(camera.dark, c));
  return out;
}

}  // namespace

Result<ColourCalibration> calibrate_colour(const ColourReadings& readings, const ColourOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check_colour_options(options));
  EMBERLOCK_RETURN_IF_ERROR(check_dark(readings));
  Equations equations = equations_of(readings, options);
  if (equations.all.empty()) {
    const auto saturated =
        std::count_if(equations.left_out.begin(), equations.left_out.end(),
                      [](const ColourResidual& r) { return r.use == ReadingUse::saturated; });
    return bad_target(
        "target pictures",
        fmt::format("no patch can be used: of {} readings {} are saturated, the others too dark",
                    equations.left_out.size(), saturated),
        "Take pictures with the patches between a tenth and nine tenths of white");
  }
  EMBERLOCK_RETURN_IF_ERROR(check_rising(readings, equations));
  if (!options.gamma && !response_told(equations.all)) {
    return bad_target(
        "target pictures", "nothing tells the cameras' response",
        "Add a series of exposures of one camera (target_LIGHT_SECONDSs.png), or the patches' radiances in "
        "colour.json, or give --gamma");
  }
  const std::size_t cameras = readings.cameras.size();
  ColourHeld held{options.gamma.has_value(), std::vector<std::array<bool, 3>>(cameras),
                  std::vector<bool>(cameras)};
  std::array<std::vector<std::size_t>, 3> groups;
  for (std::size_t c = 0; c < 3; ++c) {
    groups[c] = groups_of(equations.all, cameras, c);
    for (std::size_t i = 0; i < cameras; ++i) held.gain[i][c] = groups[c][i] == i;
  }
  held.vignetting = vignetting_not_told(equations.all, cameras);

  const auto joint =
      fit_jointly(readings, equations, start_of(equations, cameras, options), held, options.floor);
  if (!joint) {
    return bad_target("target pictures", "don't determine the cameras' colours",
                      "Take more pictures of more patches by all cameras");
  }
  EMBERLOCK_RETURN_IF_ERROR(check_fit(readings, equations));
  const ColourFit& fit = joint->fit;

  ColourCalibration out;
  for (std::size_t i = 0; i < cameras; ++i) {
    CalibratedColour camera = calibrated(readings.cameras[i], fit.cameras[i], joint->flats[i]);
    camera.vignetting_known = !held.vignetting[i];
    tell_corner(fit, i, camera);
    out.cameras.push_back(std::move(camera));
    if (std::adjacent_find(out.cameras[i].colour.response.begin(), out.cameras[i].colour.response.end(),
                           std::greater_equal<>()) != out.cameras[i].colour.response.end()) {
      return bad_target("camera " + readings.cameras[i].id, "its samples don't rise with light everywhere",
                        "Check the exposures told; switch automatic exposure and tone off");
    }
  }
  for (std::size_t c = 0; c < 3; ++c) tell_gains(fit, groups[c], c, out.cameras);
  tell_residuals(equations, fit, out);
  for (const ColourResidual& r : equations.left_out) {
    out.residuals.push_back(r);
    ++out.cameras[readings.patches[r.reading].camera].uses[static_cast<std::size_t>(r.use)];
  }
  warn_of_colours(readings, out);
  advise_on_colours(out);
  return out;
}

}  // namespace emberlock::recon
