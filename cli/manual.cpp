#include "cli/manual.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <vector>

#include <fmt/format.h>

#include "daemon/config/manual.h"

namespace emberlock::cli {
namespace {

/// Verbs that --help shows.
std::vector<const CLI::App*> verbs_of(const CLI::App& app) {
  std::vector<const CLI::App*> verbs =
      app.get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); });
  return verbs;
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

void visit(const CLI::App& app, const std::string& path,
           const std::function<void(const CLI::App&, const std::string&)>& each) {
  each(app, path);
  for (const CLI::App* verb : verbs_of(app)) visit(*verb, path + " " + verb->get_name(), each);
}

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
      "input file is wrong.\n.SH ENVIRONMENT\n.TP\n\\fBEMBERLOCK_LOG\\fR\nWhat is logged on stderr: "
      "\"debug\", or "
      "by folder \"session=debug,recon=info\".\n.SH SEE ALSO\n\\fBemberlockd\\fR(8), "
      "\\fBemberlockd.toml\\fR(5)\n";
  return page;
}

std::string bash_completion(const CLI::App& app) {
  std::string verbs;
  std::string offers;
  std::string valued;
  visit(app, app.get_name(), [&](const CLI::App& verb, const std::string& path) {
    if (&verb != &app) verbs += (verbs.empty() ? "'" : " | '") + path + "'";
    std::string words;
    for (const CLI::App* below : verbs_of(verb)) words += " " + below->get_name();
    for (const CLI::Option* option : options_of(verb)) {
      for (const std::string& name : option->get_lnames()) {
        words += " --" + name;
        if (takes_value(*option))
          valued += fmt::format("{}{} --{}'", valued.empty() ? "'" : " | '", path, name);
      }
    }
    offers +=
        "    '" + path + "') offers='" + words.substr(std::min<std::size_t>(1, words.size())) + "' ;;\n";
  });
  return "# bash completion of emberlock; made by `emberlock completion bash`\n"
         "_emberlock() {\n"
         "  local word offers verb=emberlock current=${COMP_WORDS[COMP_CWORD]}\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    case \"$verb $word\" in\n      " +
         verbs +
         ") verb=\"$verb $word\" ;;\n    esac\n  done\n"
         "  case \"$verb\" in\n" +
         offers +
         "  esac\n"
         "  # Behind these comes a value: bash offers files.\n"
         "  case \"$verb ${COMP_WORDS[COMP_CWORD-1]}\" in\n    " +
         valued +
         ") offers= ;;\n  esac\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$offers\" -- \"$current\")\n"
         "}\n"
         "complete -o bashdefault -o default -F _emberlock emberlock\n";
}

void add_manual(CLI::App& app, const std::string& version) {
  const auto hidden = [&app](const char* name, const char* what) {
    return app.add_subcommand(name, what)->group("");
  };
  auto shell = std::make_shared<std::string>();
  CLI::App* completion = hidden("completion", "Prints what makes a shell complete verbs and options.");
  completion->add_option("SHELL", *shell, "bash")->required()->check(CLI::IsMember({"bash"}));
  completion->callback([shell, &app] { std::printf("%s", bash_completion(app).c_str()); });

  auto page = std::make_shared<std::string>();
  CLI::App* man = hidden("man", "Prints a manual page, in roff.");
  man->add_option("PAGE", *page, "emberlock or emberlockd.toml")
      ->required()
      ->check(CLI::IsMember({"emberlock", "emberlockd.toml"}));
  man->callback([page, &app, version] {
    std::printf("%s", (*page == "emberlock" ? manual_page(app, version) : config_manual(version)).c_str());
  });
}

}  // namespace emberlock::cli
