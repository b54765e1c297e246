// SPDX-License-Identifier: Apache-2.0
#include "apply/stylize.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "recon/compute/device.h"
#include "recon/export/preview.h"
#include "recon/pipeline/single_run.h"
#include "recon/render/render.h"

namespace emberlock::apply {
namespace {

/// Above 0, even of a volume without light.
float brightest_green(const recon::Volume& volume) {
  float green = 1e-6F;
  for (std::size_t p = 0; p < volume.grid.size(); ++p) green = std::max(green, volume.emission[3 * p + 1]);
  return green;
}

/// Where a picture was edited, a saturated pixel bounds nothing any more.
recon::SharedBounds bounds_of(const recon::View& captured, const recon::RadianceImage& edited) {
  if (!captured.bounds || captured.image.get() == &edited) return captured.bounds;
  std::vector<std::uint8_t> bounds = *captured.bounds;
  for (std::size_t i = 0; i < edited.rgb.size(); ++i)
    if (edited.rgb[i] != captured.image->rgb[i]) bounds[i / 3] &= static_cast<std::uint8_t>(~(1U << i % 3));
  return recon::share(std::move(bounds));
}

/// Whether the view whose picture it edits is there, and fitted.
Status check_view(const Operation& operation, const recon::Scene& scene) {
  const std::string* const name = view_of(operation);
  if (name == nullptr) return {};
  const auto view = std::find_if(scene.views.begin(), scene.views.end(),
                                 [&](const recon::View& v) { return v.name == *name; });
  const bool held_out = view != scene.views.end() && view->role == recon::ViewRole::held_out;
  if (view != scene.views.end() && !held_out) return {};
  std::string names;
  for (const recon::View& v : scene.views)
    if (v.role == recon::ViewRole::input) names += (names.empty() ? "" : ", ") + v.name;
  return Error{ErrorKind::bad_input,
               fmt::format("\"{}\" {}", *name, held_out ? "is held out" : "is no view of this scene"), "view",
               "Give one of " + names};
}

}  // namespace

Status check_edits(const EditFile& edits, const recon::Scene& scene, const std::string& where) {
  EMBERLOCK_RETURN_IF_ERROR(check_scene_of(edits, scene, where));
  for (std::size_t s = 0; s < edits.steps.size(); ++s) {
    const Operation& operation = edits.steps[s].operation;
    Status usable = check_view(operation, scene);
    if (const auto* const object = std::get_if<ObjectEdit>(&operation); usable.ok() && object != nullptr)
      if (const auto picture = load_object(*object); !picture) usable = picture.error();
    if (usable.ok()) continue;
    Error error = usable.error();
    error.where = fmt::format("{}: steps[{}]: {}", where, s, error.where);
    return error;
  }
  return {};
}

Stylization::Stylization(const recon::Scene& scene, const recon::Outcome& from,
                         const recon::SolveOptions& options, Colours colours,
                         const recon::CameraResponse& response)
    : captured_(scene),
      edited_(scene),
      options_(options),
      colours_(colours),
      flame_(response, brightest_green(from.reconstruction.volume)),
      pointing_(from.pointing),
      begun_(from),
      dark_(from.reconstruction.volume.grid.size()) {
  begun_.renders.clear();
  begun_.reconstruction.volume = {};
}

Result<std::unique_ptr<Stylization>> Stylization::begin(const recon::Scene& scene, const recon::Outcome& from,
                                                        const recon::SolveOptions& options, Colours colours,
                                                        const recon::CameraResponse& response) {
  std::unique_ptr<Stylization> begun(new Stylization(scene, from, options, colours, response));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::PreparedScene prepared, begun->prepared(scene));
  EMBERLOCK_ASSIGN_OR_RETURN(begun->solve_,
                             recon::RunningSolve::begin(prepared, from.reconstruction, options));
  return begun;
}

Result<recon::PreparedScene> Stylization::prepared(const recon::Scene& scene) const {
  EMBERLOCK_ASSIGN_OR_RETURN(recon::PreparedScene prepared,
                             recon::PreparedScene::create(scene, begun_.reconstruction.effects));
  if (pointing_.any()) return recon::pointed(prepared, pointing_);
  return prepared;
}

History Stylization::history() const { return history_of(steps_).value(); }

Status Stylization::load(ObjectEdit& object) {
  EMBERLOCK_ASSIGN_OR_RETURN(ObjectPicture picture, load_object(object));
  object.hash = picture.hash;
  objects_.emplace(object.hash, std::move(picture));
  return {};
}

