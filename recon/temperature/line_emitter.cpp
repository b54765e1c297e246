// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/line_emitter.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace emberlock::recon {
namespace {

constexpr double kLeastSeen = 1e-3;  // of the level at the best wavelength

double at(const CameraResponse& response, std::size_t channel, double nm) {
  const std::vector<double>& x = response.wavelength_nm;
  const std::vector<double>& y = response.level[channel];
  const auto above = std::upper_bound(x.begin(), x.end(), nm);
  if (above == x.begin()) return 0;
  if (above == x.end()) return nm == x.back() ? y.back() : 0;
  const auto i = static_cast<std::size_t>(above - x.begin());
  return y[i - 1] + (y[i] - y[i - 1]) * (nm - x[i - 1]) / (x[i] - x[i - 1]);
}

/// The response's mean over a band.
double mean(const CameraResponse& response, std::size_t channel, const LineBand& band) {
  if (!(band.to_nm > band.from_nm)) return at(response, channel, band.from_nm);
  const std::vector<double>& x = response.wavelength_nm;
  double sum = 0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    const double from = std::max(x[i], band.from_nm);
    const double to = std::min(x[i + 1], band.to_nm);
    if (to > from) sum += (to - from) * at(response, channel, (from + to) / 2);  // linear in between
  }
  return sum / (band.to_nm - band.from_nm);
}

std::size_t live_channels(const CameraResponse& response) {
  std::size_t live = 0;
  for (std::size_t c = 0; c < 3; ++c) live += is_dead(response, c) ? 0 : 1;
  return live;
}

Error bad_lines(std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), "--lines", std::move(remedy)};
}

}  // namespace

const std::vector<LineEmitter>& line_emitters() {
  // Atoms: wavelengths in air of the NIST Atomic Spectra Database. The upper levels of a doublet have
  // statistical weights of 4 and 2 and transition probabilities alike within 2 %, so that thin light is 2
  // : 1. In a flame their other lines are fainter by 3e-4 or more (potassium's violet 404.4 nm, which counts
  // only behind an infrared filter; lithium's 610.4 nm).
  // C2: the four sequences of the Swan system, whose heads stand at 473.7, 516.5, 563.6 and 619.1 nm, with
  // the power, centre and width that they have in a measured blue flame (butane, spectrometer corrected for
  // its sensitivity: "BlueFlame.txt" of the R package colorSpec, E. Rabett 2007). Franck-Condon factors at
  // 3000 and 4500 K give 20..28 : 55..45 : 18 : 4..5 where it has 25 : 51 : 19 : 4. CH: the A-X band around
  // 431 nm; in that flame B-X at 382 to 402 nm has a fifth of its power, and is left out, as cameras hardly
  // see it. CuCl: its strongest bands, 426.9 to 456.0 nm (Shimizu, Selected Pyrotechnic Publications 3, pp.
  // 87-102); the fainter ones at 476 to 488 and at 526.3 to 553.1 nm are left out. CuOH: its strongest,
  // diffuse bands; no intensities were at hand (Meyerriecks and Kosanke, J. Pyrotechnics 18, 2003, has them);
  // those at 615 to 625 nm are left out. BO2: the A-X system (Johns, Can. J. Phys. 39, 1738, 1961); 492, 518
  // and 546 nm by Dean and Thompson (Anal. Chem. 27, 42, 1955); relative heights by one green flame before a
  // spectrometer whose sensitivity wasn't corrected, good to half.
  static const std::vector<LineEmitter> emitters = {
      {"sodium", "Na, 589.0 and 589.6 nm", {{588.995, 588.995, 2}, {589.592, 589.592, 1}}},
      {"potassium", "K, 766.5 and 769.9 nm", {{766.490, 766.490, 2}, {769.896, 769.896, 1}}},
      {"lithium", "Li, 670.8 nm", {{670.776, 670.776, 2}, {670.791, 670.791, 1}}},
      {"ch", "CH of a blue base, 431 nm", {{427, 435, 1}}},
      {"c2",
       "C2 of a blue base, Swan bands at 516.5, 473.7 and 563.6 nm",
       {{463.2, 474.8, 5}, {504.7, 519, 10}, {544, 566, 3.8}, {588, 620, 0.85}}},
      {"cucl", "copper with chlorine, 427 to 456 nm", {{426.9, 456.0, 1}}},
      {"cuoh", "copper without chlorine, 535 to 555 nm", {{535, 555, 1}}},
      {"bo2",
       "boron, 494, 518, 548 and 580 nm",
       {{488.5, 498.5, 2}, {513, 523, 6}, {542.5, 552.5, 10}, {575, 585, 2.5}, {615, 625, 0.6}}},
  };
  return emitters;
}

