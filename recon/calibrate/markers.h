// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/image.h"
#include "recon/views/camera_model.h"

namespace emberlock::recon {

/// An ArUco marker in a picture (Garrido-Jurado et al. 2014).
struct SeenMarker {
  int id = 0;
  /// Of its black border: the marker's own top left, top right, bottom right, bottom left. Pixel centres are
  /// at +0.5.
  std::array<Eigen::Vector2d, 4> corners;
};

/// The names of all dictionaries, as OpenCV counts them and without its DICT_: "4X4_50", ..., "ORIGINAL".
const std::vector<std::string>& marker_dictionaries();
/// The name of that list which is meant by "4x4_50" or "DICT_4X4_50".
std::optional<std::string> marker_dictionary_name(std::string_view name);
/// How many markers there are in a dictionary of that list.
int markers_in(const std::string& dictionary);

enum class MarkerInk {
  dark,   ///< black on white
  light,  ///< white on black
};

/// The markers of a dictionary that are seen in a picture of any format. Each corner is where two sides meet:
/// lines through the places at which brightness, from the border outwards, first is half way between the
/// border's and the brightest around it, which may be a thin rim; they are straight where the lens's
/// distortion is removed. `light`, if given, is the light of each of 256 grey levels, by which "half way" is
/// meant; else levels are proportional to light.
std::vector<SeenMarker> find_markers(const ImageView& picture, const std::string& dictionary,
                                     const Intrinsics& lens, const std::array<float, 256>* light = nullptr,
                                     MarkerInk ink = MarkerInk::dark);

/// The mirror image of a picture (left and right exchanged), gray8.
Image mirror_picture(const ImageView& picture);

/// Draws a marker, `cell` pixels per cell of its pattern, with a white margin of one cell.
Image draw_marker(const std::string& dictionary, int id, int cell);

}  // namespace emberlock::recon
