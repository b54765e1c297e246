#include "smear_sync/reset_delay.h"

#include <cmath>
#include <complex>
#include <numbers>

namespace emberlock {
namespace {

constexpr double kExcludedSigmas = 5;

double square(double x) { return x * x; }

}  // namespace

ResetDelay learn_delay(const std::optional<ResetDelay>& expected, Seconds observed,
                       const AlignOptions& options) {
  const double seen = square(options.delay_jitter.value());
  if (!expected) return {observed, options.delay_jitter};
  const double before = square(expected->sigma.value());
  const Seconds surprise = wrap_symmetric(observed - expected->mean, options.period);
  if (square(surprise.value()) > square(kExcludedSigmas) * (before + seen))
    return {observed, options.delay_jitter};
  const double gain = before / (before + seen);
  return {wrap_positive(expected->mean + gain * surprise, options.period), Seconds(std::sqrt(gain * seen))};
}

std::optional<ResetDelay> expected_delay(const AlignState& state, const std::vector<AlignCamera>& cameras,
                                         const AlignOptions& options, std::size_t camera) {
  const CameraTrack& own = state.cameras[camera];
  if (own.taught > 0) return own.delay;

  std::complex<double> sum = 0;
  double weights = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraTrack& peer = state.cameras[i];
    if (peer.taught == 0 || cameras[i].model != cameras[camera].model) continue;
    const double w = 1 / (square(peer.delay->sigma.value()) + square(options.delay_spread.value()));
    sum += std::polar(w, 2 * std::numbers::pi * (peer.delay->mean / options.period));
    weights += w;
  }
  if (weights == 0) return cameras[camera].expected_delay;
  const double mean = std::arg(sum) / (2 * std::numbers::pi);
  return ResetDelay{wrap_positive(mean * options.period, options.period),
                    Seconds(std::sqrt(1 / weights + square(options.delay_spread.value())))};
}

std::optional<TimePoint> common_stamp(std::span<const TimePoint> stamps, TimePoint near, Seconds period) {
  if (stamps.empty()) return std::nullopt;
  Seconds sum;
  for (const TimePoint stamp : stamps) sum += wrap_symmetric(stamp - stamps.front(), period);
  const Seconds mean = stamps.front() - near + sum / static_cast<double>(stamps.size());
  return near + wrap_symmetric(mean, period);
}

}  // namespace emberlock
