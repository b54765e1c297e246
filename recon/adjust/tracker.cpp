// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/tracker.h"

#include <algorithm>
#include <cmath>

#include "recon/adjust/picture_error.h"
#include "recon/kernels/level.h"

namespace emberlock::recon {

Tracker::Tracker(const SolverSetup& setup, const std::vector<const View*>& held_out,
                 const std::vector<PixelBox>& boxes, const Elapsed& elapsed,
                 const std::function<void(const Preview&)>& preview)
    : setup_(setup), elapsed_(elapsed), preview_(preview) {
  if (held_out.empty()) return;
  const Seconds start = now();
  held_out_ = std::make_unique<HeldOut>(setup, held_out, boxes);
  excluded_ += now() - start;
}

Seconds Tracker::time() const { return now() - excluded_; }

/// A sample that was too hopeful once is believed less from then on, so that all pixels are seldom looked at.
bool Tracker::reached(const std::array<double, 3>& sampled, const Engine& engine) {
  if (!setup_.options.target_rmse) return false;
  const double target = *setup_.options.target_rmse;
  const double estimate = all_channels(sampled);
  if (all_over_sampled_ * estimate > target) return false;
  const double error = all_channels(held_out_->all(engine));
  if (estimate > 0) all_over_sampled_ = std::max(1.0, error / estimate);
  return error <= target;
}

bool Tracker::record(int iteration, const std::array<double, 3>& input_rmse, Engine& engine,
                     const Problem& problem) {
  TracePoint point{time(), iteration, input_rmse, {}};
  bool done = false;
  if (held_out_) {
    const Seconds start = now();
    point.heldout_rmse = held_out_->sampled(engine);
    done = reached(point.heldout_rmse, engine);
    last_ = all_channels(point.heldout_rmse);
    if (last_ < lowest_) {
      lowest_ = last_;
      lowest_at_ = iteration;
      engine.save();
    }
    excluded_ += now() - start;
  }
  trace_.push_back(point);
  if (preview_) {
    const auto volume = [&](const std::vector<Rgba>& x) {
      return to_volume(x, problem, setup_.hull, setup_.effects);
    };
    preview_({trace_.back(), [&] { return volume(engine.get()); },
              [&] {
                const std::vector<Rgba> x = engine.recent();
                return x.empty() ? std::optional<Volume>() : volume(x);
              },
              setup_.hull, setup_.effects});
  }
  const bool late = out_of_time();
  return done || late;
}

std::optional<int> Tracker::better_before() const {
  if (lowest_at_ == 0 || last_ <= (1 + kRiseThatCounts) * lowest_) return std::nullopt;
  return lowest_at_;
}

void Tracker::conclude(const Solution& solution, Reconstruction& result) {
  std::erase_if(trace_, [](const TracePoint& p) {
    return !std::isfinite(all_channels(p.input_rmse)) || !std::isfinite(all_channels(p.heldout_rmse));
  });
  result.kept = solution.kept;
  if (result.kept.by == KeptBy::last) result.kept.iteration = solution.iterations;
  const auto later = std::find_if(trace_.begin(), trace_.end(),
                                  [&](const TracePoint& p) { return p.iteration > result.kept.iteration; });
  result.discarded.assign(later, trace_.end());
  trace_.erase(later, trace_.end());
  if (trace_.empty()) {
    const Seconds then = result.discarded.empty() ? time() : result.discarded.front().time;
    trace_.push_back({then, result.kept.iteration, {}, {}});
  }
  trace_.back().input_rmse = solution.input_rmse;
  if (held_out_) {
    const Seconds start = now();
    const HeldOut::Both errors = held_out_->both(solution.x);
    for (std::vector<TracePoint>* points : {&trace_, &result.discarded})
      for (TracePoint& point : *points)
        for (std::size_t c = 0; c < 3; ++c)
          if (errors.sampled[c] > 0) point.heldout_rmse[c] *= errors.all[c] / errors.sampled[c];
    trace_.back().heldout_rmse = errors.all;
    result.heldout_rmse = errors.all;
    result.heldout_black = held_out_->black();
    result.trace_sample = held_out_->sample();
    excluded_ += now() - start;
  }
  result.trace_time = excluded_;
  result.trace = std::move(trace_);
  result.stopped = stopped_;
}

Volume to_volume(const std::vector<Rgba>& x, const Problem& problem, const Hull& hull,
                 const Effects& effects) {
  const Grid& whole = hull.grid;
  const Grid& part = problem.grid();
  Volume volume{whole, std::vector<float>(3 * whole.size()), {}};
  const float per_meter = 1 / whole.edge;
  const bool field = effects.extinction.model == Extinction::Model::field;
  if (field) volume.extinction.resize(whole.size());
  for (int k = 0; k < part.nz; ++k)
    for (int j = 0; j < part.ny; ++j)
      for (int i = 0; i < part.nx; ++i) {
        const Rgba& from = x[part.index(i, j, k)];
        const std::size_t to =
            whole.index(i + problem.crop.offset[0], j + problem.crop.offset[1], k + problem.crop.offset[2]);
        for (std::size_t c = 0; c < 3; ++c) volume.emission[3 * to + c] = per_meter * from.c[c];
        if (field) volume.extinction[to] = per_meter * from.c[3];
      }
  if (effects.extinction.model != Extinction::Model::constant) return volume;
  // The medium is a set of voxels; a key point gets the share of its eight voxels that belong to it.
  volume.extinction.resize(whole.size());
  const auto share = static_cast<float>(effects.extinction.value.value() / 8);
  std::size_t voxel = 0;
  for (int k = 0; k < whole.nz - 1; ++k)
    for (int j = 0; j < whole.ny - 1; ++j)
      for (int i = 0; i < whole.nx - 1; ++i)
        if (hull.inside[voxel++] != 0)
          for (int c = 0; c < 8; ++c)
            volume.extinction[whole.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] += share;
  return volume;
}

std::vector<Rgba> to_solution(const Volume& volume, const Problem& problem, const Effects& effects) {
  const Grid& part = problem.grid();
  const float edge = volume.grid.edge;
  const bool field = effects.extinction.model == Extinction::Model::field;
  const int* offset = problem.crop.offset;
  std::vector<float> share(part.size());
  const ShareInside of_medium{part, problem.crop.hull.inside.data(), share.data()};
  std::vector<Rgba> x(part.size());
  for (int k = 0; k < part.nz; ++k)
    for (int j = 0; j < part.ny; ++j)
      for (int i = 0; i < part.nx; ++i) {
        of_medium(i, j, k);
        if (!(share[part.index(i, j, k)] > 0)) continue;
        const std::size_t from = volume.grid.index(i + offset[0], j + offset[1], k + offset[2]);
        Rgba& to = x[part.index(i, j, k)];
        for (std::size_t c = 0; c < 3; ++c) to.c[static_cast<int>(c)] = edge * volume.emission[3 * from + c];
        if (field && !volume.extinction.empty()) to.c[3] = edge * volume.extinction[from];
      }
  return x;
}

}  // namespace emberlock::recon
