// SPDX-License-Identifier: Apache-2.0
// The order of an engine's calls, whatever the device.
#include "recon/adjust/engine.h"

#include <algorithm>
#include <stdexcept>

namespace emberlock::recon {
namespace {

void demand(bool met, const char* otherwise) {
  if (!met) throw std::logic_error(otherwise);
}

void note_marched(std::vector<int>& marched, int subset) {
  std::erase(marched, subset);
  marched.push_back(subset);
}

}  // namespace

ResidualEngine::Squares ResidualEngine::squares(std::size_t first_ray, std::size_t last_ray) const {
  return first_ray < last_ray ? sum_squares(first_ray, last_ray) : Squares{};
}

ResidualEngine::Squares ResidualEngine::weighted_squares(std::size_t number) const {
  return sum_squares(number);
}

void ResidualEngine::set(const std::vector<Rgba>& x) {
  marched_.clear();
  put(x);
}

void ResidualEngine::residual_of(const ResidualEngine& other, int subset) {
  demand(other.held_points() == grid_points(),
         "residual_of() an engine that holds no volume of this grid: set() it first");
  marched_.clear();
  march_other(other, subset);
}

void Engine::residual(int subset) {
  march_residual(subset);
  note_marched(marched_, subset);
}

void Engine::residual_against(const std::vector<Rgba>& target, int subset, Behind behind) {
  march_against(target, subset, behind);
  note_marched(marched_, subset);
}

void Engine::residual_against_aim(int subset, Behind behind) {
  march_against_aim(subset, behind);
  note_marched(marched_, subset);
}

void Engine::start_from(const Engine& other) {
  marched_.clear();
  copy_solution(other);
}

void Engine::expect_extinction(float even, float soot) {
  demand(takes_a_field(),
         "expect_extinction() where the optics take none: make the engine with Absorb::field");
  marched_.clear();
  put_expected_extinction(even, soot);
}

void Engine::light_evenly(float thinned) {
  marched_.clear();
  put_even_light(thinned);
}

void Engine::thicken(float by) {
  marched_.clear();
  put_thicker(by);
}

float Engine::take_reference() {
  demand(takes_a_field(), "take_reference() where the optics take none: make the engine with Absorb::field");
  has_field_ = true;
  return put_reference();
}

float Engine::settle_field_weights(float share, float factor) {
  demand(has_field_, "settle_field_weights() without a field: set_field() or take_reference() first");
  return settle_curvature(share, factor);
}

void Engine::project(int subset) {
  marched_.clear();
  march_radiance(subset);
}

void Engine::backproject(int subset) {
  demand(!marched_.empty() && marched_.back() == subset,
         "backproject() of residuals that aren't the volume's: the subset's residual() comes last");
  spread(subset);
}

void Engine::mark() {
  copy_to_mark();
  is_marked_ = true;
}

void Engine::keep() {
  demand(is_marked_, "keep() without anything marked: mark() comes before each");
  swap_mark_and_kept();
  is_marked_ = false;
  is_kept_ = true;
}

void Engine::restore() {
  demand(is_kept_, "restore() without anything kept: mark() and keep() first");
  marched_.clear();
  copy_from_kept();
}

void Engine::save() {
  copy_to_saved();
  is_saved_ = true;
}

void Engine::go_back() {
  demand(is_saved_, "go_back() without anything saved: save() first");
  marched_.clear();
  copy_from_saved();
}

void Engine::rest() {
  marched_.clear();
  forget_look_ahead();
}

void Engine::descend(const Step& step) {
  marched_.clear();
  step_emission(step);
}

void Engine::set_field(const std::vector<float>& weights, const std::vector<float>& reference) {
  demand(takes_a_field(), "set_field() where the optics take none: make the engine with Absorb::field");
  put_field(weights, reference);
  has_field_ = true;
}

void Engine::raise_field_weights(float scale) {
  demand(has_field_, "raise_field_weights() without a field: set_field() first");
  raise_curvature(scale);
}

std::vector<float> Engine::field_weights() const {
  demand(has_field_, "field_weights() without a field: set_field() first");
  return curvature();
}

void Engine::descend_field(const FieldStep& step) {
  demand(has_field_, "descend_field() without a field: set_field() first");
  marched_.clear();
  step_field(step);
}

void Engine::sweep(const std::vector<SubsetStep>& steps, const FieldStep* field) {
  demand(field == nullptr || has_field_,
         "sweep() of a field without one: set_field() or take_reference() first");
  marched_.clear();
  sweep_subsets(steps, field);
}

void Engine::sweep_subsets(const std::vector<SubsetStep>& steps, const FieldStep* field) {
  for (const SubsetStep& step : steps) sweep_subset(step, field);
}

void Engine::sweep_subset(const SubsetStep& step, const FieldStep* field) {
  march_residual(step.subset);
  spread(step.subset);
  if (field == nullptr) return step_emission(step.step);
  FieldStep both = *field;
  both.emission = step.step;
  step_field(both);
}

void Engine::adjust(int subset, const PaperStep& step) {
  demand(takes_paper_steps(),
         "adjust() but in float32, along straight rays, with none or constant extinction");
  demand(std::find(marched_.begin(), marched_.end(), subset) != marched_.end(),
         "adjust() by residuals that aren't the volume's: the subset's residual() first");
  marched_.clear();
  step_paper(subset, step);
}

}  // namespace emberlock::recon
