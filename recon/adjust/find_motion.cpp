// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/find_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "recon/adjust/box_error.h"
#include "recon/adjust/coarse_pictures.h"
#include "recon/adjust/descent.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/adjust/small_scene.h"
#include "recon/effects/motion.h"

namespace emberlock::recon {
namespace {

constexpr int kCoarseGrid = 64;          // voxels along the longest side, at most
constexpr double kMotionPixels = 30000;  // of the flames' boxes
constexpr int kMotionPasses = 6;
constexpr double kFastestFlame = 5;  // m/s
constexpr double kFirstStep = 0.5;   // m/s, of the search
// The share of the error by which moving sideways must lower it. Flames that only change their shape as they
// rise look like 0.1 m/s sideways, one time in 48 like 0.24 m/s, which lowers it by 5 %.
constexpr double kLeastSideways = 0.08;
constexpr double kEdgesAStep = 1.5;  // coarse voxels that the latest view's flame moves in a step, at most

Motion carried(const Eigen::Vector3d& velocity) {
  return {Motion::Carry::uniform, {velocity.x(), velocity.y(), velocity.z()}};
}

/// Root of the mean over the views of the squared lateness (or of its standard error).
double rms(const Scene& scene, Seconds View::*of) {
  double sum = 0;
  for (const View& view : scene.views) sum += (view.*of).value() * (view.*of).value();
  return std::sqrt(sum / std::max(1.0, static_cast<double>(scene.views.size())));
}

class MotionProbe {
 public:
  explicit MotionProbe(const MotionSearch& search)
      : small_(small_scene(search.scene,
                           masks_before(search.scene, search.effects.background,
                                        search.options.flame_threshold, search.options.compute),
                           kMotionPixels)),
        grid_(
            grid_over(search.scene.box,
                      std::min(kCoarseGrid, std::max({search.grid.nx, search.grid.ny, search.grid.nz}) - 1))),
        options_(search.options),
        pool_(search.pool) {
    const Extinction& extinction = search.effects.extinction;
    effects_.extinction = constant_extinction(extinction.value + extinction.soot);
    effects_.background = search.effects.background;
    effects_.sensor.clipping = search.effects.sensor.clipping;
    effects_.sensor.white = search.effects.sensor.white;
    boxes_ = flame_boxes(
        small_, masks_before(small_, effects_.background, options_.flame_threshold, options_.compute));
  }

  [[nodiscard]] const Scene& scene() const { return small_; }
  [[nodiscard]] double edge() const { return static_cast<double>(grid_.edge); }

  /// RMS over the flames' boxes that a cold solve leaves; infinite where no hull is left, or it diverges.
  [[nodiscard]] double error(const Eigen::Vector3d& velocity) const try {
    const Sensor& sensor = effects_.sensor;
    const double white = sensor.clipping == Sensor::Clipping::at_white ? sensor.white : 0;
    const Scene scene = at_one_instant(small_, carried(velocity), white);
    const auto hull =
        carve(scene, masks_before(scene, effects_.background, options_.flame_threshold, options_.compute),
              grid_, options_.compute);
    if (!hull) return std::numeric_limits<double>::infinity();
    SolverSetup setup{{}, boxes_, *hull, effects_, options_, pool_};
    for (const View& view : scene.views) setup.views.push_back(&view);
    const Level level = make_level(setup, *hull, 1, 4);
    Descent descent(level, setup.optics(hull->grid), setup);
    for (int p = 0; p < kMotionPasses; ++p) descent.pass();
    descent.settle();
    const ErrorOverBoxes error(boxes_, level.problem, descent.engine());
    return all_channels(error());
  } catch (const Diverged&) {
    return std::numeric_limits<double>::infinity();
  }

  /// RMS change of the input pictures by the motion, over the flames' boxes.
  [[nodiscard]] double change(const Eigen::Vector3d& velocity) const {
    double sum = 0;
    for (std::size_t v = 0; v < small_.views.size(); ++v) {
      const View& view = small_.views[v];
      if (view.lateness == Seconds(0)) continue;
      RadianceImage carried_part = *view.image;
      if (view.average)
        for (std::size_t i = 0; i < carried_part.rgb.size(); ++i) carried_part.rgb[i] -= view.average->rgb[i];
      const RadianceImage change = change_of_place(carried_part, view, carried(velocity), small_.box.center);
      const double c = all_channels(rmse(change, RadianceImage(change.size), boxes_[v]));
      sum += c * c;
    }
    return std::sqrt(sum / static_cast<double>(small_.views.size()));
  }

