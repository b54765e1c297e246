// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/extinction_field.h"

#include <algorithm>

namespace emberlock::recon {
namespace {

/// Soot is thought to be at most so many times denser than its mean: beyond, brightness tells of heat.
constexpr float kDensest = 6;

float luminance(const Rgba& x) { return 0.299F * x.c[0] + 0.587F * x.c[1] + 0.114F * x.c[2]; }  // Rec. 601

float mean_luminance(const Problem& problem, const std::vector<Rgba>& x) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t p = 0; p < x.size(); ++p) {
    if (problem.active[p] == 0) continue;
    sum += static_cast<double>(luminance(x[p]));
    ++count;
  }
  return count > 0 ? static_cast<float>(sum / static_cast<double>(count)) : 0;
}

}  // namespace

std::vector<float> expected_extinction(const Problem& problem, const Extinction& extinction,
                                       const std::vector<Rgba>& x) {
  const Grid& g = problem.grid();
  const auto edge = static_cast<double>(g.edge);
  const auto even = static_cast<float>(extinction.value.value() * edge);
  const auto soot = static_cast<float>(extinction.soot.value() * edge);
  std::vector<float> field(g.size());
  std::size_t voxel = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i)
        if (problem.crop.hull.inside[voxel++] != 0)
          for (int c = 0; c < 8; ++c) field[g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] += 0.125F;
  const float mean = soot > 0 ? mean_luminance(problem, x) : 0;
  for (std::size_t p = 0; p < field.size(); ++p) {
    if (problem.active[p] == 0) continue;
    const float density = mean > 0 ? std::min(kDensest, luminance(x[p]) / mean) : field[p];
    field[p] = even * field[p] + soot * density;
  }
  return field;
}

std::vector<Rgba> with_extinction(std::vector<Rgba> x, const std::vector<float>& extinction) {
  for (std::size_t p = 0; p < x.size(); ++p) x[p].c[3] = extinction[p];
  return x;
}

}  // namespace emberlock::recon
