// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/advice.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "recon/pipeline/shipped_front.h"
#include "recon/preprocess/flame_mask.h"

namespace emberlock::recon {
namespace {

constexpr double kNoGain = 0.98;  // a smaller gain than 2 % is none

/// What going on for `seconds` more is worth, and the words for how long that is.
struct Step {
  const char* length;
  double seconds;
  double gain;
};

template <class ErrorAt>
Step next_half(const Report& report, ErrorAt error) {
  const auto& trace = report.trace;
  const auto at = [&](double fraction) {
    return error(trace[static_cast<std::size_t>(fraction * static_cast<double>(trace.size() - 1))]);
  };
  const double earlier = at(0.25) - at(0.5);
  const double later = std::max(0.0, at(0.5) - at(1));
  const double gain = earlier > 0 ? later * std::min(1.0, later / earlier) : later;
  return {"as many iterations again cost", report.solve_time.value(), gain};
}

/// What the second half of the run bought.
template <class ErrorAt>
std::string bought(const Report& report, ErrorAt error) {
  const auto& trace = report.trace;
  if (trace.size() < 4) return {};
  const TracePoint& half = trace[(trace.size() - 1) / 2];
  const TracePoint& last = trace.back();
  return fmt::format("iterations {} to {} ({:.2f} s to {:.2f} s) lowered the error from {:.2f} to {:.2f}; ",
                     half.iteration, last.iteration, half.time.value(), last.time.value(), error(half),
                     error(last));
}

}  // namespace

std::string next_step(const Report& report) {
  const auto& trace = report.trace;
  if (trace.size() < 2) return {};
  const bool judged = report.heldout_rmse.has_value();
  const char* which = judged ? "held-out" : "input";
  const auto error = [&](const TracePoint& p) {
    return all_channels(judged ? p.heldout_rmse : p.input_rmse);
  };
  const double last = error(trace.back());
  const auto best = std::min_element(trace.begin(), trace.end(),
                                     [&](const auto& p, const auto& q) { return error(p) < error(q); });
  if (const double rise = last - error(*best); rise > 0.005 * last) {
    return fmt::format(
        "more iterations don't help: the {} error was lowest after iteration {} ({:.2f}) and ended at {:.2f}",
        which, best->iteration, error(*best), last);
  }
  const TracePoint& before = trace[trace.size() - 2];
  const Step step = trace.size() >= 4
                        ? next_half(report, error)
                        : Step{"one more iteration costs", (trace.back().time - before.time).value(),
                               std::max(0.0, error(before) - last)};
  return bought(report, error) +
         fmt::format("{} about {:.2g} s and would lower the {} error ({:.2f}) by at most about {:.2g}",
                     step.length, step.seconds, which, last, step.gain);
}

std::string more_voxels(const Report& report) {
  const int voxels = *std::max_element(report.voxels.begin(), report.voxels.end());
  const int finest = report.finest_voxels;
  if (!report.heldout_rmse || report.solver != "default" || finest < 1 || voxels < 1) return {};
  if (voxels >= finest) {
    return fmt::format(
        "more voxels bring little: {} are what the pictures can show (two for three pixels), or the most "
        "that is "
        "taken unasked",
        finest);
  }
  const int more = std::min(finest, voxels + (voxels + 1) / 2);
  const std::vector<WorkPoint> front = scaled(shipped_ends(), finest, 1, 1);
  const auto end_of = [&](int v) {
    const std::vector<WorkPoint> points = at_voxels(front, v);
    return *best_within(points, std::numeric_limits<double>::infinity());
  };
  const WorkPoint now = end_of(voxels);
  const WorkPoint then = end_of(more);
  const double error = all_channels(*report.heldout_rmse);
  const double seconds = report.total_time.value() * std::max(1.0, then.seconds / now.seconds);
  if (then.error > kNoGain * now.error) {
    return fmt::format("by the shipped front, {} voxels instead of {} don't lower the held-out error", more,
                       voxels);
  }
  return fmt::format(
      "by the shipped front, {} voxels instead of {} would take about {:.2g} s instead of {:.2g} and bring "
      "the held-out error from {:.2f} to about {:.2f}",
      more, voxels, seconds, report.total_time.value(), error, error * then.error / now.error);
}

std::vector<std::string> next_steps(const Report& report) {
  std::vector<std::string> steps;
  for (std::string step : {next_step(report), more_voxels(report)}) {
    if (!step.empty()) steps.push_back(std::move(step));
  }
  return steps;
}

}  // namespace emberlock::recon
