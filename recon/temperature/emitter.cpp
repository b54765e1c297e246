// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/emitter.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "recon/kernels/planck.h"

namespace emberlock::recon {
namespace {

constexpr double kReferenceNm = 550;
constexpr std::size_t kEntries = 2048;

/// E(m) / lambda, 1/um.
double soot_absorption(double nm) {
  const double um = std::clamp(nm * 1e-3, 0.4, 30.0);
  const double l = std::log(um);
  const double n = 1.811 + l * (0.1263 + l * (0.0270 + l * 0.0417));
  const double k = 0.5821 + l * (0.1213 + l * (0.2309 - l * 0.0100));
  const std::complex<double> m2 = std::pow(std::complex<double>(n, k), 2);
  return ((m2 - 1.0) / (m2 + 2.0)).imag() / (nm * 1e-3);
}

/// Where the integrand is largest: what is factored out, so that nothing underflows.
double largest_log_planck(const CameraResponse& response, double kelvin) {
  double largest = -1e300;
  for (std::size_t i = 0; i < response.wavelength_nm.size(); ++i) {
    const bool seen = std::any_of(response.level.begin(), response.level.end(),
                                  [&](const std::vector<double>& level) { return level[i] != 0; });
    if (seen) largest = std::max(largest, log_planck(response.wavelength_nm[i], kelvin));
  }
  return largest;
}

template <class Absorption>
EmitterLevels integrated(const CameraResponse& response, double kelvin, const Absorption& absorption) {
  EmitterLevels out;
  out.log_scale = largest_log_planck(response, kelvin);
  for (std::size_t c = 0; c < 3; ++c) {
    if (is_dead(response, c)) continue;
    const double level = integral(response, c, [&](double nm) {
      return absorption(nm) * std::exp(log_planck(nm, kelvin) - out.log_scale);
    });
    out.value[c] = std::max(0.0, level);
  }
  const double sum = out.value[0] + out.value[1] + out.value[2];
  if (!(sum > 0)) return {{}, 0};
  for (double& v : out.value) v /= sum;
  out.log_scale += std::log(sum);
  return out;
}

}  // namespace

Result<Emitter> parse_emitter(std::string_view word) {
  for (const Emitter emitter : {Emitter::grey, Emitter::soot, Emitter::paper})
    if (word == name(emitter)) return emitter;
  return Error{ErrorKind::bad_input, "\"" + std::string(word) + "\" is no emitter", "--emitter",
               "Give grey, soot or paper"};
}

std::string_view name(Emitter emitter) {
  return emitter == Emitter::grey ? "grey" : emitter == Emitter::soot ? "soot" : "paper";
}

double relative_absorption(Emitter emitter, double nm) {
  static const double reference = soot_absorption(kReferenceNm);
  return emitter == Emitter::soot ? soot_absorption(nm) / reference : 1;
}

EmitterLevels levels_of(const CameraResponse& response, Emitter emitter, Kelvin temperature) {
  return integrated(response, temperature.value(),
                    [&](double nm) { return relative_absorption(emitter, nm); });
}

EmitterLevels levels_of_constant_soot(const CameraResponse& response, Kelvin temperature) {
  return integrated(response, temperature.value(), [](double nm) { return kReferenceNm / nm; });
}

EmitterTable::EmitterTable(const CameraResponse& response, Emitter emitter, Kelvin coldest, Kelvin hottest)
    : emitter_(emitter), absolute_(response.absolute), coldest_(coldest), hottest_(hottest) {
  entries_.reserve(kEntries);
  for (std::size_t i = 0; i < kEntries; ++i) {
    const double share = static_cast<double>(i) / (kEntries - 1);
    const double inverse = (1 - share) / coldest.value() + share / hottest.value();
    entries_.push_back(levels_of(response, emitter, Kelvin(1 / inverse)));
  }
}

EmitterLevels EmitterTable::at(Kelvin temperature) const {
  const double t = std::clamp(temperature.value(), coldest_.value(), hottest_.value());
  const double first = 1 / coldest_.value();
  const double place = (first - 1 / t) / (first - 1 / hottest_.value()) * (kEntries - 1);
  const auto i = std::min(static_cast<std::size_t>(place), kEntries - 2);
  const double f = place - static_cast<double>(i);
  const EmitterLevels& a = entries_[i];
  const EmitterLevels& b = entries_[i + 1];
  EmitterLevels out;
  for (std::size_t c = 0; c < 3; ++c) out.value[c] = (1 - f) * a.value[c] + f * b.value[c];
  out.log_scale = (1 - f) * a.log_scale + f * b.log_scale;
  return out;
}

std::array<double, 2> chromaticity(Kelvin temperature) {
  const EmitterLevels xyz = levels_of(cie_1931_observer(), Emitter::grey, temperature);
  return {xyz.value[0], xyz.value[1]};
}

std::array<double, 3> black_body_colour(Kelvin temperature) {
  std::array<double, 3> rgb = levels_of(standard_response(), Emitter::grey, temperature).value;
  const double most = *std::max_element(rgb.begin(), rgb.end());
  if (most > 0)
    for (double& v : rgb) v /= most;
  return rgb;
}

}  // namespace emberlock::recon
