#include "recon/adjust/tracker.h"

namespace emberlock {

Tracker::Tracker(const SolverSetup& setup, const std::vector<const View*>& held_out,
                 const std::vector<PixelBox>& boxes, const Elapsed& elapsed,
                 const std::function<void(const Preview&)>& preview)
    : setup_(setup), elapsed_(elapsed), preview_(preview), views_(held_out) {
  if (held_out.empty()) return;
  const Seconds start = now();
  held_out_ =
      std::make_unique<const Problem>(pose(held_out, setup.hull, setup.problem_options(), setup.pool));
  engine_ = make_engine(*held_out_, setup.optics(held_out_->grid()), setup.options.precision, setup.pool);
  error_ = std::make_unique<const ErrorOverBoxes>(held_out, boxes, *held_out_, setup.effects.background);
  excluded_ += now() - start;
}

Seconds Tracker::time() const { return now() - excluded_; }

bool Tracker::out_of_time() const { return setup_.options.budget && now() >= *setup_.options.budget; }

bool Tracker::record(int iteration, const std::array<double, 3>& input_rmse, Engine& engine,
                     const Problem& problem) {
  TracePoint point{time(), iteration, input_rmse, {}};
  if (held_out_) {
    const Seconds start = now();
    engine_->set(engine.get());
    engine_->residual(0);
    point.heldout_rmse = (*error_)(engine_->residuals());
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
  if (held_out_ && setup_.options.target_rmse &&
      all_channels(point.heldout_rmse) <= *setup_.options.target_rmse)
    return true;
  return out_of_time();
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

}  // namespace emberlock
