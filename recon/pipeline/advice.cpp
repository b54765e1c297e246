// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/advice.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "recon/adjust/picture_error.h"
#include "recon/pipeline/reference_front.h"

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
  if (report.kept.by != KeptBy::last)
    return fmt::format("more iterations don't help: the {} error was lowest after the one that was kept",
                       report.kept.by == KeptBy::held_out ? "held-out" : "input");
  if (trace.size() < 2) return {};
  const bool held_out = report.heldout_rmse.has_value();
  const char* which = held_out ? "held-out" : "input";
  const auto error = [&](const TracePoint& p) {
    return all_channels(held_out ? p.heldout_rmse : p.input_rmse);
  };
  const double last = error(trace.back());
  const TracePoint& before = trace[trace.size() - 2];
  const Step step = trace.size() >= 4
                        ? next_half(report, error)
                        : Step{"one more iteration costs", (trace.back().time - before.time).value(),
                               std::max(0.0, error(before) - last)};
  return bought(report, error) +
         fmt::format("{} about {:.2g} s and would lower the {} error ({:.2f}) by at most about {:.2g}",
                     step.length, step.seconds, which, last, step.gain);
}

std::string what_was_kept(const Report& report) {
  if (report.kept.by == KeptBy::last || report.trace.empty()) return {};
  const bool held_out = report.kept.by == KeptBy::held_out;
  const auto error = [&](const TracePoint& p) {
    return all_channels(held_out ? p.heldout_rmse : p.input_rmse);
  };
  const double kept = error(report.trace.back());
  const double last = report.discarded.empty() ? kept : error(report.discarded.back());
  const std::string which =
      fmt::format("the volume after iteration {} of {}", report.kept.iteration, report.iterations);
  if (!held_out)
    return fmt::format("{}: there the input error was lowest ({:.2f}); later steps went too far", which,
                       kept);
  return fmt::format(
      "{}: there the held-out error was lowest ({:.2f}), and at the end it was {:.2f}. As the held-out views "
      "chose, {:.2f} is the error that is free of their choice",
      which, kept, last, last);
}

Status goals_met(const SolveOptions& asked, const Report& report) {
  constexpr double kSlack = 0.05;
  const bool told = report.plan && !report.plan->remedy.empty();
  const std::string remedy = told ? report.plan->remedy : "Give more time, more views or another solver";
  if (asked.target_rmse && !report.trace.empty()) {
    const double reached = all_channels(report.trace.back().heldout_rmse);
    if (reached > *asked.target_rmse) {
      return Error{
          ErrorKind::not_converged,
          fmt::format("missed: the held-out error is {:.2f} grey levels, {:.2f} above the target of {:g}",
                      reached, reached - *asked.target_rmse, *asked.target_rmse),
          "--target-rmse", remedy};
    }
  }
  if (asked.budget && report.total_time.value() > (1 + kSlack) * asked.budget->value()) {
    return Error{ErrorKind::timed_out,
                 fmt::format("missed: it took {:.2f} s, {:.2f} s more than the budget of {:g} s",
                             report.total_time.value(), (report.total_time - *asked.budget).value(),
                             asked.budget->value()),
                 "--budget", remedy};
  }
  return {};
}

std::string more_voxels(const Report& report) {
  const int voxels = *std::max_element(report.voxels.begin(), report.voxels.end());
  const int finest = report.finest_voxels;
  if (!report.heldout_rmse || report.solver != "default" || finest < 1 || voxels < 1) return {};
  if (voxels >= finest) {
    const int by_pictures = std::max(finest, report.voxel_choice.by_the_paper);
    if (finest >= by_pictures)
      return fmt::format("more voxels bring little: {} are what the pictures can show, two for three pixels",
                         finest);
    return fmt::format(
        "more voxels bring little: {} are the most that are taken unasked, {:.1f} pixels a voxel; two for "
        "three "
        "pixels would be {} (--voxels paper)",
        finest, 1.5 * by_pictures / finest, by_pictures);
  }
  const int more = std::min(finest, voxels + (voxels + 1) / 2);
  const std::vector<WorkPoint> front = scaled(reference_ends(), finest, 1, 1);
  const auto end_of = [&](int v) {
    const std::vector<WorkPoint> points = at_voxels(front, v);
    return *best_within(points, std::numeric_limits<double>::infinity());
  };
  const WorkPoint now = end_of(voxels);
  const WorkPoint then = end_of(more);
  const double error = all_channels(*report.heldout_rmse);
  const double seconds = report.total_time.value() * std::max(1.0, then.seconds / now.seconds);
  if (then.error > kNoGain * now.error) {
    return fmt::format("by the reference front, {} voxels instead of {} don't lower the held-out error", more,
                       voxels);
  }
  return fmt::format(
      "by the reference front, {} voxels instead of {} would take about {:.2g} s instead of {:.2g} and bring "
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
