// SPDX-License-Identifier: Apache-2.0
#include "recon/export/temperature_look_up.h"

#include <algorithm>
#include <cmath>

#include "recon/effects/effects.h"
#include "recon/temperature/temperature.h"

namespace emberlock::recon {
namespace {

constexpr int kEntries = 512;        // evenly in 1 / T
constexpr double kLeastStep = 1e-6;  // of a key; the table is linear to 1e-4 of its levels

EmitterTable table_of(const CameraResponse& response, Emitter emitter) {
  return emitter == Emitter::paper
             ? EmitterTable(response, emitter, Kelvin(kPaperColdest), Kelvin(kPaperHottest))
             : EmitterTable(response, emitter);
}

}  // namespace

TemperatureLookUp::TemperatureLookUp(const CameraResponse& response, Emitter emitter)
    : emitter_(emitter), absolute_(response.absolute) {
  while (channel_ < 2 && is_dead(response, channel_)) ++channel_;
  const EmitterTable table = table_of(response, emitter);
  const double hot = 1 / table.hottest().value();
  const double cold = 1 / table.coldest().value();
  for (int i = 0; i < kEntries; ++i) {
    const double inverse = hot + (cold - hot) * i / (kEntries - 1);
    const EmitterLevels levels = table.at(Kelvin(1 / inverse));
    const double key =
        emitter == Emitter::paper ? -std::log(levels.value[1]) - levels.log_scale : levels.value[channel_];
    // Where the key stands still or falls again, that temperature is told by none.
    if (std::isfinite(key) && (entries_.empty() || key > entries_.back().key + kLeastStep))
      entries_.push_back({key, inverse});
  }
}

double TemperatureLookUp::share(const float* rgb) const {
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += std::max(0.0, static_cast<double>(rgb[c]));
  return static_cast<double>(rgb[channel_]) / sum;
}

double TemperatureLookUp::kelvin(double key) const {
  if (entries_.size() < 2 || !(key >= entries_.front().key) || !(key < entries_.back().key)) return 0;
  const auto above = std::upper_bound(entries_.begin(), entries_.end(), key,
                                      [](double k, const Entry& entry) { return k < entry.key; });
  const auto below = above - 1;
  const double part = (key - below->key) / (above->key - below->key);
  return 1 / (below->inverse + part * (above->inverse - below->inverse));
}

std::vector<float> TemperatureLookUp::read(const std::vector<float>& emission, Meters edge) const {
  std::vector<float> out(emission.size() / 3);
  if (entries_.empty()) return out;
  const float brightest = *std::max_element(emission.begin(), emission.end());
  float green = 0;
  for (std::size_t p = 0; p < out.size(); ++p) green = std::max(green, emission[3 * p + 1]);
  // The paper's convention has no scale where the response has none: the brightest green is its hottest.
  const double offset = absolute_ ? std::log(extinction_of_opacity(kPaperOpacityOfAStep, edge).value())
                                  : entries_.front().key + std::log(static_cast<double>(green));
  for (std::size_t p = 0; p < out.size(); ++p) {
    const float* rgb = &emission[3 * p];
    const float most = std::max({rgb[0], rgb[1], rgb[2]});
    if (!(most > 0) || static_cast<double>(most) < kShareThatCounts * static_cast<double>(brightest))
      continue;
    double key = emitter_ == Emitter::paper ? offset - std::log(static_cast<double>(rgb[1])) : share(rgb);
    if (emitter_ == Emitter::paper && !absolute_) key = std::max(key, entries_.front().key);  // rounding
    out[p] = static_cast<float>(kelvin(key));
  }
  return out;
}

std::vector<float> TemperatureLookUp::read_green(const std::vector<float>& emission, float hottest) const {
  std::vector<float> out(emission.size() / 3);
  if (entries_.empty()) return out;
  const double front = entries_.front().key;
  for (std::size_t p = 0; p < out.size(); ++p) {
    const float green = emission[3 * p + 1];
    if (!(green > 0)) continue;
    const double key = front + std::log(static_cast<double>(hottest)) - std::log(static_cast<double>(green));
    out[p] = static_cast<float>(kelvin(std::max(front, key)));
  }
  return out;
}

}  // namespace emberlock::recon
