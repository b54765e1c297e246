// SPDX-License-Identifier: Apache-2.0
#include "cli/app_tree.h"

#include <algorithm>

#include <CLI/CLI.hpp>

namespace emberlock::cli {
namespace {

VerbWords describe_verb(const CLI::App& app, const std::string& path) {
  VerbWords verb{app.get_name(), path, app.get_description(), {}, {}};
  for (const CLI::Option* option : options_of(app)) {
    verb.options.push_back({option->get_name(), option->get_snames(), option->get_lnames(),
                            option->get_description(), option->get_type_name(), option->get_default_str(),
                            option->get_items_expected_max() > 0});
  }
  for (const CLI::App* below : verbs_of(app))
    verb.verbs.push_back(describe_verb(*below, path + " " + below->get_name()));
  return verb;
}

}  // namespace

VerbWords describe_tree(const Verb& program) {
  return describe_verb(program.app(), program.app().get_name());
}

std::vector<const VerbWords*> list_verbs(const VerbWords& program) {
  std::vector<const VerbWords*> list{&program};
  for (const VerbWords& verb : program.verbs) {
    const auto below = list_verbs(verb);
    list.insert(list.end(), below.begin(), below.end());
  }
  return list;
}

std::vector<const CLI::App*> verbs_of(const CLI::App& app) {
  // A group of options is a verb without a name to CLI11.
  return app.get_subcommands(
      [](const CLI::App* verb) { return !verb->get_group().empty() && !verb->get_name().empty(); });
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
}

std::string first_clause(const std::string& text) {
  const bool sentence = text.ends_with('.');
  return text.substr(0, std::min({text.find(". "), text.find("; "), text.find(": "), text.find('\n'),
                                  text.size() - (sentence ? 1 : 0)}));
}

}  // namespace emberlock::cli
