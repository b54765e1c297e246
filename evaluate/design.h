// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "evaluate/error_law.h"
#include "recon/views/camera_model.h"

namespace emberlock::evaluate {

// A rig before anything is bought: what an error law makes of a flame. Pure: numbers in, numbers out.

/// What is asked for, and what is assumed of cameras and hosts. Ranges are those of check_design().
struct DesignRequest {
  Meters size{0.16};          ///< height of the flame
  double speed = 2;           ///< m/s, upwards
  Kelvin temperature{1800};   ///< of what glows, as a black body
  double target = 4;          ///< held-out error, grey levels
  Seconds tolerance{0.5e-3};  ///< within which the cameras are aligned
  double noise = 1;           ///< RMS of a pixel at 4 ms and 1800 K, grey levels
  double lens = 60;           ///< degrees of view, across
  int most_cameras = 32;
  Hertz rate{24};
  double bytes_per_pixel = 1;  ///< as recorded
  double camera_price = 60;    ///< euros
  double host_link = 350e6;    ///< bytes a second that a host takes of all its cameras: one USB 3 controller
  Seconds film{10};            ///< to record and to reconstruct
};
/// Errors (bad_input) name the option of `emberlock design`.
Status check_design(const DesignRequest& request);

/// RMS noise of a pixel in grey levels where the gain brings the flame's brightest to 230 at any exposure:
/// photons count, so it falls with the root of exposure and of a black body's radiance at 600 nm (Planck).
double pixel_noise(const DesignRequest& request, Seconds exposure);

/// A set-up with what the law says of it.
struct DesignedRig {
  int cameras = 0;
  ImageSize size;
  int voxels = 0;  ///< along the longest edge of the flame's box: one for two pixels, 192 at most
  Seconds exposure{0};
  Seconds tolerance{0};
  TwinRig twin;  ///< as the law sees it
  ErrorSquares squares{};
  double euros = 0;
  [[nodiscard]] double error() const { return total(squares); }
};
DesignedRig designed(const ErrorLaw& law, const DesignRequest& request, int cameras, ImageSize size);

/// A change that lowers the error.
struct DesignStep {
  std::string what;  ///< "two more cameras"
  DesignedRig to;
  double gain = 0;  ///< of error, grey levels; above 0
};

struct Design {
  DesignedRig chosen;              ///< that of fewest euros, then pixels, or else the most accurate
  bool reached = false;            ///< whether it meets the target
  std::vector<DesignStep> steps;   ///< the largest gain first
  std::vector<DesignedRig> curve;  ///< every number of cameras with every size of picture
};
/// Of 3 to `most_cameras` cameras with pictures of kDesignSizes.
Design design(const ErrorLaw& law, const DesignRequest& request);
std::vector<ImageSize> design_sizes();

/// The cameras of a rig of even_planes(), at a distance at which the flame's box fills their pictures; the
/// flame's middle is the origin, z is up, metres.
std::vector<recon::CameraModel> placed(const DesignRequest& request, const DesignedRig& rig);

/// Computers and disks.
struct Recording {
  double bytes_per_s = 0;  ///< of all cameras
  double bytes = 0;        ///< of the film
  int hosts = 0;
  int disks = 0;
};
/// A host takes as many cameras as its link does, and for these as many disks as take `disk` bytes a second
/// each with half as much to spare. Errors: a disk or a link that doesn't take a single camera.
Result<Recording> recording_of(const DesignRequest& request, const DesignedRig& rig, double disk);

/// A place for one more camera.
struct NextCamera {
  Eigen::Vector3d towards;  ///< from the flame, unit length; z is up
  double error = 0;         ///< of the rig with it, grey levels
};
/// Places every 10 degrees all around, from 20 degrees below to 40 above the flame, the best first, each at
/// least 20 degrees from better ones; at most `count`.
std::vector<NextCamera> next_cameras(const ErrorLaw& law, const TwinRig& rig, std::size_t count);

/// A rig that stands, seen from the flame.
struct StandingRig {
  Eigen::Vector3d flame;            ///< its middle, world, metres
  Eigen::Matrix3d world_from_twin;  ///< z is the cameras' mean up
  double distance = 0;              ///< mean of the cameras', metres
  std::vector<Eigen::Vector3d> towards;
  double pixel = 0;  ///< RMS edge of a pixel at the flame, metres
};
/// The flame is where `middle` tells, or else the point nearest to all cameras' axes. Errors (bad_input):
/// fewer than two cameras; axes that are parallel; a camera in the flame's middle.
Result<StandingRig> standing(const std::vector<recon::CameraModel>& cameras,
                             const std::optional<Eigen::Vector3d>& middle);
/// The same for the law, with the exposure that balances noise and blur.
TwinRig twin_of(const ErrorLaw& law, const DesignRequest& request, const StandingRig& rig);

}  // namespace emberlock::evaluate
