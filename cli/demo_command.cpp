// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "cli/commands.h"
#include "cli/outputs.h"
#include "recon/preprocess/flame_mask.h"
#include "report/demo_report.h"
#include "rig/demo.h"

namespace emberlock::cli {
namespace {

struct DemoArguments {
  rig::DemoOptions demo;
  std::string out;
  std::string image = "1280x720";
};

ImageSize parse_size(const std::string& text) {
  ImageSize size;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &size.width, &size.height, &rest) != 2) {  // NOLINT(cert-err34-c)
    fail({ErrorKind::bad_input, "\"" + text + "\" is not WIDTHxHEIGHT", "--image",
          "Give for example 1280x720"});
  }
  return size;
}

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

void demo_command(DemoArguments arguments) {
  arguments.demo.image = parse_size(arguments.image);
  OutputFolder folder = or_fail(OutputFolder::create({arguments.out, kDemo}));
  const rig::DemoResult result = or_fail(rig::run_demo(arguments.demo, folder.path(), progress_bar));
  or_fail(report::write_demo_report(result, folder.path()));
  or_fail(folder.commit());
  print_summary(result, arguments.out);
}

}  // namespace

void add_demo(CLI::App& app) {
  auto arguments = std::make_shared<DemoArguments>();
  CLI::App* verb = app.add_subcommand(
      "demo",
      "From strobe to volume on simulated cameras: align, record, reconstruct, and a report to look at");
  DemoArguments& a = *arguments;
  verb->add_option("--out", a.out, "Folder for report.html, summary.png, the sessions and the reconstruction")
      ->required();
  verb->add_option("--cameras", a.demo.cameras, "How many; the middle one is held out")
      ->capture_default_str();
  verb->add_option("--image", a.image, "Size of their pictures")->capture_default_str();
  verb->add_option("--frames", a.demo.flame_frames, "Of the flame, recorded by each camera")
      ->capture_default_str();
  verb->add_option("--voxels", a.demo.voxels, "Along the volume's edge")->capture_default_str();
  verb->add_option("--threads", a.demo.threads, "CPU threads, 0 takes every core")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  verb->add_option("--seed", a.demo.seed, "Of everything random")->capture_default_str();
  verb->callback([arguments] { demo_command(*arguments); });
}

}  // namespace emberlock::cli
