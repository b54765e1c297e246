// SPDX-License-Identifier: Apache-2.0
#include "cli/app_tree.h"

#include <algorithm>

namespace emberlock::cli {

std::vector<const CLI::App*> verbs_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); });
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

std::string first_clause(const std::string& text) {
  const bool sentence = text.ends_with('.');
  return text.substr(0, std::min({text.find(". "), text.find("; "), text.find(": "), text.find('\n'),
                                  text.size() - (sentence ? 1 : 0)}));
}

void visit(const CLI::App& app, const std::string& path,
           const std::function<void(const CLI::App&, const std::string&)>& each) {
  each(app, path);
  for (const CLI::App* verb : verbs_of(app)) visit(*verb, path + " " + verb->get_name(), each);
}

}  // namespace emberlock::cli
