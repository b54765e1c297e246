#include "recon/pipeline/advice.h"

#include <algorithm>
#include <cstdio>

#include "recon/preprocess/flame_mask.h"

namespace emberlock {
namespace {

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
  char text[240];
  if (const double rise = last - error(*best); rise > 0.005 * last) {
    std::snprintf(
        text, sizeof text,
        "more iterations don't help: the %s error was lowest after iteration %d (%.2f) and ended at %.2f",
        which, best->iteration, error(*best), last);
    return text;
  }
  const TracePoint& before = trace[trace.size() - 2];
  const Step step = trace.size() >= 4
                        ? next_half(report, error)
                        : Step{"one more iteration costs", (trace.back().time - before.time).value(),
                               std::max(0.0, error(before) - last)};
  std::snprintf(text, sizeof text,
                "%s about %.2g s and would lower the %s error (%.2f) by at most about %.2g", step.length,
                step.seconds, which, last, step.gain);
  return text;
}

}  // namespace emberlock
