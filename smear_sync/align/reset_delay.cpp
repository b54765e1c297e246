// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/reset_delay.h"

#include <algorithm>
#include <cmath>

#include "base/square.h"

namespace emberlock::smear {
namespace {

constexpr double kExcludedSigmas = 5;
constexpr double kToldJitterCounts = 4;  // resets
constexpr double kEvenDrawCounts = 8;    // shifts by hand
constexpr double kSmallestSpread = 0.05e-3;
constexpr int kSpreads = 9;  // each twice the one before

/// A delay taught by one camera: seconds beside the first one's, and the variance of its mean.
struct Taught {
  double offset;
  double variance;
};

/// Mean and variance of what the next camera of the model shows, its own error left out, over all spreads.
ResetDelay of_the_model(const std::vector<Taught>& taught, Seconds first, Seconds period) {
  double weights = 0;
  double mean = 0;
  double second = 0;
  for (int s = 0; s < kSpreads; ++s) {
    const double spread = square(kSmallestSpread * std::exp2(s));
    double w = 0;
    double wx = 0;
    double wxx = 0;
    double likelihood = 0;
    for (const Taught& t : taught) {
      const double precision = 1 / (t.variance + spread);
      w += precision;
      wx += precision * t.offset;
      wxx += precision * square(t.offset);
      likelihood += std::log(precision) / 2;
    }
    likelihood -= (wxx - square(wx) / w + std::log(w)) / 2;
    const double weight = std::exp(likelihood - static_cast<double>(taught.size() - 1) * 10);
    weights += weight;
    mean += weight * wx / w;
    second += weight * (square(wx / w) + 1 / w + spread);
  }
  mean /= weights;
  return {wrap_positive(first + Seconds(mean), period), Seconds(std::sqrt(second / weights - square(mean)))};
}

}  // namespace

Seconds learnt_jitter(const AlignState& state, const AlignOptions& options) {
  const double told = square(options.delay_jitter.value());
  return Seconds(
      std::sqrt((kToldJitterCounts * told + state.jitter_seen) / (kToldJitterCounts + state.jitter_samples)));
}

void learn_delay(AlignState& state, const std::vector<AlignCamera>& cameras, const AlignOptions& options,
                 std::size_t camera, Seconds observed) {
  CameraTrack& track = state.cameras[camera];
  const Seconds jitter = learnt_jitter(state, options);
  const auto expected = expected_delay(state, cameras, options, camera);
  const bool own = track.taught++ > 0;
  if (!expected) {
    track.delay = {observed, jitter};
    return;
  }
  const double seen = square(jitter.value());
  const double before = square(expected->sigma.value());
  const Seconds surprise = wrap_symmetric(observed - expected->mean, options.period);
  if (square(surprise.value()) > square(kExcludedSigmas) * (before + seen)) {
    track.delay = {observed, jitter};
    return;
  }
  if (own) {
    state.jitter_seen += square(surprise.value()) * seen / (before + seen);
    ++state.jitter_samples;
  }
  const double gain = before / (before + seen);
  track.delay = {wrap_positive(expected->mean + gain * surprise, options.period),
                 Seconds(std::sqrt(gain * seen))};
}

std::optional<ResetDelay> expected_delay(const AlignState& state, const std::vector<AlignCamera>& cameras,
                                         const AlignOptions& options, std::size_t camera) {
  if (state.cameras[camera].taught > 0) return state.cameras[camera].delay;
  // Where delays were told, what is learnt of the model is by how much they are wrong.
  const auto& told = cameras[camera].expected_delay;
  std::vector<Taught> taught;
  Seconds first;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraTrack& peer = state.cameras[i];
    if (peer.taught == 0 || cameras[i].model != cameras[camera].model) continue;
    if (told && !cameras[i].expected_delay) continue;
    const Seconds shown = told ? peer.delay->mean - cameras[i].expected_delay->mean : peer.delay->mean;
    if (taught.empty()) first = shown;
    taught.push_back(
        {wrap_symmetric(shown - first, options.period).value(), square(peer.delay->sigma.value())});
  }
  if (taught.empty()) return told;
  ResetDelay delay = of_the_model(taught, first, options.period);
  if (told) delay.mean = wrap_positive(delay.mean + told->mean, options.period);
  return delay;
}

double chance_by_hand(std::span<const Seconds> shifts, Seconds wanted, Seconds tolerance, Seconds period) {
  const double even = std::min(1.0, 2 * (tolerance / period));
  const Seconds near = std::max(tolerance, period / 16);
  const auto hits = std::count_if(shifts.begin(), shifts.end(), [&](Seconds shift) {
    return abs(wrap_symmetric(shift - wanted, period)) <= near;
  });
  return (kEvenDrawCounts * even + static_cast<double>(hits) * (tolerance / near)) /
         (kEvenDrawCounts + static_cast<double>(shifts.size()));
}

double chance_within(Seconds tolerance, Seconds sigma) {
  return std::erf(tolerance / sigma / std::sqrt(2.0));
}

std::optional<TimePoint> common_stamp(std::span<const TimePoint> stamps, TimePoint near, Seconds period) {
  if (stamps.empty()) return std::nullopt;
  Seconds sum;
  for (const TimePoint stamp : stamps) sum += wrap_symmetric(stamp - stamps.front(), period);
  const Seconds mean = stamps.front() - near + sum / static_cast<double>(stamps.size());
  return near + wrap_symmetric(mean, period);
}

}  // namespace emberlock::smear
