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
std::string roff_option(const OptionWords& option) {
  std::string names;
  for (const std::string& name : option.short_names)
    names += (names.empty() ? "" : ", ") + ("\\fB\\-" + roff(name) + "\\fR");
  for (const std::string& name : option.long_names)
    names += (names.empty() ? "" : ", ") + ("\\fB\\-\\-" + roff(name) + "\\fR");
  if (names.empty()) return "\\fI" + roff(option.name) + "\\fR";
  return option.takes_value ? names + " \\fI" + roff(option.type) + "\\fR" : names;
}

void append_options(const VerbWords& verb, std::string& page) {
  for (const OptionWords& option : verb.options) {
    page += ".TP\n" + roff_option(option) + "\n" + roff(option.description);
    if (!option.default_text.empty()) page += " Default: " + roff(option.default_text) + ".";
    page += "\n";
  }
}

}  // namespace

std::string manual_page(const Verb& program, std::string_view version) {
  const VerbWords tree = describe_tree(program);
  std::string page =
      fmt::format(".TH EMBERLOCK 1 \"\" \"Emberlock {}\" \"User commands\"\n", version) +
      ".SH NAME\nemberlock \\- locks cameras without trigger hardware, films and reconstructs flames\n"
      ".SH SYNOPSIS\n\\fBemberlock\\fR \\fIVERB\\fR [\\fIOPTION\\fR]...\n.SH DESCRIPTION\n" +
      roff(tree.description) + "\n.SH OPTIONS\n";
  append_options(tree, page);
  page += ".SH VERBS\n";
  for (const VerbWords* verb : list_verbs(tree)) {
    if (verb == &tree) continue;
    page += ".SS \"" + roff(verb->path) + "\"\n" + roff(verb->description) + "\n";
    append_options(*verb, page);
  }
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

void add_manual(const Verb& program, const std::string& version) {
  static const std::map<std::string, std::string (*)(const Verb&)> kShells{
      {"bash", bash_completion}, {"zsh", zsh_completion}, {"fish", fish_completion}};
  auto shell = std::make_shared<std::string>();
  const Verb completion = program.add_verb(
      "completion",
      "Prints a shell's completion of verbs and options: `source <(emberlock completion bash)`");
  completion.add_option("SHELL", *shell, "bash, zsh or fish").require().check_choices(names_of(kShells));
  completion.set_action([shell, program] { std::printf("%s", kShells.at(*shell)(program).c_str()); });

  auto page = std::make_shared<std::string>();
  const Verb man = program.add_verb("man", "Prints a manual page, in roff.").hide();
  man.add_option("PAGE", *page, "emberlock or emberlockd.toml")
      .require()
#if EMBERLOCK_WITH_DRIVERS
      .check_choices({"emberlock", "emberlockd.toml"});
#else
      .check_choices({"emberlock"});
#endif
  man.set_action([page, program, version] {
#if EMBERLOCK_WITH_DRIVERS
    if (*page == "emberlockd.toml") {
      std::printf("%s", rig::config_manual(version).c_str());
      return;
    }
#endif
    std::printf("%s", manual_page(program, version).c_str());
  });
}

}  // namespace emberlock::cli
