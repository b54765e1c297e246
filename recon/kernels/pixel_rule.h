// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "base/random.h"

namespace emberlock::recon {

/// Where a pixel lies in Bayer's order (1973), 0..15: successive ones lie as far apart as can be.
HOST_DEVICE inline int bayer(int x, int y) {
  const auto of_two = [](int a, int b) { return 2 * (a ^ b) + b; };
  return 4 * of_two(x & 1, y & 1) + of_two(x >> 1 & 1, y >> 1 & 1);
}

/// Which of a list's subsets a pixel belongs to; -1: none.
struct PixelRule {
  static constexpr int kHoldOutOneIn = 32;

  int stride = 1;  ///< along both axes; other pixels are in `others`
  int others = -1;
  int dealt = 1;         ///< 1, 4 or 16 subsets, to which pixels are dealt in Bayer's order
  int held_out = -1;     ///< the subset of pixels that are kept from these; -1: none are
  bool by_view = false;  ///< the subset is the view's number
  int left_out = -1;     ///< that is this view as a whole; -1: one pixel in kHoldOutOneIn of all views

  HOST_DEVICE inline int operator()(std::size_t view, int x, int y) const {
    if (by_view) return static_cast<int>(view);
    if (x % stride != 0 || y % stride != 0) return others;
    if (held_out >= 0 && (left_out >= 0 ? view == static_cast<std::size_t>(left_out) : by_chance(x, y)))
      return held_out;
    return bayer(x / stride, y / stride) * dealt / 16;
  }

 private:
  HOST_DEVICE static bool by_chance(int x, int y) {
    return random_bits(0, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y)) % kHoldOutOneIn == 0;
  }
};

}  // namespace emberlock::recon
