// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/find_pointing.h"

#include <algorithm>
#include <cmath>

#include "recon/adjust/coarse_pictures.h"
#include "recon/adjust/descent.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/small_scene.h"
#include "recon/effects/background.h"
#include "recon/render/render.h"

namespace emberlock::recon {
namespace {

constexpr int kPointingGrid = 48;          // voxels along the longest side
constexpr double kPointingPixels = 20000;  // of the flames' boxes
constexpr int kPointingPasses = 6;
constexpr std::size_t kFewestViews = 4;
constexpr double kIncoherent = 0.003;        // share of a view's light that misses the hull
constexpr double kFarthestShare = 0.1;       // of the flame's box: how far is looked
constexpr double kLeastPointingGain = 0.02;  // share of the left-out error by which a move must lower it
constexpr double kMostOfPointing = 0.2;      // of the budget may be spent when the search goes on
constexpr double kLeastMove = 1;             // pixels of the small pictures

float light(const RadianceImage& image, int x, int y) {
  if (x < 0 || y < 0 || x >= image.size.width || y >= image.size.height) return 0;
  const float* rgb =
      &image.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width) +
                      static_cast<std::size_t>(x))];
  return rgb[0] + rgb[1] + rgb[2];
}

/// Residual of the seen picture, moved, after the best gain of the shown one; over a box.
double mismatch(const RadianceImage& seen, const RadianceImage& shown, const PixelBox& box, int dx, int dy) {
  double ss = 0;
  double sr = 0;
  double rr = 0;
  for (int y = box.y0; y < box.y1; ++y)
    for (int x = box.x0; x < box.x1; ++x) {
      const auto s = static_cast<double>(light(seen, x + dx, y + dy));
      const auto r = static_cast<double>(light(shown, x, y));
      ss += s * s;
      sr += s * r;
      rr += r * r;
    }
  return rr > 0 ? ss - sr * sr / rr : ss;
}

/// The minimum of the parabola through three values at -1, 0, 1.
double lowest(double left, double middle, double right) {
  const double curvature = left - 2 * middle + right;
  return curvature > 0 ? std::clamp(0.5 * (left - right) / curvature, -0.5, 0.5) : 0;
}

/// Blackens what the view's picture leaves out, which is black there.
void hide_left_out(const View& view, RadianceImage& shown) {
  if (!view.bounds) return;
  for (std::size_t p = 0; p < view.bounds->size(); ++p)
    if (is_left_out((*view.bounds)[p]))
      std::fill_n(shown.rgb.begin() + static_cast<std::ptrdiff_t>(3 * p), 3, 0.F);
}

PointingError register_to(const RadianceImage& seen, const RadianceImage& shown, const PixelBox& flame) {
  const int reach =
      std::max(2, static_cast<int>(kFarthestShare * std::max(flame.x1 - flame.x0, flame.y1 - flame.y0)));
  const PixelBox box{flame.x0 - reach, flame.y0 - reach, flame.x1 + reach, flame.y1 + reach};
  int best_x = 0;
  int best_y = 0;
  double least = mismatch(seen, shown, box, 0, 0);
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) {
      const double m = mismatch(seen, shown, box, dx, dy);
      if (m >= least) continue;
      least = m;
      best_x = dx;
      best_y = dy;
    }
  const auto at = [&](int dx, int dy) { return mismatch(seen, shown, box, best_x + dx, best_y + dy); };
  return {best_x + lowest(at(-1, 0), least, at(1, 0)), best_y + lowest(at(0, -1), least, at(0, 1))};
}

/// What the other views show from one view's place.
struct LeftOut {
  double error = 0;  ///< squared, over the flame's box
  PointingError off;
};

class PointingProbe {
 public:
  PointingProbe(const Scene& scene, const Effects& effects, const SolveOptions& options, Pool& pool)
      : options_(options), pool_(pool) {
    effects_.background = effects.background;
    effects_.sensor.clipping = effects.sensor.clipping;
    effects_.sensor.white = effects.sensor.white;
    const auto masks_of = [&](const Scene& of) {
      return masks_before(of, effects.background, options.flame_threshold, options.compute);
    };
    small_ = small_scene(scene, masks_of(scene), kPointingPixels);
    masks_ = masks_of(small_);
    boxes_ = flame_boxes(small_, masks_);
    grid_ = grid_over(scene.box, kPointingGrid);
  }

  [[nodiscard]] const Scene& scene() const { return small_; }
  void move(std::size_t view, const PointingError& by) {
    small_.views[view].camera.intrinsics.cx += by.x;
    small_.views[view].camera.intrinsics.cy += by.y;
  }

  /// Whether any view shows light where the hull of all views has nothing.
  [[nodiscard]] bool incoherent() const {
    const auto hull = carve(small_, masks_, grid_, options_.compute);
    if (!hull) return true;
    std::vector<const View*> views;
    for (const View& view : small_.views) views.push_back(&view);
    ProblemOptions here;
    here.home = RayListOptions::Home::cpu;
    const Problem problem = make_problem(views, *hull, here, pool_);
    std::vector<double> reached(views.size());
    for (std::size_t r = 0; r < problem.seen.size(); ++r)
      if (in_mask(problem.list.rays[r].view, problem.list.pixels[r]))
        reached[problem.list.rays[r].view] +=
            light_of(*views[problem.list.rays[r].view], problem.list.pixels[r]);
    for (std::size_t v = 0; v < views.size(); ++v) {
      double all = 0;
      for (std::size_t pixel = 0; pixel < masks_[v].flame.size(); ++pixel)
        if (masks_[v].flame[pixel] != 0) all += light_of(*views[v], pixel);
      if (all - reached[v] > kIncoherent * all) return true;
    }
    return false;
  }

