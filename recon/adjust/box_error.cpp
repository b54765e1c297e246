// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/box_error.h"

#include <algorithm>
#include <cmath>

#include "recon/effects/background.h"

namespace emberlock::recon {
namespace {

float value(const RadianceImage& behind, std::size_t at) { return behind.rgb.empty() ? 0.F : behind.rgb[at]; }

/// The first multiple of the stride from x on.
int first_of(int x, int stride) { return (x + stride - 1) / stride * stride; }

}  // namespace

ErrorOverBoxes::ErrorOverBoxes(const std::vector<const View*>& views, const std::vector<PixelBox>& boxes,
                               const Problem& problem, const Background& background, ResidualEngine& engine,
                               int stride, std::optional<std::size_t> rays)
    : engine_(engine) {
  std::vector<RadianceImage> behind;
  std::vector<double> pixels(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    const RadianceImage& image = *views[v]->image;
    const RadianceImage* own = views[v]->background.get();
    behind.push_back(background.kind == Background::Kind::black ? RadianceImage{}
                                                                : backdrop(background, image.size, own));
    std::array<double, 3> sum = {};
    for (int y = first_of(boxes[v].y0, stride); y < boxes[v].y1; y += stride)
      for (int x = first_of(boxes[v].x0, stride); x < boxes[v].x1; x += stride) {
        const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width) +
                                    static_cast<std::size_t>(x));
        for (std::size_t c = 0; c < 3; ++c) {
          const double b = static_cast<double>(image.rgb[at + c] - value(behind.back(), at + c));
          sum[c] += b * b;
        }
        pixels[v] += 1;
      }
    for (std::size_t c = 0; c < 3; ++c)
      unreached_[c] += sum[c] / (std::max(1.0, pixels[v]) * static_cast<double>(views.size()));
  }
  black_ = unreached_;
  std::vector<float> weight(rays.value_or(problem.list.rays.size()));
  for (std::size_t r = 0; r < weight.size(); ++r) {
    const std::size_t v = problem.list.rays[r].view;
    const PixelBox& box = boxes[v];
    const int width = views[v]->image->size.width;
    const int x = static_cast<int>(problem.list.pixels[r]) % width;
    const int y = static_cast<int>(problem.list.pixels[r]) / width;
    if (x < box.x0 || x >= box.x1 || y < box.y0 || y >= box.y1) continue;
    weight[r] = static_cast<float>(1 / (std::max(1.0, pixels[v]) * static_cast<double>(views.size())));
    const std::size_t at = 3 * static_cast<std::size_t>(problem.list.pixels[r]);
    for (std::size_t c = 0; c < 3; ++c) {
      const double b = static_cast<double>(views[v]->image->rgb[at + c] - value(behind[v], at + c));
      unreached_[c] -= static_cast<double>(weight[r]) * b * b;
    }
  }
  weights_ = engine.keep_weights(weight);
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
