// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/box_error.h"

#include <algorithm>
#include <cmath>

#include "recon/views/view.h"

namespace emberlock::recon {
namespace {

/// The multiples of the stride in [from, to).
int multiples(int from, int to, int stride) {
  return (to + stride - 1) / stride - (from + stride - 1) / stride;
}

/// Pixels of a box that an error counts: on the stride's grid and not left out.
double counted_pixels(const PixelBox& b, int stride, const ProblemPicture& picture) {
  double pixels = static_cast<double>(multiples(b.x0, b.x1, stride)) * multiples(b.y0, b.y1, stride);
  if (!picture.bounds) return pixels;
  const auto width = static_cast<std::size_t>(picture.image->size.width);
  const auto first = [stride](int from) { return (from + stride - 1) / stride * stride; };
  for (int y = first(b.y0); y < b.y1; y += stride)
    for (int x = first(b.x0); x < b.x1; x += stride)
      pixels -=
          is_left_out((*picture.bounds)[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)])
              ? 1
              : 0;
  return pixels;
}

}  // namespace

ErrorOverBoxes::ErrorOverBoxes(const std::vector<PixelBox>& boxes, const Problem& problem,
                               ResidualEngine& engine, int stride, std::optional<std::size_t> rays)
    : engine_(engine) {
  std::vector<WeighedBox> weighed;
  for (std::size_t v = 0; v < boxes.size(); ++v) {
    const PixelBox& b = boxes[v];
    const double pixels = counted_pixels(b, stride, problem.pictures[v]);
    const double views = static_cast<double>(boxes.size());
    weighed.push_back({b.x0, b.y0, b.x1, b.y1, static_cast<float>(1 / (std::max(1.0, pixels) * views))});
  }
  const ResidualEngine::Weighed found = engine.weigh(weighed, rays.value_or(problem.rays()), stride);
  weights_ = found.number;
  black_ = found.black_of_boxes;
  for (std::size_t c = 0; c < 3; ++c) unreached_[c] = found.black_of_boxes[c] - found.black_of_rays[c];
}

std::array<double, 3> ErrorOverBoxes::operator()() const {
  std::array<double, 3> sum = engine_.weighted_squares(weights_);
  for (std::size_t c = 0; c < 3; ++c) sum[c] = std::sqrt(std::max(0.0, sum[c] + unreached_[c]));
  return sum;
}

std::array<double, 3> ErrorOverBoxes::black() const {
  std::array<double, 3> root = {};
  for (std::size_t c = 0; c < 3; ++c) root[c] = std::sqrt(black_[c]);
  return root;
}

}  // namespace emberlock::recon
