// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

/// Adds up the terms of one chunk of so many elements, in their order: few, where a term is work. Sums of the
/// same chunks in their order have the same bits however many threads made them.
template <class Term, std::size_t kElements = 32>
struct SumChunk {
  Term term;
  std::size_t first = 0, last = 0;  ///< elements
  Quad<double>* sums = nullptr;     ///< one a chunk

  [[nodiscard]] HOST_DEVICE std::size_t chunks() const { return (last - first + kElements - 1) / kElements; }
  HOST_DEVICE void operator()(std::size_t chunk) const {
    const std::size_t begin = first + chunk * kElements;
    const std::size_t end = last - begin < kElements ? last : begin + kElements;
    Quad<double> sum;
    for (std::size_t i = begin; i < end; ++i) sum = sum + term(i);
    sums[chunk] = sum;
  }
};

/// What was summed already.
struct Summed {
  const Quad<double>* sums = nullptr;

  HOST_DEVICE Quad<double> operator()(std::size_t i) const { return sums[i]; }
};

}  // namespace emberlock::recon
