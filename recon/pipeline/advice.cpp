#include "recon/pipeline/advice.h"

#include <algorithm>
#include <cstdio>

#include "recon/preprocess/flame_mask.h"

namespace emberlock {

std::string next_step(const Report& report) {
  const auto& trace = report.trace;
  if (trace.size() < 4) return {};
  const bool judged = report.heldout_rmse.has_value();
  const auto error = [&](const TracePoint& p) {
    return all_channels(judged ? p.heldout_rmse : p.input_rmse);
  };
  const auto at = [&](double fraction) {
    return error(trace[static_cast<std::size_t>(fraction * static_cast<double>(trace.size() - 1))]);
  };
  const char* which = judged ? "held-out" : "input";
  const double last = at(1);
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
  const double g1 = at(0.25) - at(0.5);
  const double g2 = std::max(0.0, at(0.5) - last);
  const double gain = g1 > 0 ? g2 * std::min(1.0, g2 / g1) : g2;
  std::snprintf(
      text, sizeof text,
      "as many iterations again cost about %.2g s and lower the %s error (%.2f) by at most about %.2g",
      report.solve_time.value(), which, last, gain);
  return text;
}

}  // namespace emberlock
