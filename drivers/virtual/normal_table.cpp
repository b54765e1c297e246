// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/normal_table.h"

#include <cmath>

namespace emberlock::drivers {
namespace {

/// The quantile of the standard normal distribution, by bisection; 0 < p < 1.
double normal_quantile(double p) {
  double low = -10, high = 10;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace

NormalTable::NormalTable() {
  std::array<double, kSize> q{};
  double squares = 0;
  for (std::size_t i = 0; i < kSize; ++i) {
    q[i] = normal_quantile((static_cast<double>(i) + 0.5) / kSize);
    squares += q[i] * q[i];
  }
  const double scale = std::sqrt(0.5 * kSize / squares);
  for (std::size_t i = 0; i < kSize; ++i) quantiles_[i] = static_cast<float>(q[i] * scale);
}

const NormalTable& NormalTable::instance() {
  static const NormalTable table;
  return table;
}

}  // namespace emberlock::drivers
