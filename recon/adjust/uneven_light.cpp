// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/uneven_light.h"

#include "recon/render/render.h"
#include "recon/render/scattered_source.h"

namespace emberlock::recon {

UnevenLight::UnevenLight(const SolverSetup& setup, Volume source)
    : setup_(setup), source_(std::move(source)), emission_(source_) {
  take_out_in_scatter(emission_, setup.hull, setup.effects, setup.pool);
  field_ = find_in_scatter(emission_, setup.hull, setup.effects, {}, setup.pool);
}

std::vector<Rgba> UnevenLight::operator()(const std::vector<const View*>& views,
                                          const Problem& problem) const {
  Effects scattering;
  scattering.extinction = setup_.effects.extinction;
  Effects even = scattering;
  scattering.scattering = setup_.effects.scattering;
  RenderOptions options;
  options.step = setup_.options.step;
  options.compute = setup_.options.compute;
  options.scattered = &field_;
  std::vector<Rgba> offset(problem.rays());
  std::vector<const CameraModel*> cameras;
  cameras.reserve(views.size());
  for (const View* view : views) cameras.push_back(&view->camera);
  const std::vector<const RadianceImage*> dark(views.size());
  std::vector<RadianceImage> difference =
      render_views(emission_, setup_.hull, scattering, cameras, dark, options);
  const std::vector<RadianceImage> plain = render_views(source_, setup_.hull, even, cameras, dark, options);
  for (std::size_t v = 0; v < views.size(); ++v)
    for (std::size_t i = 0; i < plain[v].rgb.size(); ++i) difference[v].rgb[i] -= plain[v].rgb[i];
  for (std::size_t ray = 0; ray < offset.size(); ++ray) {
    const float* rgb =
        &difference[problem.list.rays[ray].view].rgb[3 * static_cast<std::size_t>(problem.list.pixels[ray])];
    offset[ray] = Rgba{{rgb[0], rgb[1], rgb[2], 0}};
  }
  return offset;
}

}  // namespace emberlock::recon
