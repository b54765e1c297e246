// SPDX-License-Identifier: Apache-2.0
#include "recon/export/picture_quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace emberlock::recon {
namespace {

/// As numbers, one matrix of three channels.
cv::Mat matrix(const Image& image) {
  const ImageView view = image.view();
  const cv::Mat bytes(view.height(), view.width(), CV_8UC3, const_cast<std::byte*>(view.data),
                      view.stride);  // NOLINT(*-const-cast): only read
  cv::Mat numbers;
  bytes.convertTo(numbers, CV_64FC3);  // variances are differences of large numbers
  return numbers;
}

void check(const Image& a, const Image& b) {
  if (a.layout() != b.layout() || a.layout().format != PixelFormat::rgb8)
    throw std::logic_error("pictures of two sizes, or not rgb8, are compared");
}

/// Sum of the squared differences over a box, all channels.
double squares(const Image& a, const Image& b, const PixelBox& box) {
  double sum = 0;
  for (int y = box.y0; y < box.y1; ++y) {
    const std::uint8_t* p = a.view().row_as<std::uint8_t>(y);
    const std::uint8_t* q = b.view().row_as<std::uint8_t>(y);
    for (int i = 3 * box.x0; i < 3 * box.x1; ++i) sum += std::pow(p[i] - q[i], 2);
  }
  return sum;
}

double pixels_of(const PixelBox& box) { return static_cast<double>(box.x1 - box.x0) * (box.y1 - box.y0); }

}  // namespace

double psnr(const Image& a, const Image& b) {
  check(a, b);
  const PixelBox all{0, 0, a.layout().size.width, a.layout().size.height};
  const double mean = squares(a, b, all) / (3 * pixels_of(all));
  return mean > 0 ? 10 * std::log10(255 * 255 / mean) : std::numeric_limits<double>::infinity();
}

double ssim(const Image& a, const Image& b) {
  check(a, b);
  const auto blurred = [](const cv::Mat& m) {
    cv::Mat out;
    cv::GaussianBlur(m, out, {11, 11}, 1.5, 1.5, cv::BORDER_REFLECT);
    return out;
  };
  const cv::Mat x = matrix(a);
  const cv::Mat y = matrix(b);
  const cv::Mat mean_x = blurred(x);
  const cv::Mat mean_y = blurred(y);
  const cv::Mat both = mean_x.mul(mean_y);
  const cv::Mat squared_x = mean_x.mul(mean_x);
  const cv::Mat squared_y = mean_y.mul(mean_y);
  const cv::Mat variance_x = blurred(x.mul(x)) - squared_x;
  const cv::Mat variance_y = blurred(y.mul(y)) - squared_y;
  const cv::Mat covariance = blurred(x.mul(y)) - both;
  const double c1 = std::pow(0.01 * 255, 2);
  const double c2 = std::pow(0.03 * 255, 2);
  const cv::Scalar first = cv::Scalar::all(c1);
  const cv::Scalar second = cv::Scalar::all(c2);
  const cv::Mat above = cv::Mat(2 * both + first).mul(cv::Mat(2 * covariance + second));
  const cv::Mat below = cv::Mat(squared_x + squared_y + first).mul(cv::Mat(variance_x + variance_y + second));
  cv::Mat likeness;
  cv::divide(above, below, likeness);
  const cv::Scalar mean = cv::mean(likeness);
  return (mean[0] + mean[1] + mean[2]) / 3;
}

std::optional<Flicker> flicker(const ShownFrame& before, const ShownFrame& now) {
  if (before.pictures.size() != now.pictures.size()) return std::nullopt;
  Flicker sums;
  double pixels = 0;
  for (std::size_t v = 0; v < now.pictures.size(); ++v) {
    if (before.pictures[v].layout() != now.pictures[v].layout()) return std::nullopt;
    const PixelBox& a = before.boxes[v];
    const PixelBox& b = now.boxes[v];
    PixelBox box = a.empty() ? b : a;
    if (!b.empty())
      box = {std::min(box.x0, b.x0), std::min(box.y0, b.y0), std::max(box.x1, b.x1), std::max(box.y1, b.y1)};
    if (box.empty()) continue;
    sums.pictures += squares(before.pictures[v], now.pictures[v], box);
    sums.renders += squares(before.renders[v], now.renders[v], box);
    pixels += pixels_of(box);
  }
  if (!(pixels > 0)) return std::nullopt;
  return Flicker{std::sqrt(sums.pictures / (3 * pixels)), std::sqrt(sums.renders / (3 * pixels))};
}

}  // namespace emberlock::recon