 private:
  Scene small_;
  Grid grid_;
  const SolveOptions& options_;
  Pool& pool_;
  Effects effects_;
  std::vector<PixelBox> boxes_;
};

/// The lowest place along a line through `from`: steps downhill until it rises again, then the vertex of the
/// parabola through the last three.
template <class Try>
double search_downhill(const Try& attempt, double step, int most_steps) {
  std::map<int, double> tried;
  const auto at = [&](int n) {
    const auto [place, fresh] = tried.emplace(n, 0);
    if (fresh) place->second = attempt(n * step);
    return place->second;
  };
  int best = 0;
  const int way = at(1) < at(0) ? 1 : (at(-1) < at(0) ? -1 : 0);
  while (way != 0 && std::abs(best) < most_steps && at(best + way) < at(best)) best += way;
  const double left = at(best - 1) * at(best - 1);
  const double here = at(best) * at(best);
  const double right = at(best + 1) * at(best + 1);
  const double curvature = left - 2 * here + right;
  if (!(curvature > 0) || !std::isfinite(curvature)) return best * step;
  return (best + 0.5 * (left - right) / curvature) * step;
}

double search_along(const MotionProbe& probe, const Eigen::Vector3d& from, int axis, double step) {
  return from[axis] +
         search_downhill([&](double v) { return probe.error(from + v * Eigen::Vector3d::Unit(axis)); }, step,
                         static_cast<int>(kFastestFlame / step));
}

double first_step(const MotionProbe& probe) {
  return std::min(kFirstStep, kEdgesAStep * probe.edge() / rms(probe.scene(), &View::lateness));
}

/// Two errors that have nothing to do with each other add up like this: what the motion puts into the
/// pictures and what a reconstruction leaves anyway. Uncertain times leave their share of it.
FoundMotion found_at(const MotionProbe& probe, const Eigen::Vector3d& velocity) {
  FoundMotion found;
  found.motion = carried(velocity);
  found.change = probe.change(velocity);
  found.still_error = probe.error(Eigen::Vector3d::Zero());
  found.moving_error = probe.error(velocity);
  const double late = rms(probe.scene(), &View::lateness);
  const double uncertain = std::min(late, rms(probe.scene(), &View::lateness_sigma));
  const double taken_out = found.change * std::sqrt(1 - uncertain * uncertain / (late * late));
  const bool better = found.moving_error < found.still_error;
  found.gain = better ? std::hypot(found.moving_error, taken_out) - found.moving_error : 0;
  return found;
}

}  // namespace

bool any_late(const Scene& scene) {
  return std::any_of(scene.views.begin(), scene.views.end(), [](const View& v) {
    return v.role == ViewRole::input && abs(v.lateness) > v.lateness_sigma;
  });
}

FoundMotion find_rise(const MotionSearch& search, double tolerance) {
  if (!any_late(search.scene)) return {};
  const MotionProbe probe(search);
  if (probe.change({0, 0, kFastestFlame}) < tolerance) return {};
  const double rise = search_along(probe, Eigen::Vector3d::Zero(), 2, first_step(probe));
  return found_at(probe, {0, 0, rise});
}

FoundMotion refine_motion(const MotionSearch& search, const Motion& from) {
  const MotionProbe probe(search);
  const double step = 0.5 * first_step(probe);
  Eigen::Vector3d velocity(from.velocity[0], from.velocity[1], from.velocity[2]);
  velocity.z() = search_along(probe, velocity, 2, step);
  double error = probe.error(velocity);
  for (const int axis : {0, 1}) {
    Eigen::Vector3d sideways = velocity;
    sideways[axis] = search_along(probe, velocity, axis, step);
    const double moved = probe.error(sideways);
    if (!(moved < (1 - kLeastSideways) * error)) continue;
    velocity = sideways;
    error = moved;
  }
  return found_at(probe, velocity);
}

FoundMotion measure_motion(const MotionSearch& search, const Motion& motion) {
  FoundMotion found;
  found.motion = motion;
  if (!moves(search.scene, motion)) return found;
  const MotionProbe probe(search);
  found.change = probe.change({motion.velocity[0], motion.velocity[1], motion.velocity[2]});
  return found;
}

}  // namespace emberlock::recon
