// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "paper/baselines/linear_projector.h"
#include "paper/baselines/penalised_least_squares.h"

namespace emberlock::paper {

/// B: trilinear finite elements (tensor products of linear B-splines) with a node every `spacing` key points
/// along each axis, the last ones at or beyond the end, at the key points of a projector's hull. All entries
/// of B are >= 0; where all nodes are 1 so is every key point.
class ElementBasis {
 public:
  /// The projector must outlive it.
  ElementBasis(const LinearProjector& projector, int spacing);

  /// The nodes; those whose element reaches no key point of the hull take no part.
  [[nodiscard]] const Lattice& nodes() const { return nodes_; }
  /// x = B c, 0 at key points beyond the hull.
  void spread(const Light& c, Light& x) const;
  /// c = B^T x.
  void gather(const Light& x, Light& c) const;

 private:
  /// A key point lies between the nodes `first` and the next, that share of the way.
  struct Place {
    std::size_t first = 0;
    float share = 0;
  };
  [[nodiscard]] int nodes_along(std::size_t axis) const;
  void along(std::size_t axis, std::array<int, 3>& size, const Light& from, Light& to) const;
  void back_along(std::size_t axis, std::array<int, 3>& size, const Light& from, Light& to) const;

  const LinearProjector& projector_;
  std::array<std::vector<Place>, 3> places_;  ///< of the axes, one a key point
  Lattice nodes_;
};

/// A B.
class ElementMap final : public LinearMap {
 public:
  /// Both must outlive it.
  ElementMap(const LinearProjector& projector, const ElementBasis& basis)
      : projector_(projector), basis_(basis) {}
  [[nodiscard]] std::size_t unknowns() const override { return basis_.nodes().active.size(); }
  [[nodiscard]] const Light& seen() const override { return projector_.seen(); }
  [[nodiscard]] recon::Pool& pool() const override { return projector_.pool(); }
  void project(const Light& c, Light& y) const override;
  void back_project(const Light& y, Light& c) const override;

 private:
  const LinearProjector& projector_;
  const ElementBasis& basis_;
};

}  // namespace emberlock::paper
