// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/finite_element_tomography/element_basis.h"

#include <cstddef>
#include <cstdint>
#include <utility>

namespace emberlock::paper {
namespace {

std::size_t volume_of(const std::array<int, 3>& size) {
  return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
         static_cast<std::size_t>(size[2]);
}

/// The lines along an axis: where each begins, and the stride along it.
struct Lines {
  std::size_t count, stride, outer;
  Lines(const std::array<int, 3>& size, std::size_t axis)
      : count(volume_of(size) / static_cast<std::size_t>(size[axis])), stride(1) {
    for (std::size_t a = 0; a < axis; ++a) stride *= static_cast<std::size_t>(size[a]);
    outer = stride * static_cast<std::size_t>(size[axis]);
  }
  [[nodiscard]] std::size_t begin(std::size_t line) const { return line / stride * outer + line % stride; }
};

}  // namespace

ElementBasis::ElementBasis(const LinearProjector& projector, int spacing) : projector_(projector) {
  const recon::Grid& fine = projector.grid();
  const std::array<int, 3> points = {fine.nx, fine.ny, fine.nz};
  std::array<int, 3> size = {};
  for (std::size_t a = 0; a < 3; ++a) {
    for (int i = 0; i < points[a]; ++i)
      places_[a].push_back({static_cast<std::size_t>(i / spacing),
                            static_cast<float>(i % spacing) / static_cast<float>(spacing)});
    size[a] = nodes_along(a);
  }
  recon::Grid& grid = nodes_.grid;
  grid.edge = fine.edge * static_cast<float>(spacing);
  grid.nx = size[0];
  grid.ny = size[1];
  grid.nz = size[2];
  for (std::size_t a = 0; a < 3; ++a) grid.origin[a] = fine.origin[a];
  Light reach;
  gather(Light(fine.size(), recon::Rgba{{1, 0, 0, 0}}), reach);
  nodes_.active.resize(reach.size());
  for (std::size_t p = 0; p < reach.size(); ++p) nodes_.active[p] = reach[p].c[0] > 0 ? 1 : 0;
}

int ElementBasis::nodes_along(std::size_t axis) const {
  return static_cast<int>(places_[axis].back().first) + 2;
}

void ElementBasis::along(std::size_t axis, std::array<int, 3>& size, const Light& from, Light& to) const {
  const std::vector<Place>& places = places_[axis];
  const Lines coarse(size, axis);
  size[axis] = static_cast<int>(places.size());
  const Lines fine(size, axis);
  to.resize(volume_of(size));
  each_of(fine.count, projector_.pool(), [&](std::size_t line) {
    const recon::Rgba* const in = &from[coarse.begin(line)];
    recon::Rgba* out = &to[fine.begin(line)];
    for (const Place& place : places) {
      const recon::Rgba* const node = in + place.first * coarse.stride;
      *out = recon::mix(place.share, node[0], node[coarse.stride]);
      out += fine.stride;
    }
  });
}

void ElementBasis::back_along(std::size_t axis, std::array<int, 3>& size, const Light& from,
                              Light& to) const {
  const std::vector<Place>& places = places_[axis];
  const Lines fine(size, axis);
  size[axis] = nodes_along(axis);
  const Lines coarse(size, axis);
  to.assign(volume_of(size), recon::Rgba{});
  each_of(coarse.count, projector_.pool(), [&](std::size_t line) {
    const recon::Rgba* in = &from[fine.begin(line)];
    recon::Rgba* const out = &to[coarse.begin(line)];
    for (const Place& place : places) {
      recon::Rgba* const node = out + place.first * coarse.stride;
      node[0] = node[0] + (1 - place.share) * *in;
      node[coarse.stride] = node[coarse.stride] + place.share * *in;
      in += fine.stride;
    }
  });
}

void ElementBasis::spread(const Light& c, Light& x) const {
  const recon::Grid& g = nodes_.grid;
  std::array<int, 3> size = {g.nx, g.ny, g.nz};
  Light part;
  along(2, size, c, x);
  along(1, size, x, part);
  along(0, size, part, x);
  each_of(x.size(), projector_.pool(), [&](std::size_t p) {
    if (!projector_.takes_part(p)) x[p] = recon::Rgba{};
  });
}

void ElementBasis::gather(const Light& x, Light& c) const {
  const recon::Grid& g = projector_.grid();
  std::array<int, 3> size = {g.nx, g.ny, g.nz};
  Light part = x;
  each_of(part.size(), projector_.pool(), [&](std::size_t p) {
    if (!projector_.takes_part(p)) part[p] = recon::Rgba{};
  });
  back_along(0, size, part, c);
  back_along(1, size, c, part);
  back_along(2, size, part, c);
}

void ElementMap::project(const Light& c, Light& y) const {
  Light x;
  basis_.spread(c, x);
  projector_.project(x, y);
}

void ElementMap::back_project(const Light& y, Light& c) const {
  Light x;
  projector_.back_project(y, x);
  basis_.gather(x, c);
}

}  // namespace emberlock::paper
