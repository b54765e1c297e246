// SPDX-License-Identifier: Apache-2.0
#include "report/inferno.h"

#include <cstddef>

#include <opencv2/imgproc.hpp>

namespace emberlock::report {

const std::array<Rgb, 256>& inferno() {
  static const std::array<Rgb, 256> colours = [] {
    cv::Mat levels(1, 256, CV_8UC1);
    for (int i = 0; i < 256; ++i) levels.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
    cv::Mat shown;
    cv::applyColorMap(levels, shown, cv::COLORMAP_INFERNO);
    std::array<Rgb, 256> out = {};
    for (int i = 0; i < 256; ++i) {
      const auto& bgr = shown.at<cv::Vec3b>(0, i);
      out[static_cast<std::size_t>(i)] = {bgr[2], bgr[1], bgr[0]};
    }
    return out;
  }();
  return colours;
}

}  // namespace emberlock::report
