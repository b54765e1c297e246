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
  std::vector<RadianceImage> difference;
  for (const View* view : views) {
    RadianceImage image = render_view(emission_, setup_.hull, scattering, view->camera, options);
    const RadianceImage plain = render_view(source_, setup_.hull, even, view->camera, options);
    for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] -= plain.rgb[i];
    difference.push_back(std::move(image));
  }
  for (std::size_t ray = 0; ray < offset.size(); ++ray) {
    const float* rgb =
        &difference[problem.list.rays[ray].view].rgb[3 * static_cast<std::size_t>(problem.list.pixels[ray])];
    offset[ray] = Rgba{{rgb[0], rgb[1], rgb[2], 0}};
  }
  return offset;
}

}  // namespace emberlock::recon
