// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "paper/baselines/linear_projector.h"

namespace emberlock::paper {

/// What a quantum of light at a key point is splatted to: A by columns. 8 bytes an entry; about a hundred
/// entries a key point with ten views.
struct Footprints {
  struct Entry {
    std::uint32_t ray = 0;
    float weight = 0;
  };
  std::vector<std::size_t> begin;  ///< key points + 1 values into `entries`
  std::vector<Entry> entries;      ///< of each key point in the order of the rays
};
Footprints footprints_of(const LinearProjector& projector);

}  // namespace emberlock::paper
