#include "recon/adjust/choose_effects.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "recon/adjust/find_extinction.h"
#include "recon/render/render.h"

namespace emberlock {
namespace {

std::string text(const char* format, double a, double b) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, a, b);
  return buffer;
}

/// RMS difference over the flames' boxes between the pictures of a volume with and without extinction, after
/// the best gain on the latter.
double change_by_extinction(const SolverSetup& setup, const FoundExtinction& found) {
  Effects with;
  with.extinction = found.extinction;
  RenderOptions options;
  options.compute = setup.options.compute;
  double ww = 0;
  double wo = 0;
  double oo = 0;
  double values = 0;
  for (std::size_t v = 0; v < setup.views.size(); ++v) {
    const CameraModel& camera = setup.views[v]->camera;
    const RadianceImage a = render_view(found.volume, found.hull, with, camera, options);
    const RadianceImage b = render_view(found.volume, found.hull, {}, camera, options);
    const PixelBox& box = setup.boxes[v];
    for (int y = box.y0; y < box.y1; ++y)
      for (int i = 3 * (y * a.size.width + box.x0); i < 3 * (y * a.size.width + box.x1); ++i) {
        const auto p = static_cast<double>(a.rgb[static_cast<std::size_t>(i)]);
        const auto q = static_cast<double>(b.rgb[static_cast<std::size_t>(i)]);
        ww += p * p;
        wo += p * q;
        oo += q * q;
        ++values;
      }
  }
  return oo > 0 ? std::sqrt(std::max(0.0, ww - wo * wo / oo) / values) : 0;
}

std::string explain(const FoundExtinction& found) {
  const double even = found.extinction.value.value();
  const double soot = found.extinction.soot.value();
  if (soot <= 0)
    return text("an even %.3g / m fits the pictures best, to %.3g grey levels on a coarse grid", even,
                found.error);
  if (even <= 0)
    return text("%.3g / m like soot fits the pictures best, to %.3g grey levels on a coarse grid", soot,
                found.error);
  return text("%.3g / m even and %.3g / m like soot fit the pictures best", even, soot);
}

}  // namespace

Result<EffectChoice> choose_effects(const Scene& scene, const Grid& grid, const EffectRequest& request,
                                    const SolveOptions& options, const Elapsed& elapsed) {
  EMBERLOCK_RETURN_IF_ERROR(check_scene(scene));
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(options.compute.device));
  const Seconds start = elapsed ? elapsed() : Seconds(0);
  const std::vector<FlameMask> masks = flame_masks(scene, options.flame_threshold);
  EMBERLOCK_ASSIGN_OR_RETURN(const Hull hull, carve(scene, masks, grid, options.compute));
  Pool pool(options.compute.threads);
  SolverSetup setup{{}, {}, hull, {}, options, device, pool};
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    setup.views.push_back(&scene.views[v]);
    const ImageSize size = scene.views[v].image.size;
    setup.boxes.push_back(masks[v].box.empty() ? PixelBox{0, 0, size.width, size.height} : masks[v].box);
  }

  EffectReport report{"extinction", false, 0, {}, {}};
  EffectChoice choice;
  if (request.fixed) {
    choice.effects = *request.fixed;
    report.on = choice.effects.extinction.model != Extinction::Model::none;
    report.reason = "set by hand";
    if (report.on)
      report.predicted_change = change_by_extinction(setup, try_extinction(setup, choice.effects.extinction));
  } else {
    const FoundExtinction found = find_extinction(setup);
    if (found.extinction.model != Extinction::Model::none)
      report.predicted_change = change_by_extinction(setup, found);
    report.on = report.predicted_change >= request.tolerance;
    report.reason =
        report.on ? explain(found)
                  : text("the best fit, %.3g / m, changes the pictures by less than %.2g grey levels",
                         found.extinction.value.value() + found.extinction.soot.value(), request.tolerance);
    if (report.on) choice.effects.extinction = found.extinction;
  }
  report.seconds = (elapsed ? elapsed() : Seconds(0)) - start;
  choice.reports.push_back(std::move(report));
  return choice;
}

}  // namespace emberlock
