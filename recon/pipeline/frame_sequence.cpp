// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/frame_sequence.h"

#include <cmath>
#include <utility>

#include "recon/adjust/volume_flow.h"
#include "recon/pipeline/single_run.h"

namespace emberlock::recon {

std::string_view name(FrameStart start) {
  if (start == FrameStart::before) return "the frame before";
  return start == FrameStart::carried ? "the frame before, carried on" : "darkness";
}

FrameSequence::FrameSequence(ReconstructOptions options, const Clock& clock)
    : options_(std::move(options)), clock_(clock) {}

double light_of(const Volume& volume) {
  double sum = 0;
  for (const float v : volume.emission) sum += static_cast<double>(v);
  return sum / 3 * std::pow(static_cast<double>(volume.grid.edge), 3);
}

bool FrameSequence::holds() const {
  constexpr double kChange = 2;
  const double light = light_of(*last_);
  return light <= kChange * light_then_ && kChange * light >= light_then_;
}

void FrameSequence::take_from(const Outcome& deciding) {
  options_.voxels = deciding.report.voxel_choice.voxels;
  options_.choose_by_front = false;  // a budget and a target are limits from here on
  light_then_ = light_of(deciding.reconstruction.volume);
  taken_.emplace();
  taken_->pointing = deciding.pointing;
  taken_->effects = {deciding.reconstruction.effects, deciding.report.effects};
  for (EffectReport& effect : taken_->effects.reports) effect.seconds = Seconds(0);
  if (options_.solve.solver == Solver::standard) taken_->smoothness = deciding.reconstruction.smoothness;
}

void FrameSequence::go_on_behind(std::shared_ptr<const Volume> before_last,
                                 std::shared_ptr<const Volume> last) {
  before_last_ = std::move(before_last);
  last_ = std::move(last);
}

/// Volumes of another place are no start: a scene may bring a box of its own.
ReconstructOptions FrameSequence::options_for(const Scene& scene) {
  ReconstructOptions options = options_;
  auto taken = std::make_shared<TakenOver>(*taken_);
  const Grid grid = grid_over(scene.box, options.voxels.value_or(1));
  if (options.solve.solver == Solver::standard && last_ && same_place(last_->grid, grid)) {
    taken->starts.push_back(last_);
    if (before_last_ && same_place(before_last_->grid, grid)) {
      Pool pool(options.solve.compute.threads);
      taken->starts.push_back(
          std::make_shared<const Volume>(carried(*last_, find_flow(*before_last_, *last_, pool), pool)));
    }
  }
  options.taken_over = std::move(taken);
  return options;
}

Result<Outcome> FrameSequence::next(const Scene& scene, const Progress& progress,
                                    const std::function<void(const Preview&)>& preview) {
  const bool decides = !taken_ || !holds();
  EMBERLOCK_ASSIGN_OR_RETURN(Outcome outcome, reconstruct(scene, decides ? options_ : options_for(scene),
                                                          clock_, progress, preview));
  decided_ = decides;
  if (decides) take_from(outcome);
  start_ = FrameStart::darkness;
  if (const auto from = outcome.reconstruction.started_from)
    start_ = *from == 0 ? FrameStart::before : FrameStart::carried;
  before_last_ = std::move(last_);
  last_ = std::make_shared<const Volume>(outcome.reconstruction.volume);
  return outcome;
}

}  // namespace emberlock::recon
