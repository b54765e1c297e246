// SPDX-License-Identifier: Apache-2.0
#include "cli/manual.h"

#include <cstdio>
#include <map>
#include <memory>

#include <fmt/format.h>

#include "base/roff.h"
#include "cli/app_tree.h"
#include "cli/completion.h"
#if EMBERLOCK_WITH_DRIVERS
#include "rig/config/manual.h"
#endif

namespace emberlock::cli {
namespace {

/// "--size TEXT" in roff.
std::string roff_option(const CLI::Option& option) {
  std::string names;
  for (const std::string& name : option.get_snames())
    names += (names.empty() ? "" : ", ") + ("\\fB\\-" + roff(name) + "\\fR");
  for (const std::string& name : option.get_lnames())
    names += (names.empty() ? "" : ", ") + ("\\fB\\-\\-" + roff(name) + "\\fR");
  if (names.empty()) return "\\fI" + roff(option.get_name(true)) + "\\fR";
  return takes_value(option) ? names + " \\fI" + roff(option.get_type_name()) + "\\fR" : names;
}

void append_options(const CLI::App& app, std::string& page) {
  for (const CLI::Option* option : options_of(app)) {
    page += ".TP\n" + roff_option(*option) + "\n" + roff(option->get_description());
    if (!option->get_default_str().empty()) page += " Default: " + roff(option->get_default_str()) + ".";
    page += "\n";
  }
}

}  // namespace

std::string manual_page(const CLI::App& app, std::string_view version) {
  std::string page =
      fmt::format(".TH EMBERLOCK 1 \"\" \"Emberlock {}\" \"User commands\"\n", version) +
      ".SH NAME\nemberlock \\- locks cameras without trigger hardware, films and reconstructs flames\n"
      ".SH SYNOPSIS\n\\fBemberlock\\fR \\fIVERB\\fR [\\fIOPTION\\fR]...\n.SH DESCRIPTION\n" +
      roff(app.get_description()) + "\n.SH OPTIONS\n";
  append_options(app, page);
  page += ".SH VERBS\n";
  visit(app, app.get_name(), [&](const CLI::App& verb, const std::string& path) {
    if (&verb == &app) return;
    page += ".SS \"" + roff(path) + "\"\n" + roff(verb.get_description()) + "\n";
    append_options(verb, page);
  });
  page +=
      ".SH EXIT STATUS\n0: done. 1: it failed, or what was checked isn't as it should be. 2: the command "
      "line or an "
      "input file is wrong. 3: the daemon can't be reached, or went away.\n.SH "
      "ENVIRONMENT\n.TP\n\\fBEMBERLOCK_LOG\\fR\nWhat is logged on stderr: "
      "\"debug\", or "
      "by folder \"session=debug,recon=info\".\n.SH SEE ALSO\n\\fBemberlockd\\fR(8), "
      "\\fBemberlockd.toml\\fR(5)\n";
  return page;
}

void add_manual(CLI::App& app, const std::string& version) {
  static const std::map<std::string, std::string (*)(const CLI::App&)> kShells{
      {"bash", bash_completion}, {"zsh", zsh_completion}, {"fish", fish_completion}};
  auto shell = std::make_shared<std::string>();
  CLI::App* completion = app.add_subcommand(
      "completion",
      "Prints a shell's completion of verbs and options: `source <(emberlock completion bash)`");
  completion->add_option("SHELL", *shell, "bash, zsh or fish")->required()->check(CLI::IsMember(kShells));
  completion->callback([shell, &app] { std::printf("%s", kShells.at(*shell)(app).c_str()); });

  auto page = std::make_shared<std::string>();
  CLI::App* man = app.add_subcommand("man", "Prints a manual page, in roff.")->group("");
  man->add_option("PAGE", *page, "emberlock or emberlockd.toml")
      ->required()
#if EMBERLOCK_WITH_DRIVERS
      ->check(CLI::IsMember({"emberlock", "emberlockd.toml"}));
#else
      ->check(CLI::IsMember({"emberlock"}));
#endif
  man->callback([page, &app, version] {
#if EMBERLOCK_WITH_DRIVERS
    if (*page == "emberlockd.toml") {
      std::printf("%s", rig::config_manual(version).c_str());
      return;
    }
#endif
    std::printf("%s", manual_page(app, version).c_str());
  });
}

}  // namespace emberlock::cli
