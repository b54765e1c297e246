// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/held_out.h"

#include <algorithm>

#include "recon/adjust/descent.h"
#include "recon/adjust/tracker.h"

namespace emberlock::recon {
namespace {

double area(const PixelBox& b) { return static_cast<double>(b.x1 - b.x0) * static_cast<double>(b.y1 - b.y0); }

double area(const std::vector<PixelBox>& boxes) {
  double sum = 0;
  for (const PixelBox& b : boxes) sum += area(b);
  return sum;
}

/// The stride, in pixels, at which the sample takes the held-out views.
int stride_of(const SolverSetup& setup, const std::vector<PixelBox>& boxes) {
  if (setup.options.trace == SolveOptions::Trace::whole) return 1;
  const int fitted = setup.options.solver == Solver::paper ? 1 : stride_for(setup, setup.hull.grid);
  const double most =
      std::max(HeldOut::kFewest, area(setup.boxes) / (fitted * fitted) / HeldOut::kFittedForOne);
  int stride = 1;
  while (area(boxes) / (stride * stride) > most) ++stride;
  return stride;
}

/// Pixels outside of the boxes count nowhere, and nothing is projected back.
Problem sampled_problem(const SolverSetup& setup, const std::vector<const View*>& views,
                        const std::vector<PixelBox>& boxes, int stride) {
  ProblemOptions options = setup.problem_options();
  options.subsets = 2;
  options.adjoint = false;
  options.rule.stride = stride;
  options.rule.others = 1;
  options.boxes = boxes;
  return make_problem(views, setup.hull, options, setup.pool);
}

/// Of a box, the pixels whose both coordinates are multiples of the stride.
std::size_t pixels_on(const PixelBox& b, int stride) {
  const auto multiples = [stride](int from, int to) {
    return (to + stride - 1) / stride - (from + stride - 1) / stride;
  };
  return static_cast<std::size_t>(multiples(b.x0, b.x1)) * static_cast<std::size_t>(multiples(b.y0, b.y1));
}

}  // namespace

HeldOut::HeldOut(const SolverSetup& setup, std::vector<const View*> views, const std::vector<PixelBox>& boxes)
    : views_(std::move(views)),
      stride_(stride_of(setup, boxes)),
      problem_(sampled_problem(setup, views_, boxes, stride_)),
      engine_(
          make_residual_engine(problem_, setup.optics(problem_.grid()), setup.options.precision, setup.pool)),
      sample_error_(boxes, problem_, *engine_, stride_, problem_.list.subset_begin[1]),
      error_(boxes, problem_, *engine_) {
  for (const PixelBox& box : boxes) {
    sample_.pixels += pixels_on(box, stride_);
    sample_.of += pixels_on(box, 1);
  }
}

std::array<double, 3> HeldOut::sampled(const ResidualEngine& solution) {
  engine_->residual_of(solution, 0);
  return sample_error_();
}

std::array<double, 3> HeldOut::all(const ResidualEngine& solution) {
  for (int subset = 0; subset < 2; ++subset) engine_->residual_of(solution, subset);
  return error_();
}

HeldOut::Both HeldOut::both(const std::vector<Rgba>& x) {
  engine_->set(x);
  return {sampled(*engine_), all(*engine_)};
}

}  // namespace emberlock::recon
