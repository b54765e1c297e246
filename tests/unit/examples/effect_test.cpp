// SPDX-License-Identifier: Apache-2.0
// The least that an effect inside the march is (CONTRIBUTING.md, "An effect"): a policy, and the laws that
// hold of it.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "recon/kernels/march.h"
#include "tests/support/march_case.h"

namespace emberlock::recon {
namespace {

using Values = std::vector<Quad<double>>;

/// Rays as a mirror sends them that stands in the middle of the grid, across x.
struct MirroredPath {
  template <class Real>
  HOST_DEVICE static Line<Real> line(const RayTable& t, std::size_t run) {
    Line<Real> line = StraightPath::line<Real>(t, run);
    line.origin[0] = Real(t.nx - 1) - line.origin[0];
    line.direction[0] = -line.direction[0];
    return line;
  }
};

template <class Path>
Values march(const RayList& list, const Values& volume) {
  const Forward<double, ConstantExtinction<double>, Path> forward{list.table(), volume.data(), {0.05}};
  Values seen(list.rays.size());
  for (std::size_t ray = 0; ray < seen.size(); ++ray) seen[ray] = forward(ray);
  return seen;
}

template <class Path>
Values transposed(const RayList& list, const Values& residual) {
  const RayTable table = list.table();
  Values gradient(list.grid.size());
  const Adjoint<double, ConstantExtinction<double>, Path> adjoint{
      table, residual.data(), {0.05}, {table, gradient.data()}};
  for (std::size_t run = 0; run < list.runs.size(); ++run) adjoint(run);
  return gradient;
}

Values mirrored(const Grid& grid, Values volume) {
  for (auto row = volume.begin(); row != volume.end(); row += grid.nx) std::reverse(row, row + grid.nx);
  return volume;
}

TEST(ExampleEffect, AMirrorShowsTheMirroredVolume) {
  const MarchCase c = march_case();
  const Values volume = random_quads<double>(c.list.grid.size(), 1);
  const Values seen = march<MirroredPath>(c.list, volume);
  const Values expected = march<StraightPath>(c.list, mirrored(c.list.grid, volume));
  ASSERT_FALSE(seen.empty());
  for (std::size_t ray = 0; ray < seen.size(); ++ray)
    for (int lane = 0; lane < 4; ++lane) EXPECT_NEAR(seen[ray].c[lane], expected[ray].c[lane], 1e-9);
}

TEST(ExampleEffect, ItsAdjointIsItsTranspose) {
  const MarchCase c = march_case();
  const Values volume = random_quads<double>(c.list.grid.size(), 2);
  const Values residual = random_quads<double>(c.list.rays.size(), 3);
  const double by_rays = dot(march<MirroredPath>(c.list, volume), residual);
  const double by_key_points = dot(volume, transposed<MirroredPath>(c.list, residual));
  EXPECT_NEAR(by_rays / by_key_points, 1, 1e-12);
}

}  // namespace
}  // namespace emberlock::recon