Result<LineRequest> parse_lines(std::string_view words) {
  LineRequest request;
  if (words.empty()) return request;
  if (words == "auto") {
    request.automatic = true;
    return request;
  }
  for (std::size_t from = 0; from <= words.size();) {
    const std::size_t to = std::min(words.find(',', from), words.size());
    const std::string_view word = words.substr(from, to - from);
    const auto& all = line_emitters();
    const auto it =
        std::find_if(all.begin(), all.end(), [&](const LineEmitter& e) { return e.name == word; });
    if (it == all.end()) {
      std::vector<std::string> known;
      known.reserve(all.size());
      for (const LineEmitter& e : all) known.push_back(fmt::format("{} ({})", e.name, e.what));
      return bad_lines(fmt::format("\"{}\" is no known line emitter", word),
                       fmt::format("Give auto, or of these, between commas: {}", fmt::join(known, "; ")));
    }
    if (std::find(request.named.begin(), request.named.end(), &*it) != request.named.end())
      return bad_lines(fmt::format("{} is named twice", word), "Name each once");
    request.named.push_back(&*it);
    from = to + 1;
  }
  if (request.named.size() > kMostLines)
    return bad_lines(fmt::format("{} line emitters are named", request.named.size()),
                     "Name at most two: three channels and an extinction tell no more beside soot");
  return request;
}

std::array<double, 3> levels_of(const CameraResponse& response, const LineEmitter& emitter) {
  std::array<double, 3> out = {};
  double strengths = 0;
  for (const LineBand& band : emitter.bands) {
    strengths += band.strength;
    for (std::size_t c = 0; c < 3; ++c) out[c] += band.strength * mean(response, c, band);
  }
  for (double& v : out) v /= strengths;
  return out;
}

std::array<double, 3> shown_alone(const std::array<double, 3>& levels) {
  return {std::max(0.0, levels[0]), std::max(0.0, levels[1]), std::max(0.0, levels[2])};
}

bool is_seen(const CameraResponse& response, const LineEmitter& emitter) {
  double most = 0;
  for (std::size_t i = 0; i < response.wavelength_nm.size(); ++i) {
    double sum = 0;
    for (const std::vector<double>& level : response.level) sum += std::max(0.0, level[i]);
    most = std::max(most, sum);
  }
  const std::array<double, 3> shown = shown_alone(levels_of(response, emitter));
  return shown[0] + shown[1] + shown[2] > kLeastSeen * most;
}

double colour_distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  const Eigen::Vector3d u = Eigen::Vector3d::Map(shown_alone(a).data()).normalized();
  const Eigen::Vector3d v = Eigen::Vector3d::Map(shown_alone(b).data()).normalized();
  return u.cross(v).norm();
}

std::optional<Kelvin> as_if_hot(const EmitterTable& table, const std::array<double, 3>& line) {
  constexpr int kSteps = 400;  // even in 1 / T
  const double cold = 1 / table.coldest().value();
  const double hot = 1 / table.hottest().value();
  double nearest = kOneColour;
  std::optional<Kelvin> out;
  for (int i = 0; i <= kSteps; ++i) {
    const Kelvin t(1 / (cold + (hot - cold) * i / kSteps));
    const double distance = colour_distance(table.at(t).value, line);
    if (distance >= nearest) continue;
    nearest = distance;
    out = t;
  }
  return out;
}

Status check_lines(const CameraResponse& response, Emitter emitter, const LineRequest& lines) {
  if (!lines.any()) return {};
  if (emitter == Emitter::paper)
    return bad_lines("the paper's convention reads green alone, which can't tell lines from soot",
                     "Give --emitter grey or soot, or leave --lines away");
  // Soot's amount and temperature, and the lines' amounts; an extinction may tell one of them.
  const std::size_t unknown = 2 + std::max<std::size_t>(1, lines.named.size());
  const std::size_t live = live_channels(response);
  if (live + (response.absolute ? 1 : 0) < unknown)
    return bad_lines(
        fmt::format("the camera's {} channels{} can't tell {} unknowns: soot's amount, its temperature, and "
                    "each line's amount",
                    live, response.absolute ? " and an extinction" : "", unknown),
        "Name fewer line emitters, or give a response with its scale (calibrate colour --black-body)");
  for (std::size_t i = 0; i < lines.named.size(); ++i) {
    const LineEmitter& own = *lines.named[i];
    if (!is_seen(response, own))
      return bad_lines(fmt::format("the camera doesn't see {} ({})", own.name, own.what),
                       "Leave it away; a camera without its infrared filter may see it, told by --response");
    for (std::size_t k = 0; k < i; ++k)
      if (colour_distance(levels_of(response, own), levels_of(response, *lines.named[k])) < kOneColour)
        return bad_lines(fmt::format("{} and {} have one colour to this camera, which can't tell them apart",
                                     lines.named[k]->name, own.name),
                         "Name one of them: its amount is then that of both");
  }
  return {};
}

}  // namespace emberlock::recon
