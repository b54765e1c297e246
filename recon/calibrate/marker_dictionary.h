// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <opencv2/aruco.hpp>

#include "base/image.h"

namespace emberlock::recon {

// What searches with OpenCV share.

/// A dictionary of ArUco markers by OpenCV's name, "4X4_50" or "DICT_4X4_50" in any case. Null: there is
/// none.
cv::Ptr<cv::aruco::Dictionary> marker_dictionary(std::string_view name);

/// The picture as 8-bit grey, with its white at 255.
cv::Mat grey_of(const ImageView& picture);

/// Black markers in a picture, as OpenCV sees them.
struct FoundQuads {
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;  ///< four of each marker; pixel centres are whole numbers
};
/// Each marker once, also where the outline of the white margin around its border is as clear as the
/// border's. `margin`: the width of the margin, in edges of the marker.
FoundQuads find_quads(const cv::Mat& grey, const cv::Ptr<cv::aruco::Dictionary>& dictionary, double margin);

}  // namespace emberlock::recon
