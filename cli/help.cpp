// SPDX-License-Identifier: Apache-2.0
#include "cli/help.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "base/nearest.h"
#include "cli/app_tree.h"
#include "cli/commands.h"

namespace emberlock::cli {
namespace {

constexpr std::size_t kHelpWidth = 100;
constexpr std::size_t kOptionColumn = 30;
constexpr std::size_t kVerbColumn = 15;

/// Verbs that are used together. Those that none names come last.
struct VerbGroup {
  const char* title;
  std::vector<std::string> verbs;
};
const std::vector<VerbGroup>& verb_groups() {
  static const std::vector<VerbGroup> groups{
      {"First steps", {"demo", "sample", "simulate", "doctor", "bench", "design", "help", "completion"}},
      {"With the daemon (emberlockd)",
       {"status", "watch", "console", "strobe", "align", "record", "sessions", "jobs"}},
      {"Cameras", {"devices", "smear", "calibrate"}},
      {"Films of other cameras", {"verify", "import"}},
      {"Volumes",
       {"reconstruct", "batch", "view", "render", "scene", "ar", "marker", "stylize", "export",
        "verify-volume", "measure", "tradeoff", "evaluate"}}};
  return groups;
}

/// "  name   text", the text wrapped in its column.
std::string entry(const std::string& name, std::string_view text, std::size_t column) {
  std::string lines = "  " + name;
  std::size_t at = lines.size();
  if (at + 1 < column) {
    lines.append(column - at, ' ');
    at = column;
  } else if (!text.empty()) {
    lines += "\n" + std::string(column, ' ');
    at = column;
  }
  bool first = true;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find_first_of(" \n"));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    if (word.empty()) continue;
    if (!first && at + 1 + word.size() > kHelpWidth) {
      lines += "\n" + std::string(column, ' ');
      at = column;
      first = true;
    }
    lines += (first ? "" : " ") + std::string(word);
    at += word.size() + (first ? 0 : 1);
    first = false;
  }
  return lines + "\n";
}

std::string verb_entry(const CLI::App& verb) {
  return entry(verb.get_name(), first_clause(verb.get_description()), kVerbColumn);
}

std::string grouped_verbs(const CLI::App& app) {
  std::vector<const CLI::App*> left = verbs_of(app);
  std::string text;
  for (const VerbGroup& group : verb_groups()) {
    std::string lines;
    for (const std::string& name : group.verbs) {
      const auto verb =
          std::find_if(left.begin(), left.end(), [&](const CLI::App* v) { return v->get_name() == name; });
      if (verb == left.end()) continue;
      lines += verb_entry(**verb);
      left.erase(verb);
    }
    if (!lines.empty()) text += fmt::format("\n{}:\n{}", group.title, lines);
  }
  if (!left.empty()) text += "\nMore:\n";
  for (const CLI::App* verb : left) text += verb_entry(*verb);
  return text;
}

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() {
    column_width(kOptionColumn);
    label("SUBCOMMAND", "VERB");
    label("Positionals", "Arguments");
  }
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const override {
    if (mode != CLI::AppFormatMode::Normal) return CLI::Formatter::make_subcommands(app, mode);
    if (app->get_parent() == nullptr) return grouped_verbs(*app);
    std::string text;
    for (const CLI::App* verb : verbs_of(*app)) text += verb_entry(*verb);
    return text.empty() ? text : "\nVerbs:\n" + text;
  }
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return entry(make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option),
                 kOptionColumn);
  }
  std::string make_footer(const CLI::App* app) const override {
    if (app->get_parent() != nullptr) return CLI::Formatter::make_footer(app);
    return "`emberlock help VERB` says more of one. Without any camera: `emberlock demo --out demo`, or "
           "simulated\n"
           "ones: `emberlock align --rig virtual:11`.\n";
  }
};

/// The verb that was typed, as far as it was understood.
const CLI::App& typed_verb(const CLI::App& app) {
  const CLI::App* verb = &app;
  while (!verb->get_subcommands().empty()) verb = verb->get_subcommands().front();
  return *verb;
}

/// "emberlock calibrate cameras".
std::string words_of(const CLI::App& verb) {
  return verb.get_parent() == nullptr ? verb.get_name()
                                      : words_of(*verb.get_parent()) + " " + verb.get_name();
}
/// "emberlock help calibrate cameras".
std::string help_command(const CLI::App& verb) {
  const std::string words = words_of(verb);
  const std::size_t end = std::min(words.find(' '), words.size());
  return "`" + words.substr(0, end) + " help" + words.substr(end) + "`";
}

std::string no_such(const char* kind, const std::string& given, const CLI::App& verb,
                    const std::vector<std::string>& known) {
  const auto meant = nearest(given, known);
  const std::string of = verb.get_parent() == nullptr ? "" : fmt::format(" of `{}`", words_of(verb));
  return fmt::format("there is no {} \"{}\"{}. {}", kind, given, of,
                     meant ? "Did you mean " + *meant + "?" : help_command(verb) + " lists them");
}

std::vector<std::string> names_of_verbs(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* verb : verbs_of(app)) names.push_back(verb->get_name());
  return names;
}

std::vector<std::string> names_of_options(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options_of(app))
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

/// The verb whose words these are; bad_input where there is none.
Result<const CLI::App*> find_verb(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* verb = &app;
  for (const std::string& word : words) {
    const auto below = verbs_of(*verb);
    const auto next =
        std::find_if(below.begin(), below.end(), [&](const CLI::App* v) { return v->get_name() == word; });
    if (next == below.end())
      return Error{ErrorKind::bad_input, no_such("verb", word, *verb, names_of_verbs(*verb))};
    verb = *next;
  }
  return verb;
}

std::string help_text(const CLI::App& verb) {
  return verb.get_parent() == nullptr
             ? verb.get_formatter()->make_help(&verb, "emberlock", CLI::AppFormatMode::Normal)
             : verb.help(words_of(*verb.get_parent()));
}

}  // namespace

void style_help(const Verb& program) { program.app().formatter(std::make_shared<HelpFormatter>()); }

void add_help(const Verb& program) {
  auto words = std::make_shared<std::vector<std::string>>();
  const Verb verb = program.add_verb("help", "Prints this, or the help of a verb");
  verb.add_option("VERB", *words, "A verb: align, or calibrate cameras");
  verb.set_action(
      [words, program] { std::printf("%s", help_text(*or_fail(find_verb(program.app(), *words))).c_str()); });
}

std::string usage_error(const Verb& program, const UsageError& error) {
  const CLI::App& verb = typed_verb(program.app());
  const std::vector<std::string> left = program.app().remaining(true);
  const std::vector<std::string> verbs = names_of_verbs(verb);
  const auto is_option = [](const std::string& word) { return word.size() > 1 && word.front() == '-'; };
  if (!verbs.empty()) {
    const auto word = std::find_if_not(left.begin(), left.end(), is_option);
    if (word != left.end()) return no_such("verb", *word, verb, verbs);
  }
  if (const auto option = std::find_if(left.begin(), left.end(), is_option); option != left.end())
    return no_such("option", option->substr(0, option->find('=')), verb, names_of_options(verb));
  if (!verbs.empty() && verb.get_require_subcommand_min() > 0) return {};
  return fmt::format("{}. {} says how", error.what(), help_command(verb));
}

std::string help_of_missing_verb(const Verb& program) { return help_text(typed_verb(program.app())); }

}  // namespace emberlock::cli
