// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cli/clip_arguments.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "films/verify_run.h"
#include "report/verify_report.h"

namespace emberlock::cli {
namespace {

struct VerifyArguments {
  std::vector<std::string> clips;
  ClipArguments clip;
  std::string tolerance;
  bool json = false;
  std::string out;
};

films::VerifyRunOptions options_from(const VerifyArguments& a) {
  films::VerifyRunOptions options;
  options.clips = a.clips;
  options.comb = a.clip.comb;
  options.comb_rate = Hertz(a.clip.comb_rate);
  options.row_time = row_time_of(a.clip);
  options.verify.tolerance =
      a.tolerance.empty() ? smear::tolerance_for({}) : or_fail(smear::parse_tolerance(a.tolerance));
  options.verify.clip = clip_options_of(a.clip);
  return options;
}

void print_table(const films::VerifyRunResult& run) {
  const smear::VerifyResult& result = run.result;
  const SecondsPerRow row = result.options.clip.row_time;
  std::printf("%s\n", result.summary.c_str());
  std::printf("reference %s, frame %lld; t_row %.4f us", result.cameras[result.reference].name.c_str(),
              static_cast<long long>(result.middle), row.value() * 1e6);
  if (run.row_clock) std::printf(" +- %.1f ns", run.row_clock->sigma.value() * 1e9);
  if (result.worst_pair) {
    std::printf("; worst pair %.3f ms (%.1f rows)", in_milliseconds(*result.worst_pair),
                (*result.worst_pair / row).value());
  }
  std::printf("\n");
  for (const smear::CameraVerdict& c : result.cameras) {
    std::printf("  %-24s %-17s", c.name.c_str(), std::string(name(c.state)).c_str());
    if (c.error) {
      std::printf(" %+8.3f ms +- %.3f", in_milliseconds(*c.error), in_milliseconds(c.sigma));
    }
    if (c.frame_offset) std::printf("  frame %+lld", static_cast<long long>(*c.frame_offset));
    if (c.drift) std::printf("  %+.2f ppm", c.drift->value());
    std::printf("\n    %s\n", c.reason.c_str());
    if (&c != &result.cameras[result.reference])
      std::printf("    frames %s: %s\n",
                  c.frame_offset ? std::string(name(c.offset_by)).c_str() : "not matched",
                  c.offset_reason.c_str());
  }
  for (const std::string& line : result.to_do) std::printf("- %s\n", line.c_str());
}

/// Prints what isn't in the JSON.
void print_notes(const films::VerifyRunResult& run) {
  for (const std::string& note : run.notes) std::fprintf(stderr, "emberlock: %s\n", note.c_str());
  for (const smear::CameraVerdict& c : run.result.cameras) {
    if (c.state != smear::ClipState::in_sync)
      std::fprintf(stderr, "emberlock: %s: %s\n", c.file.c_str(), c.reason.c_str());
    if (!c.frame_offset)
      std::fprintf(stderr, "emberlock: %s: no frame offset: %s\n", c.file.c_str(), c.offset_reason.c_str());
  }
}

/// The output folder of the report, and its inputs.
OutputRequest where_to(const VerifyArguments& a) {
  OutputRequest where{a.out, kVerify, {a.clips.begin(), a.clips.end()}};
  if (!a.clip.comb.empty()) where.inputs.emplace_back(a.clip.comb);
  return where;
}

void verify(const VerifyArguments& arguments) {
  if (!arguments.out.empty()) or_fail(OutputFolder::check(where_to(arguments)));
  const films::VerifyRunResult run =
      or_fail(films::run_verify(options_from(arguments), progress_bar("verify")));
  if (arguments.json) {
    std::printf("%s\n", films::verify_json(run.result)
                            .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
                            .c_str());
    print_notes(run);
  } else {
    print_table(run);
    for (const std::string& note : run.notes) std::printf("- %s\n", note.c_str());
  }
  if (!arguments.out.empty()) {
    or_fail(report::write_verify_report(run, where_to(arguments)));
    std::fprintf(stderr, "emberlock: the report is %s\n",
                 (std::filesystem::path(arguments.out) / "report.html").c_str());
  }
  if (run.result.verdict != smear::ClipsVerdict::in_sync) throw Exit(1);
}

}  // namespace

void add_verify(const Verb& app) {
  auto a = std::make_shared<VerifyArguments>();
  const Verb verb = app.add_verb("verify",
                                 "Verifies video files of cameras that filmed one strobe: whether they "
                                 "are in sync, by how much, and which frames belong together.");
  verb.add_option("clips", a->clips, "one video per camera, the reference first").require();
  add_clip_options(verb, a->clip).require();
  verb.add_option("--tolerance", a->tolerance,
                  "largest distance from the reference, to either side: 100rows, 5.4ms or 500us [0.5ms, as "
                  "`align` takes it for a flame of 2 m/s]");
  verb.add_flag("--json", a->json, "the verdict as JSON on stdout");
  verb.add_option("--out", a->out, "write report.html, with frames, fits and residuals, to this folder");
  verb.set_action([a] { verify(*a); });
}

}  // namespace emberlock::cli