Status Stylization::apply(Operation operation) {
  EMBERLOCK_RETURN_IF_ERROR(check_view(operation, captured_));
  if (auto* const object = std::get_if<ObjectEdit>(&operation)) EMBERLOCK_RETURN_IF_ERROR(load(*object));
  steps_.push_back({passes_, std::move(operation)});
  if (const auto all = history_of(steps_); !all) {
    steps_.pop_back();
    return all.error();
  }
  pending_ = true;
  return {};
}

Status Stylization::bring_up() {
  if (!pending_) return {};
  const std::vector<const Operation*> operations = history().standing;
  bool changed = false;
  for (std::size_t v = 0; v < captured_.views.size(); ++v) {
    const recon::View& captured = captured_.views[v];
    recon::View& view = edited_.views[v];
    const recon::SharedImage image =
        edited_picture(captured.image, captured.name, operations,
                       [&](const ObjectEdit& o) -> const ObjectPicture& { return objects_.at(o.hash); });
    if (image == view.image || image->rgb == view.image->rgb) continue;
    view.bounds = bounds_of(captured, *image);
    view.image = image;
    changed = true;
  }
  if (changed) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::PreparedScene scene, prepared(edited_));
    EMBERLOCK_RETURN_IF_ERROR(solve_->show(scene));
  }
  std::vector<std::uint8_t> dark = dark_points(begun_.reconstruction.hull.grid, operations);
  if (dark != dark_) solve_->keep_dark(dark);
  dark_ = std::move(dark);
  pending_ = false;
  return {};
}

Status Stylization::pass() try {
  EMBERLOCK_RETURN_IF_ERROR(bring_up());
  residual_ = solve_->pass();
  ++passes_;
  return {};
} catch (const recon::DeviceError& e) {
  return e.error();
} catch (const recon::Diverged& e) {
  return e.error();
}

EditFile Stylization::record() const {
  const recon::Grid& grid = begun_.reconstruction.hull.grid;
  return {known_views(captured_), std::max({grid.nx, grid.ny, grid.nz}) - 1, passes_, colours_, steps_};
}

EditedVolume Stylization::shown() const {
  return edited_volume(solve_->volume(), solve_->hull(), flame_, colours_, history().standing);
}

recon::RadianceImage Stylization::preview(const EditedVolume& shown, std::size_t view, int widest) const {
  const recon::View& seen = captured_.views[view];
  const ImageSize size = recon::preview_size(seen.image->size, widest);
  recon::RenderOptions options{.compute = options_.compute};
  recon::RadianceImage behind;
  if (seen.background) {
    behind = recon::shrunk(*seen.background, size);
    options.background = &behind;
  }
  return recon::render_view(shown.volume, shown.hull, solve_->effects(), recon::resized(seen.camera, size),
                            options);
}

Result<recon::Outcome> Stylization::outcome() try {
  EMBERLOCK_RETURN_IF_ERROR(bring_up());
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Device device, recon::resolve(options_.compute.device));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::PreparedScene scene, prepared(edited_));
  const std::function<void(const recon::Preview&)> nobody;
  const recon::Task task{scene, device, [] { return Seconds(0); }, nobody};
  recon::Reconstruction fitted = begun_.reconstruction;
  fitted.volume = solve_->volume();
  fitted.hull = solve_->hull();
  fitted.iterations += passes_;
  recon::Outcome outcome = recon::finish(task, scene, options_, std::move(fitted), {});
  recon::Report& report = outcome.report;
  report.effects = begun_.report.effects;
  report.voxel_choice = begun_.report.voxel_choice;
  report.input = begun_.report.input;
  report.up = begun_.report.up;
  EditedVolume shown = this->shown();
  outcome.renders.clear();
  for (std::size_t v = 0; v < scene.scene().views.size(); ++v)
    outcome.renders.push_back(preview(shown, v, scene.scene().views[v].image->size.width));
  outcome.pointing = pointing_;
  outcome.reconstruction.volume = std::move(shown.volume);
  outcome.reconstruction.hull = std::move(shown.hull);
  outcome.temperature.emplace();
  outcome.temperature->kelvin = std::move(shown.kelvin);
  return outcome;
} catch (const recon::DeviceError& e) {
  return e.error();
}

}  // namespace emberlock::apply
