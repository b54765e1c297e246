// SPDX-License-Identifier: Apache-2.0
#include "paper/command.h"

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/ranges.h>

#include "base/clock.h"
#include "evaluate/machine.h"
#include "paper/evaluate_paper.h"
#include "paper/methods.h"
#include "paper/report.h"
#include "paper/run_file.h"

namespace emberlock::paper {
namespace {

struct Arguments {
  PaperOptions options;
  std::string out;
  std::string device = "auto";
  bool quick = false;
};

volatile std::sig_atomic_t interrupted = 0;
void note_interrupt(int) { interrupted = 1; }

/// The first Ctrl-C ends the run properly, the second one kills the program.
void catch_interrupt() {
  interrupted = 0;
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGINT, &action, nullptr);
}

/// Prints a line on stderr for each twentieth of the work.
Observer print_progress() {
  return [last = 0](double fraction, std::string_view what) mutable {
    if (const int now = static_cast<int>(20 * fraction); now > last) {
      last = now;
      std::fprintf(stderr, "evaluate %3d %% %.*s\n", 5 * now, static_cast<int>(what.size()), what.data());
    }
    return interrupted == 0;
  };
}

Status evaluate_and_report(const Arguments& arguments) {
  PaperOptions options = arguments.options;
  if (arguments.quick) options.extent = Extent::quick;
  EMBERLOCK_ASSIGN_OR_RETURN(options.compute.device, recon::parse_device(arguments.device));
  options.machine = evaluate::machine(options.compute.threads, arguments.device);
  const std::filesystem::path out = arguments.out;
  const OutputRequest report{out / "report", kEvaluatePaper};
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(report));
  catch_interrupt();
  const SteadyClock clock;
  EMBERLOCK_ASSIGN_OR_RETURN(const PaperEvaluation done,
                             evaluate_paper(options, out, clock, print_progress()));
  EMBERLOCK_RETURN_IF_ERROR(write_paper_report(done, report));
  for (const std::string& line : paper_words(done)) std::printf("%s\n", line.c_str());
  for (const MethodRun& run : done.runs)
    if (!run.failed.empty())
      std::printf("%s, %s: %s\n", run.of.c_str(), run.method.c_str(), run.failed.c_str());
  std::printf("written to %s\n", (report.target / "index.html").c_str());
  return {};
}

std::string names_of_protocols() {
  std::vector<std::string_view> names;
  for (const Protocol& p : protocols(Extent::full)) names.push_back(p.name);
  return fmt::format("{}", fmt::join(names, ", "));
}
std::string names_of_methods() {
  std::vector<std::string_view> names;
  for (const Method& m : methods()) names.push_back(m.facts.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

void add_options(CLI::App& app, Arguments& a) {
  app.add_option("--out", a.out,
                 "Write report/, runs/ and truth/ into this folder; continue what has the same settings")
      ->required();
  app.add_flag("--quick", a.quick, "Use small pictures and few cameras: a minute instead of half an hour");
  app.add_option("--only", a.options.only, "Make some of the tables: " + names_of_protocols())
      ->delimiter(',');
  app.add_option("--methods", a.options.methods, "Run some of the methods: " + names_of_methods())
      ->delimiter(',');
  app.add_option("--cells", a.options.cells,
                 "Simulate the gas with N cells along each edge, a multiple of 32 [192; quick: 64]");
  app.add_option("--voxels", a.options.voxels,
                 "Reconstruct with N voxels along the longest edge [128; quick: 48]");
  app.add_option("--seed", a.options.seed, "Seed the noise and the methods")->capture_default_str();
  app.add_option("--device", a.device,
                 "Choose the device. auto: the CPU, and a GPU too for the paper's method and ours; cpu: no "
                 "GPU; cuda: fail without a GPU")
      ->capture_default_str();
  app.add_option("--threads", a.options.compute.threads, "Use N CPU threads; 0: one per core")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
}

}  // namespace

int run_command(int argc, const char* const* argv) {
  Arguments arguments;
  CLI::App app{"Repeats the paper's tables and figures, with every method on the same pictures",
               "emberlock-paper"};
  add_options(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "emberlock-paper: %s. `emberlock-paper --help` lists the options\n", e.what());
    return 2;
  }
  const Status done = evaluate_and_report(arguments);
  if (done) return 0;
  std::fprintf(stderr, "emberlock-paper: %s\n", done.error().message().c_str());
  return done.error().kind == ErrorKind::bad_input ? 2 : 1;
}

}  // namespace emberlock::paper
