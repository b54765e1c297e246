// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/running_solve.h"

#include <algorithm>
#include <utility>

#include "recon/views/radiance_image.h"

namespace emberlock::recon {
namespace {

Status check_goes_on(const Effects& effects, const SolveOptions& options) {
  const auto refuse = [](const char* what, const char* remedy) {
    return Error{ErrorKind::bad_input, what, "effects", remedy};
  };
  if (options.solver != Solver::standard)
    return Error{ErrorKind::bad_input, "the paper's solver doesn't go on from a volume", "--solver",
                 "Use the default solver"};
  if (effects.light.source != Light::Source::none)
    return refuse("a medium that is lit from outside can't be edited", "Leave the light out of --effects");
  if (effects.scattering.order != Scattering::Order::none)
    return refuse("a medium that scatters can't be edited", "Leave scattering out of --effects");
  return {};
}

float brightest_channel(const RadianceImage& image, std::size_t pixel) {
  return std::max({image.rgb[3 * pixel], image.rgb[3 * pixel + 1], image.rgb[3 * pixel + 2]});
}

void take_in(PixelBox& box, int x, int y) {
  if (box.empty()) box = {x, y, x + 1, y + 1};
  box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
}

/// Marks pixels above the mask's threshold that became brighter; whether any wasn't marked before.
bool widen(FlameMask& mask, const RadianceImage& before, const RadianceImage& after) {
  bool wider = false;
  for (std::size_t p = 0; p < mask.flame.size(); ++p) {
    if (mask.flame[p] != 0) continue;
    const float now = brightest_channel(after, p);
    if (!(static_cast<double>(now) > mask.threshold) || !(now > brightest_channel(before, p))) continue;
    const auto width = static_cast<std::size_t>(mask.size.width);
    mask.flame[p] = 1;
    mask.on_gpu = {};
    take_in(mask.box, static_cast<int>(p % width), static_cast<int>(p / width));
    wider = true;
  }
  return wider;
}

/// Whether the hull has grown.
bool join(Hull& hull, const Hull& other) {
  const std::size_t before = hull.count;
  for (std::size_t v = 0; v < hull.inside.size(); ++v) {
    if (hull.inside[v] != 0 || other.inside[v] == 0) continue;
    hull.inside[v] = 1;
    ++hull.count;
  }
  return hull.count > before;
}

}  // namespace

Result<std::unique_ptr<RunningSolve>> RunningSolve::begin(const PreparedScene& scene,
                                                          const Reconstruction& from,
                                                          const SolveOptions& options) try {
  EMBERLOCK_RETURN_IF_ERROR(check_goes_on(from.effects, options));
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(options.compute.device));
  return std::unique_ptr<RunningSolve>(new RunningSolve(scene, from, options, device));
} catch (const DeviceError& e) {
  return e.error();
}

RunningSolve::RunningSolve(const PreparedScene& scene, const Reconstruction& from,
                           const SolveOptions& options, Device device)
    : options_(options),
      effects_(from.effects),
      pool_(options.compute.threads, device),
      scene_(scene),
      masks_(*scene.masks(options.flame_threshold, options.compute)),
      hull_(from.hull),
      setup_{{}, {}, hull_, effects_, options_, pool_} {
  setup_.smoothness = from.smoothness;
  take_views(scene);
  begin_level(from.volume);
}

void RunningSolve::take_views(const PreparedScene& scene) {
  scene_ = scene;
  setup_.views.clear();
  setup_.boxes.clear();
  const std::vector<View>& views = scene_.scene().views;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].role != ViewRole::input) continue;
    const ImageSize size = views[v].image->size;
    setup_.views.push_back(&views[v]);
    setup_.boxes.push_back(masks_[v].box.empty() ? PixelBox{0, 0, size.width, size.height} : masks_[v].box);
  }
}

