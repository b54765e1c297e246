// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "cli/commands.h"
#include "cli/image_size.h"
#include "cli/interrupt.h"
#include "cli/outputs.h"
#include "recon/adjust/picture_error.h"
#include "report/demo_report.h"
#include "rig/demo.h"

namespace emberlock::cli {
namespace {

struct DemoArguments {
  rig::DemoOptions demo;
  std::string out;
  std::string image = "1280x720";
};

void print_summary(const rig::DemoResult& r, const std::string& out) {
  const recon::Report& report = r.outcome.report;
  std::printf("aligned          %d cameras within 100 rows by %d resets, within 10 rows by %d timed ones\n",
              r.options.cameras, r.stages.front().result.resets, r.stages.back().result.resets);
  std::printf("worst pair       %.3f ms in truth\n", in_milliseconds(r.true_worst_pair));
  std::printf("held-out error   %.2f grey levels of 255 (the paper's solver: %.2f)\n",
              recon::all_channels(report.heldout_rmse.value_or(recon::ChannelRmse{})),
              recon::all_channels(r.paper.report.heldout_rmse.value_or(recon::ChannelRmse{})));
  std::printf("reconstruction   %.2f s; whole demonstration %.0f s\n", report.total_time.value(),
              r.total_seconds.value());
  std::printf("look at          %s/report.html\n", out.c_str());
}

/// A step's progress, which says once what Ctrl-C does.
Progress stoppable(const std::string& title) {
  return [bar = progress_bar(title), said = false](double fraction, std::string_view what) mutable {
    if (Interrupt::asked() && !std::exchange(said, true))
      std::fprintf(stderr, "\nstops after this step, and keeps what is done; Ctrl-C again ends it at once\n");
    bar(fraction, what);
  };
}

/// Keeps what a stopped demonstration has made, unless an earlier one's result is in its place.
[[noreturn]] void stop_early(const rig::DemoResult& result, OutputFolder& folder, const std::string& out) {
  std::error_code none;
  const bool earlier = std::filesystem::exists(std::filesystem::path(out) / "report.html", none);
  std::printf("stopped, as asked, before the report was made\n");
  if (earlier) {
    std::printf("kept             %s, the earlier result\n", out.c_str());
  } else if (result.kept.empty()) {
    std::printf("kept             nothing: the cameras weren't aligned yet\n");
  } else {
    or_fail(folder.commit());
    for (const std::string& line : result.kept)
      std::printf("kept             %s/%s\n", out.c_str(), line.c_str());
  }
  throw Exit(1);
}

void demo_command(DemoArguments arguments) {
  arguments.demo.image = or_fail(parse_image_size(arguments.image));
  OutputFolder folder = or_fail(OutputFolder::create({arguments.out, kDemo}));
  const Interrupt interrupt;
  const rig::DemoResult result =
      or_fail(rig::run_demo(arguments.demo, folder.path(), stoppable, Interrupt::asked));
  if (!result.whole) stop_early(result, folder, arguments.out);
  or_fail(report::write_demo_report(result, folder.path()));
  or_fail(folder.commit());
  print_summary(result, arguments.out);
}

}  // namespace

void add_demo(const Verb& app) {
  auto arguments = std::make_shared<DemoArguments>();
  const Verb verb = app.add_verb(
      "demo", "The whole workflow on simulated cameras: aligns, records, reconstructs, and writes a report");
  DemoArguments& a = *arguments;
  verb.add_option("--out", a.out, "Folder for report.html, summary.png, the sessions and the reconstruction")
      .require();
  verb.add_option("--cameras", a.demo.cameras, "Number of cameras; the middle one is held out")
      .show_default();
  verb.add_option("--image", a.image, "Size of the pictures").show_default();
  verb.add_option("--frames", a.demo.flame_frames, "Frames of the flame that each camera records")
      .show_default();
  verb.add_option("--voxels", a.demo.voxels, "Voxels along the volume's edge").show_default();
  verb.add_option("--threads", a.demo.threads, "CPU threads of the reconstruction; 0: one per core")
      .check_range(0, 256)
      .show_default();
  verb.add_option("--seed", a.demo.seed, "Seed of all random numbers").show_default();
  verb.set_action([arguments] { demo_command(*arguments); });
}

}  // namespace emberlock::cli