  /// Nothing where the others leave no hull, or a solve from them diverges.
  [[nodiscard]] std::optional<LeftOut> leave_out(std::size_t view) const try {
    Scene others = small_;
    others.views[view].role = ViewRole::held_out;
    const auto hull = carve(others, masks_, grid_, options_.compute);
    if (!hull) return std::nullopt;
    SolverSetup setup{{}, {}, *hull, effects_, options_, pool_};
    for (std::size_t v = 0; v < others.views.size(); ++v)
      if (v != view) {
        setup.views.push_back(&others.views[v]);
        setup.boxes.push_back(boxes_[v]);
      }
    const Level level = make_level(setup, *hull, 1, 4);
    Descent descent(level, setup.optics(hull->grid), setup);
    for (int p = 0; p < kPointingPasses; ++p) descent.pass();
    descent.settle();
    const Volume volume = to_volume(descent.engine().get(), level.problem, *hull, effects_);
    const View& left = small_.views[view];
    RadianceImage shown = render_view(volume, *hull, effects_, left.camera,
                                      {.compute = options_.compute, .background = left.background.get()});
    hide_left_out(left, shown);
    const double error = all_channels(rmse(shown, *left.image, boxes_[view]));
    return LeftOut{error * error, register_to(*left.image, shown, boxes_[view])};
  } catch (const Diverged&) {
    return std::nullopt;
  }

 private:
  [[nodiscard]] bool in_mask(std::size_t view, std::size_t pixel) const {
    return masks_[view].flame[pixel] != 0;
  }
  [[nodiscard]] static double light_of(const View& view, std::size_t pixel) {
    const float* rgb = &view.image->rgb[3 * pixel];
    return static_cast<double>(rgb[0] + rgb[1] + rgb[2]);
  }

  Effects effects_;
  const SolveOptions& options_;
  Pool& pool_;
  Scene small_;
  std::vector<FlameMask> masks_;
  std::vector<PixelBox> boxes_;
  Grid grid_;
};

/// All views left out in turn: root of the mean squared error, and each one's registration.
struct Round {
  double error = INFINITY;
  std::vector<PointingError> off;
};
/// Infinite where one of them can't be, or `look` ends it.
template <class Look>
Round leave_each_out(const PointingProbe& probe, const Look& look) {
  Round round;
  double sum = 0;
  for (std::size_t v = 0; v < probe.scene().views.size(); ++v) {
    if (!look(v)) return {};
    const std::optional<LeftOut> left = probe.leave_out(v);
    if (!left) return {};
    sum += left->error;
    round.off.push_back(left->off);
  }
  round.error = std::sqrt(sum / static_cast<double>(probe.scene().views.size()));
  return round;
}

}  // namespace

bool FoundPointing::any() const {
  return std::any_of(off.begin(), off.end(), [](const PointingError& p) { return p.x != 0 || p.y != 0; });
}

FoundPointing find_pointing(const Scene& scene, const Effects& effects, const SolveOptions& options,
                            Pool& pool, const Elapsed& elapsed, const Progress& progress) {
  const auto look = [&](std::size_t view) {
    tell(progress, 0, "finding where " + scene.views[view].name + " points");
    return !is_spent(kMostOfPointing, options, elapsed);
  };
  FoundPointing found;
  found.off.resize(scene.views.size());
  std::vector<std::size_t> inputs;
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (scene.views[v].role == ViewRole::input) inputs.push_back(v);
  if (inputs.size() < kFewestViews) return found;
  PointingProbe probe(scene, effects, options, pool);
  if (!probe.incoherent()) return found;
  const auto look_at_input = [&](std::size_t input) { return look(inputs[input]); };
  Round now = leave_each_out(probe, look_at_input);
  found.error_before = found.error_after = now.error;
  for (std::size_t moves = 0; moves < 2 * inputs.size() && std::isfinite(now.error); ++moves) {
    const auto farthest = std::max_element(now.off.begin(), now.off.end(), [](const auto& a, const auto& b) {
      return std::hypot(a.x, a.y) < std::hypot(b.x, b.y);
    });
    if (std::hypot(farthest->x, farthest->y) < kLeastMove) break;
    const auto v = static_cast<std::size_t>(farthest - now.off.begin());
    const PointingError by = *farthest;
    probe.move(v, by);
    const Round next = leave_each_out(probe, look_at_input);
    if (!(next.error < (1 - kLeastPointingGain) * now.error)) break;
    const double scale = static_cast<double>(scene.views[inputs[v]].image->size.width) /
                         static_cast<double>(probe.scene().views[v].image->size.width);
    found.off[inputs[v]].x += scale * by.x;
    found.off[inputs[v]].y += scale * by.y;
    found.error_after = next.error;
    now = next;
  }
  return found;
}

PreparedScene pointed(const PreparedScene& scene, const FoundPointing& found) {
  std::vector<CameraModel> cameras;
  for (std::size_t v = 0; v < found.off.size(); ++v) {
    cameras.push_back(scene.told().views[v].camera);
    cameras.back().intrinsics.cx += found.off[v].x;
    cameras.back().intrinsics.cy += found.off[v].y;
  }
  return scene.through(cameras);
}

}  // namespace emberlock::recon