void RunningSolve::begin_level(const Volume& from) {
  descent_.reset();  // which the level outlives
  if (effects_.refraction.rays == Refraction::Rays::curved) {
    gas_.emplace(assume_temperature(hull_, {}, effects_.refraction), effects_.refraction.ambient);
    setup_.gas = &*gas_;
  }
  level_ = std::make_unique<Level>(make_level(setup_, hull_, stride_for(setup_, hull_.grid)));
  descent_ = std::make_unique<Descent>(*level_, setup_.optics(level_->problem.grid()), setup_,
                                       DescentStart{nullptr, nullptr, &from});
  weights_ = descent_->engine().weights();
  lay_aside(from);
}

bool RunningSolve::widen_masks(const Scene& before, const Scene& after) {
  bool wider = false;
  for (std::size_t v = 0; v < masks_.size(); ++v) {
    const View& now = after.views[v];
    if (now.role != ViewRole::input || now.image == before.views[v].image) continue;
    wider = widen(masks_[v], *before.views[v].image, *now.image) || wider;
  }
  return wider;
}

Status RunningSolve::show(const PreparedScene& scene) {
  const bool wider = widen_masks(scene_.scene(), scene.scene());
  bool grown = false;
  if (wider) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Hull allowed,
                               carve(scene.scene(), masks_, hull_.grid, options_.compute));
    grown = join(hull_, allowed);
  }
  take_views(scene);
  if (grown || pool_.device() == Device::cuda) {  // there a problem is made in no time
    begin_level(all_light());
    return {};
  }
  show_pictures(level_->problem, setup_.views, effects_.background, pool_);
  descent_->see_anew();
  return {};
}

void RunningSolve::keep_dark(const std::vector<std::uint8_t>& dark) {
  const Volume all = all_light();
  dark_ = dark;
  lay_aside(all);
}

void RunningSolve::lay_aside(const Volume& all) {
  Engine& engine = descent_->engine();
  const Problem& problem = level_->problem;
  const bool any = std::any_of(dark_.begin(), dark_.end(), [](std::uint8_t d) { return d != 0; });
  if (!any && aside_.empty()) return descent_->see_anew();
  Volume shines = all;
  Volume lies = all;
  std::vector<std::uint8_t> dark(all.grid.size());
  if (any) dark = dark_;
  for (std::size_t p = 0; p < dark.size(); ++p)
    for (std::size_t c = 0; c < 3; ++c) (dark[p] != 0 ? shines : lies).emission[3 * p + c] = 0;
  // Light adds up where what absorbs it stays: rays show the one and the other.
  engine.set(to_solution(lies, problem, effects_));
  for (int s = 0; s <= level_->subsets; ++s) engine.project(s);
  std::vector<Rgba> offset = engine.residuals();
  for (Rgba& of_ray : offset) of_ray.c[3] = 0;
  engine.set_offset(offset);
  engine.set(to_solution(shines, problem, effects_));
  // A key point without weight is left as it is.
  std::vector<float> weights = weights_;
  const Grid& part = problem.grid();
  const int* at = problem.crop.offset;
  for (int k = 0; k < part.nz; ++k)
    for (int j = 0; j < part.ny; ++j)
      for (int i = 0; i < part.nx; ++i)
        if (dark[all.grid.index(i + at[0], j + at[1], k + at[2])] != 0) weights[part.index(i, j, k)] = 0;
  engine.set_weights(weights);
  aside_ = any ? std::move(lies.emission) : std::vector<float>();
  descent_->see_anew();
}

double RunningSolve::pass() {
  while (descent_->pass() == Guard::Finding::diverged) continue;  // what was taken back is no pass
  return descent_->fit_error();
}

Volume RunningSolve::volume() const {
  return to_volume(descent_->engine().get(), level_->problem, hull_, effects_);
}

Volume RunningSolve::all_light() const {
  Volume all = volume();
  for (std::size_t i = 0; i < aside_.size(); ++i) all.emission[i] += aside_[i];
  return all;
}

}  // namespace emberlock::recon
