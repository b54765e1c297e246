// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"

namespace emberlock {

/// Counter-based random numbers: a value is a pure function of (seed, stream, counter), so results don't
/// depend on the order of evaluation or on thread counts. The mixer is SplitMix64's finaliser (Steele, Lea,
/// Flood 2014) applied to each word in turn.
HOST_DEVICE constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

HOST_DEVICE constexpr std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream,
                                                std::uint64_t counter) {
  return mix64(counter ^ mix64(stream ^ mix64(seed)));
}

/// In the open interval (0, 1): 53 bits at bin centres.
HOST_DEVICE constexpr double uniform(std::uint64_t bits) {
  return (static_cast<double>(bits >> 12) + 0.5) * (1.0 / 4503599627370496.0);
}

HOST_DEVICE constexpr double random_uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
  return uniform(random_bits(seed, stream, counter));
}

/// Standard normal, by Box and Muller (1958).
HOST_DEVICE inline double random_normal(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
  const std::uint64_t bits = random_bits(seed, stream, counter);
  return std::sqrt(-2 * std::log(uniform(bits))) * std::cos(6.283185307179586 * uniform(mix64(bits)));
}

/// The same generators as a stateful stream, for code that draws one number after another.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}
  std::uint64_t bits() { return random_bits(seed_, stream_, counter_++); }
  double uniform(double low = 0, double high = 1) { return low + (high - low) * emberlock::uniform(bits()); }
  double normal(double mean = 0, double sigma = 1) {
    return mean + sigma * random_normal(seed_, stream_, counter_++);
  }

 private:
  std::uint64_t seed_;
  std::uint64_t stream_;
  std::uint64_t counter_ = 0;
};

}  // namespace emberlock
