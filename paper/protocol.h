// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "recon/views/view.h"

namespace emberlock::paper {

/// What is filmed.
enum class Subject { flame, smoke };
std::string_view name(Subject subject);

/// How what is filmed sends out its light.
enum class Optics {
  physical,  ///< soot glows and absorbs as soot does; smoke scatters the sun
  /// The paper's model, by which its own scenes are rendered: an opacity of 0.05 a step, as long as a voxel,
  /// for all channels, wherever there is light.
  papers,
};

/// A camera on a sphere around the middle of the gas, one and a half times as far away as its box is wide
/// (the paper: 30 cm from the middle of 20), that looks there with a field of view of 60 degrees along its
/// longer side.
struct CameraPlace {
  double azimuth = 0, elevation = 0;  ///< degrees
  recon::ViewRole role = recon::ViewRole::input;
};

/// One set of pictures.
struct Case {
  std::string name;  ///< also a folder's
  std::vector<CameraPlace> cameras;
  ImageSize image{640, 480};
  Optics optics = Optics::physical;
  double noise = 0;       ///< of the input pictures: standard deviation, grey levels
  double pose_error = 0;  ///< of the input cameras: standard deviation of their direction, pixels
};

/// What the paper prints for a method: RMSE of R, G and B, grey levels; 0: not told.
struct PrintedErrors {
  std::string_view method, what;
  std::array<double, 3> rgb = {};
};

/// One table or figure of the paper's results: what is filmed, by which cameras, and by what it is
/// reconstructed.
struct Protocol {
  std::string_view name;     ///< "nine-views"
  std::string_view title;    ///< a heading
  std::string_view paper;    ///< which of its tables and figures
  std::string_view differs;  ///< how what is done here differs from what the paper did
  Subject subject = Subject::flame;
  std::vector<Case> cases;
  std::vector<std::string_view> methods;  ///< names of methods()
  bool temperatures = false;
  std::vector<int> iterations = {};  ///< errors after each of these, of methods that iterate by passes
  std::vector<PrintedErrors> printed = {};
};

/// How large and how much.
enum class Extent {
  full,
  quick,  ///< small pictures, few methods and cameras: whether all of it works, not how good it is
};

// One file each.
Protocol iterations_protocol(Extent extent);
Protocol nine_views_protocol(Extent extent);
Protocol cameras_protocol(Extent extent);
Protocol captured_protocol(Extent extent);
Protocol four_views_protocol(Extent extent);
Protocol smoke_protocol(Extent extent);

/// All of them, in the paper's order.
std::vector<Protocol> protocols(Extent extent);
/// Those of these names; all where none is given. Error: none of that name; lists them.
Result<std::vector<Protocol>> choose_protocols(const std::vector<std::string>& names, Extent extent);

/// Cameras evenly around, alternately 10 degrees above and below the plane: none stands there exactly, as in
/// the paper. The first stands at `first` degrees.
std::vector<CameraPlace> ring(int count, double first = 18);
/// The paper's size, or a quarter of it.
ImageSize image_size(Extent extent, ImageSize full = {640, 480});

}  // namespace emberlock::paper
