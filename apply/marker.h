// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/calibrate/board.h"
#include "recon/views/camera_model.h"

namespace emberlock::apply {

/// What lies on the plate and gives the camera's pose: an ArUco marker, or a ChArUco board. Its frame, for a
/// viewer who stands before it: the origin in its middle, x to the right, y upwards, z out of the plate,
/// metres.
struct Marker {
  std::string dictionary;                  ///< by recon::marker_dictionaries()
  int id = 0;                              ///< of the one marker
  Meters edge{0};                          ///< of its black border
  std::optional<recon::Board> board = {};  ///< instead of the one marker

  /// Width and height of what is printed black on white.
  [[nodiscard]] Eigen::Vector2d size() const;
};

/// "aruco:4X4_50:0:80mm": dictionary, number, edge of the black border; or a ChArUco board as
/// recon::parse_board() reads it. The error's remedy is the format.
Result<Marker> parse_marker(std::string_view text);
/// The text that parse_marker() reads.
std::string marker_words(const Marker& marker);

/// A corner of it, and where it is seen (pixel centres at +0.5).
struct MarkerPoint {
  Eigen::Vector3d place;
  Eigen::Vector2d pixel;
};
/// Its four corners, or those of the board's that are seen; empty where it isn't seen. It may be printed
/// white on black. `light`: see recon::find_markers().
std::vector<MarkerPoint> find_marker(const ImageView& picture, const Marker& marker,
                                     const recon::Intrinsics& lens,
                                     const std::array<float, 256>* light = nullptr);

/// Whether a picture shows it only in its mirror image, where find_marker() doesn't see it.
bool is_mirrored(const ImageView& picture, const Marker& marker, const recon::Intrinsics& lens);

/// What a picture shows instead: "markers of 5X5_50, numbers 3 and 4", by the first of OpenCV's dictionaries
/// of which most are seen; empty where it shows no markers at all.
std::string other_markers(const ImageView& picture, const recon::Intrinsics& lens);

}  // namespace emberlock::apply
