// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/colour_equations.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include <fmt/format.h>

namespace emberlock::recon {
namespace {

constexpr double kLeastRatio = 1.3;  // of exposures that can determine a response
// Relative error of a flat picture's patches: dust, and slightly uneven light. They are many: with
// smaller errors the best fit would be a response that is flat at their values.
constexpr double kFlatFloor = 0.02;

Error bad_picture(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// The lens's falloff needs a radiance at three or more clearly different distances.
bool vignetting_told(const std::vector<ColourEquation>& equations, std::size_t camera) {
  std::map<std::size_t, std::set<int>> places;  // by light: tenths of r^2
  for (const ColourEquation& e : equations)
    if (e.camera == camera) places[e.light].insert(static_cast<int>(10 * e.radius_squared));
  std::set<int> all;
  for (const auto& [light, tenths] : places)
    if (tenths.size() > 1) all.insert(tenths.begin(), tenths.end());
  return all.size() >= 3 && *all.rbegin() - *all.begin() >= 3;
}

}  // namespace

Equations equations_of(const ColourReadings& readings, const ColourOptions& options) {
  Equations out;
  for (std::size_t i = 0; i < readings.patches.size(); ++i) {
    const PatchReading& p = readings.patches[i];
    const ColourCamera& camera = readings.cameras[p.camera];
    const auto known = readings.radiance.find(p.patch);
    for (std::size_t c = 0; c < 3; ++c) {
      if (p.count[c] == 0) continue;
      const double dark = dark_sample(camera.dark, c);
      if (const ReadingUse use = use_of(p, c, dark); use != ReadingUse::used) {
        out.left_out.push_back({i, c, 0, 0, use});
        continue;
      }
      ColourEquation e;
      e.camera = p.camera;
      e.channel = c;
      e.known = std::log(p.exposure);
      const std::string name =
          known == readings.radiance.end() ? "patch:" + p.patch + "@" + p.light : "light:" + p.light;
      if (known != readings.radiance.end()) e.known += std::log(known->second[c]);
      e.light = out.lights.emplace(std::pair(name, c), out.lights.size()).first->second;
      e.sample = p.mean[c];
      e.variance = p.variance[c];
      e.dark_sample = dark;
      e.sample_sigma = mean_sigma(p, c, camera.step);
      e.radius_squared = radius_squared(camera.size, p.x, p.y);
      e.floor = is_flat(p) ? std::max(kFlatFloor, options.floor) : options.floor;
      out.all.push_back(e);
      out.reading.push_back(i);
    }
  }
  return out;
}

Status check_dark(const ColourReadings& readings) {
  for (std::size_t camera = 0; camera < readings.cameras.size(); ++camera) {
    const ColourCamera& from = readings.cameras[camera];
    if (from.dark.histogram[1].empty()) continue;
    double brightest = 0;
    for (const PatchReading& p : readings.patches)
      if (p.camera == camera) brightest = std::max(brightest, p.mean[1]);
    if (brightest > 0 && dark_sample(from.dark, 1) >= brightest) {
      return bad_picture("camera " + from.id, "its dark pictures are brighter than the target",
                         "Take them with the lens covered; check that dark* and target* aren't exchanged");
    }
  }
  return {};
}

Status check_rising(const ColourReadings& readings, const Equations& equations) {
  using Key =
      std::tuple<std::size_t, std::size_t, std::size_t, double, double>;  // camera, light, channel, place
  std::map<Key, std::vector<std::pair<double, std::size_t>>> series;
  for (std::size_t i = 0; i < equations.all.size(); ++i) {
    const ColourEquation& e = equations.all[i];
    const PatchReading& p = readings.patches[equations.reading[i]];
    series[{e.camera, e.light, e.channel, p.x, p.y}].emplace_back(e.known, i);
  }
  for (auto& [key, steps] : series) {
    std::sort(steps.begin(), steps.end());
    for (std::size_t i = 1; i < steps.size(); ++i) {
      const ColourEquation& low = equations.all[steps[i - 1].second];
      const ColourEquation& high = equations.all[steps[i].second];
      const double margin = 6 * std::hypot(low.sample_sigma, high.sample_sigma) + 0.01;
      if (high.known - low.known < std::log(kLeastRatio) || high.sample > low.sample - margin) continue;
      const PatchReading& p = readings.patches[equations.reading[steps[i].second]];
      return bad_picture(
          "camera " + readings.cameras[low.camera].id + ": patch " + p.patch,
          fmt::format("more exposure makes it darker: {:.3g} of white in {}, {:.3g} in {}", low.sample,
                      readings.patches[equations.reading[steps[i - 1].second]].picture, high.sample,
                      p.picture),
          "Check the exposures told; switch the camera's automatic exposure and tone off");
    }
  }
  return {};
}

bool response_told(const std::vector<ColourEquation>& equations) {
  std::map<std::tuple<std::size_t, std::size_t>, std::pair<double, double>> range;  // camera, light
  for (const ColourEquation& e : equations) {
    const auto at = range.emplace(std::tuple(e.camera, e.light), std::pair(e.known, e.known)).first;
    at->second.first = std::min(at->second.first, e.known);
    at->second.second = std::max(at->second.second, e.known);
  }
  return std::any_of(range.begin(), range.end(), [](const auto& entry) {
    return entry.second.second - entry.second.first > std::log(kLeastRatio);
  });
}

std::vector<bool> vignetting_not_told(const std::vector<ColourEquation>& equations, std::size_t cameras) {
  std::vector<bool> held(cameras);
  for (std::size_t i = 0; i < cameras; ++i) held[i] = !vignetting_told(equations, i);
  return held;
}

}  // namespace emberlock::recon
