// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "recon/views/box.h"
#include "recon/views/camera_model.h"
#include "recon/views/view.h"
#include "report/html.h"

namespace emberlock::report {

/// Where a camera stands and looks, in the world's frame.
struct PlanCamera {
  std::string name;
  Eigen::Vector3d position;                       ///< metres
  Eigen::Vector3d direction;                      ///< in which it looks; any length but 0
  Eigen::Vector3d up = Eigen::Vector3d::Zero();   ///< of its picture; 0: not known
  recon::ViewRole role = recon::ViewRole::input;  ///< a held-out one is drawn in another colour
};

PlanCamera plan_camera(std::string name, const recon::CameraModel& camera,
                       recon::ViewRole role = recon::ViewRole::input);

/// The distance of two neighbours and the angle between the directions in which they look.
struct Baseline {
  std::size_t a = 0, b = 0;  ///< indices of the cameras, a < b
  double length = 0;         ///< metres
  double angle = 0;          ///< radians
};

/// Neighbours are two cameras without a third that is nearer to both than they are to each other: the
/// relative neighbourhood graph (Toussaint 1980). In a ring these are those side by side, in an array those
/// above one another too.
std::vector<Baseline> baselines(const std::vector<PlanCamera>& cameras);

/// The plan (from above) and the side view, in one scale, with the world's axes: cameras by number, from 0,
/// the directions in which they look, baselines with their lengths, and the box. Above is the axis of the
/// world that is nearest to the cameras' mean up.
std::vector<HtmlPage::Picture> camera_plan_pictures(const std::vector<PlanCamera>& cameras,
                                                    const std::optional<recon::Box>& box);

/// A heading, these pictures, and tables of the positions and the baselines. Nothing without cameras.
void add_camera_plan(HtmlPage& page, const std::vector<PlanCamera>& cameras,
                     const std::optional<recon::Box>& box);

}  // namespace emberlock::report
