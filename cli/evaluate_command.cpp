// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/ranges.h>

#include "base/clock.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/machine.h"
#include "evaluate/methods.h"
#include "evaluate/paper/evaluate_paper.h"
#include "evaluate/paper/run_file.h"
#include "report/paper_report.h"

namespace emberlock::cli {
namespace {

struct EvaluateArguments {
  evaluate::PaperOptions options;
  std::string out;
  std::string device = "auto";
  bool quick = false;
};

void evaluate_the_paper(const EvaluateArguments& arguments) {
  evaluate::PaperOptions options = arguments.options;
  if (arguments.quick) options.extent = evaluate::Extent::quick;
  options.compute.device = or_fail(recon::parse_device(arguments.device));
  options.machine = machine(options.compute.threads, arguments.device);
  const std::filesystem::path out = arguments.out;
  const OutputRequest report{out / "report", evaluate::kEvaluatePaper};
  or_fail(OutputFolder::check(report));
  const Interrupt interrupt;
  const SteadyClock clock;
  const Progress progress = progress_bar("evaluate");
  const evaluate::PaperEvaluation done =
      or_fail(evaluate::evaluate_paper(options, out, clock, [&](double fraction, std::string_view what) {
        tell(progress, fraction, what);
        return !Interrupt::asked();
      }));
  or_fail(report::write_paper_report(done, report));
  for (const std::string& line : report::paper_words(done)) std::printf("%s\n", line.c_str());
  for (const evaluate::MethodRun& run : done.runs)
    if (!run.failed.empty())
      std::printf("%s, %s: %s\n", run.of.c_str(), run.method.c_str(), run.failed.c_str());
  std::printf("written to %s\n", (report.target / "index.html").c_str());
}

std::string names_of_protocols() {
  std::vector<std::string_view> names;
  for (const evaluate::Protocol& p : evaluate::protocols(evaluate::Extent::full)) names.push_back(p.name);
  return fmt::format("{}", fmt::join(names, ", "));
}
std::string names_of_methods() {
  std::vector<std::string_view> names;
  for (const evaluate::Method& m : evaluate::methods()) names.push_back(m.facts.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

void add_evaluate(const Verb& app) {
  auto arguments = std::make_shared<EvaluateArguments>();
  EvaluateArguments& a = *arguments;
  const Verb verb = app.add_verb("evaluate", "Compares methods on flames with known truth");
  verb.require_verb();
  const Verb paper =
      verb.add_verb("paper", "The paper's tables and figures again, with every method on the same pictures");
  paper
      .add_option("--out", a.out,
                  "Folder for report/, runs/ and truth/; one that was begun with the same settings goes on")
      .require();
  paper.add_flag("--quick", a.quick, "Small pictures and few cameras: a minute instead of half an hour");
  paper.add_option("--only", a.options.only, "Some of the tables: " + names_of_protocols()).split_at_commas();
  paper.add_option("--methods", a.options.methods, "Some of the methods: " + names_of_methods())
      .split_at_commas();
  paper.add_option("--cells", a.options.cells,
                   "Of the simulated gas along each edge, a multiple of 32 [192; quick: 64]");
  paper.add_option("--voxels", a.options.voxels, "Of every reconstruction along an edge [128; quick: 48]");
  paper.add_option("--seed", a.options.seed, "Of what is random: noise, methods").show_default();
  paper
      .add_option(
          "--device", a.device,
          "auto: the CPU, and where there is a GPU the paper's method and ours there too; cpu: no GPU; cuda: "
          "it must be there")
      .show_default();
  paper.add_threads(a.options.compute.threads);
  paper.set_action([arguments] { evaluate_the_paper(*arguments); });
}

}  // namespace emberlock::cli
