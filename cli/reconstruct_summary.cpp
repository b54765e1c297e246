// SPDX-License-Identifier: Apache-2.0
#include "cli/reconstruct_summary.h"

#include <cstdio>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/commands.h"
#include "recon/export/error_words.h"
#include "recon/export/report.h"
#include "recon/export/temperature_words.h"
#include "recon/pipeline/advice.h"

namespace emberlock::cli {
namespace {

void print_rgb(const char* label, const recon::ChannelRmse& rmse) {
  std::printf("%-16s %6.2f %6.2f %6.2f  grey levels of 255 (R G B, RMS over the flame)\n", label, rmse[0],
              rmse[1], rmse[2]);
}

void print_summary(const Written& written, const std::string& out) {
  const recon::Report& report = written.outcome.report;
  if (report.heldout_rmse) print_rgb("held-out error", *report.heldout_rmse);
  print_rgb("input error", report.input_rmse);
  std::printf("%-16s %d x %d x %d voxels of %.2f mm, %zu in the hull\n", "volume", report.voxels[0],
              report.voxels[1], report.voxels[2], report.voxel_edge.value() * 1e3, report.hull_voxels);
  std::printf("%-16s %.2f s: effects %.2f, hull %.2f, solve %.2f (%d iterations, solver %s, %s)\n", "time",
              report.total_time.value(), report.effects_time.value(), report.hull_time.value(),
              report.solve_time.value(), report.iterations, report.solver.c_str(), report.device.c_str());
  std::printf("%-16s %.2f s before that for loading, %.2f s after it for writing\n", "files",
              written.loading.value(), written.writing.value());
  std::printf("%-16s %s\n", "certificate", written.certificate.c_str());
  for (const recon::EffectReport& effect : report.effects) {
    std::printf("%-16s %s: %s\n", effect.name.c_str(), effect.on ? "on" : "off", effect.reason.c_str());
  }
  if (report.errors)
    for (const std::string& words : recon::error_words(*report.errors))
      std::printf("%-16s %s\n", "errors", words.c_str());
  if (report.temperature)
    for (const std::string& words : recon::temperature_words(*report.temperature))
      std::printf("%-16s %s\n", "temperature", words.c_str());
  for (const recon::PreprocessStep& step : report.preprocessing) {
    if (step.on) std::printf("%-16s %s\n", step.name.c_str(), step.reason.c_str());
  }
  for (const std::string& warning : report.warnings) std::printf("%-16s %s\n", "warning", warning.c_str());
  if (!report.deviations.empty())
    std::printf("%-16s %s\n", "not the paper's",
                fmt::format("{}", fmt::join(report.deviations, "; ")).c_str());
  for (const std::string& words : report.voxel_choice.words)
    std::printf("%-16s %s\n", "voxels", words.c_str());
  if (report.plan) {
    for (const std::string& words : report.plan->words) std::printf("%-16s %s\n", "plan", words.c_str());
  }
  if (const std::string kept = recon::what_was_kept(report); !kept.empty())
    std::printf("%-16s %s\n", "kept", kept.c_str());
  for (const std::string& advice : recon::next_steps(report)) {
    std::printf("%-16s %s\n", "next step", advice.c_str());
  }
  std::printf("%-16s %s\n", "written to", out.c_str());
  std::printf("%-16s %s\n", "look at", (std::filesystem::path(out) / "report.html").c_str());
}

}  // namespace

Status conclude(const Written& written, const WrittenTo& where) {
  const recon::Report& report = written.outcome.report;
  if (where.json) {
    std::printf("%s", recon::to_json(report).c_str());
  } else {
    print_summary(written, where.out);
  }
  std::fflush(stdout);
  if (report.stopped) {
    return Error{ErrorKind::refused,
                 fmt::format("ended early, as asked: the volume after iteration {} is kept, in {}",
                             report.kept.iteration, where.out),
                 where.input};
  }
  if (const Status met = recon::goals_met(written.asked, report); !met.ok()) {
    Error missed = met.error();
    missed.what += fmt::format("; the result is in {}", where.out);
    return missed;
  }
  return temperature_told(report, where);
}

Status temperature_told(const recon::Report& report, const WrittenTo& where) {
  if (!report.temperature || report.temperature->counts.told > 0) return {};
  return Error{ErrorKind::not_converged,
               fmt::format("no voxel tells its temperature; the colours are in {}", where.out), where.input,
               "See what the summary says of them; give the camera's --response, or another --emitter"};
}

}  // namespace emberlock::cli
