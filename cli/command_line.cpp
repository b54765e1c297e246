// SPDX-License-Identifier: Apache-2.0
#include "cli/command_line.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <type_traits>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace emberlock::cli {
namespace {

/// What is wrong with a number that isn't finite: parsers take "nan" and "inf", and no comparison refuses
/// nan. Other texts are the option's type's to refuse.
std::string describe_infinite(const std::string& text) {
  double value = 0;
  const bool is_number = CLI::detail::lexical_cast(text, value);
  return !is_number || std::isfinite(value) ? std::string() : text + " is not a finite number";
}

template <class T>
constexpr bool kHoldsDoubles = std::is_same_v<T, double> || std::is_same_v<T, std::optional<double>> ||
                               std::is_same_v<T, std::vector<double>>;

/// CLI11's check with another sentence: its own prints limits with as many as 309 digits.
template <class Number, class IsGood>
CLI::Validator check_number(CLI::Validator check, const IsGood& is_good, const std::string& kind) {
  return check.operation([is_good, kind](const std::string& text) {
    Number value = 0;
    const bool good = CLI::detail::lexical_cast(text, value) && is_good(value);
    return good ? std::string() : text + " is not " + kind;
  });
}

template <class Number>
CLI::Validator make_range(Number low, Number high) {
  std::string kind;
  if constexpr (std::is_floating_point_v<Number>) {
    kind = fmt::format("a number from {:g} to {:g}", low, high);
  } else {
    kind = fmt::format("a whole number from {} to {}", low, high);
  }
  return check_number<Number>(
      CLI::Range(low, high), [=](Number value) { return value >= low && value <= high; }, kind);
}

}  // namespace

Option Option::require() const { return Option(option_->required()); }
Option Option::show_default() const { return Option(option_->capture_default_str()); }
Option Option::set_default_text(std::string_view text) const {
  return Option(option_->default_str(std::string(text)));
}
Option Option::set_type(std::string_view type) const { return Option(option_->type_name(std::string(type))); }
Option Option::set_group(const std::string& group) const { return Option(option_->group(group)); }
Option Option::set_description(std::string_view description) const {
  return Option(option_->description(std::string(description)));
}
Option Option::read_environment(const std::string& name) const { return Option(option_->envname(name)); }
Option Option::make_value_optional() const { return Option(option_->expected(0, 1)); }
Option Option::split_at_commas() const { return Option(option_->delimiter(',')); }
Option Option::take_one_value() const { return Option(option_->allow_extra_args(false)); }
Option Option::take_all_values() const { return Option(option_->take_all()); }
Option Option::exclude(Option other) const { return Option(option_->excludes(other.option_)); }
Option Option::exclude(const char* name) const { return Option(option_->excludes(name)); }
Option Option::need(Option other) const { return Option(option_->needs(other.option_)); }
Option Option::need(const char* name) const { return Option(option_->needs(name)); }

Option Option::check_range(int low, int high) const { return Option(option_->check(make_range(low, high))); }
Option Option::check_range(unsigned low, unsigned high) const {
  return Option(option_->check(make_range(low, high)));
}
Option Option::check_range(double low, double high) const {
  return Option(option_->check(make_range(low, high)));
}
Option Option::check_unshown_range(double low, double high) const {
  return Option(option_->check(make_range(low, high).description("")));
}
Option Option::check_positive() const {
  return Option(option_->check(check_number<double>(
      CLI::PositiveNumber, [](double value) { return value > 0; }, "a number above 0")));
}
Option Option::check_not_negative() const {
  return Option(option_->check(check_number<double>(
      CLI::NonNegativeNumber, [](double value) { return value >= 0; }, "a number from 0 on")));
}
Option Option::check_choices(const std::vector<std::string>& choices) const {
  return Option(option_->check(CLI::IsMember(choices)));
}
Option Option::check_numbered_choices(const std::map<std::string, int>& choices) const {
  return Option(option_->transform(CLI::CheckedTransformer(choices)));
}
Option Option::check(std::function<std::string(const std::string&)> problem_of) const {
  return Option(option_->check(std::move(problem_of)));
}

bool Option::is_given() const { return option_->count() > 0; }
bool Option::takes_value() const { return option_->get_items_expected_max() > 0; }
std::string Option::name() const { return option_->get_name(); }
const std::string& Option::group() const { return option_->get_group(); }
const std::vector<std::string>& Option::values() const { return option_->results(); }

Verb Verb::add_verb(std::string_view name, std::string_view description) const {
  return Verb(app_->add_subcommand(std::string(name), std::string(description)));
}

template <class T>
Option Verb::add_option(std::string_view names, T& value, std::string_view description) const {
  CLI::Option* const option = app_->add_option(std::string(names), value, std::string(description));
  if constexpr (kHoldsDoubles<T>) option->check(describe_infinite);
  return Option(option);
}
#define EMBERLOCK_OPTION_OF(...) \
  template Option Verb::add_option(std::string_view, __VA_ARGS__&, std::string_view) const
EMBERLOCK_OPTION_OF(int);
EMBERLOCK_OPTION_OF(double);
EMBERLOCK_OPTION_OF(std::uint32_t);
EMBERLOCK_OPTION_OF(std::uint64_t);
EMBERLOCK_OPTION_OF(std::string);
EMBERLOCK_OPTION_OF(std::filesystem::path);
EMBERLOCK_OPTION_OF(std::optional<int>);
EMBERLOCK_OPTION_OF(std::optional<double>);
EMBERLOCK_OPTION_OF(std::optional<std::uint64_t>);
EMBERLOCK_OPTION_OF(std::optional<std::string>);
EMBERLOCK_OPTION_OF(std::vector<int>);
EMBERLOCK_OPTION_OF(std::vector<double>);
EMBERLOCK_OPTION_OF(std::vector<std::string>);
#undef EMBERLOCK_OPTION_OF

Option Verb::add_option_function(std::string_view names, const std::function<void(const std::string&)>& take,
                                 std::string_view description) const {
  return Option(app_->add_option_function<std::string>(std::string(names), take, std::string(description)));
}
Option Verb::add_flag(std::string_view names, bool& value, std::string_view description) const {
  return Option(app_->add_flag(std::string(names), value, std::string(description)));
}
Option Verb::add_flag_function(std::string_view names, std::function<void()> take,
                               std::string_view description) const {
  return Option(app_->add_flag_callback(std::string(names), std::move(take), std::string(description)));
}
Option Verb::add_threads(int& threads) const {
  return add_option("--threads", threads, "CPU threads; 0: one per core").check_range(0, 256).show_default();
}
Option Verb::add_device(std::string& device) const {
  return add_option("--device", device, "auto, cpu, cuda, or cuda:N: the GPU of this number").show_default();
}
Verb Verb::add_alternatives(std::string_view name, std::string_view description) const {
  CLI::Option_group* group = app_->add_option_group(std::string(name), std::string(description));
  group->require_option(1);
  return Verb(group);
}
void Verb::add_version_flag(const std::string& version) const {
  app_->set_version_flag("--version", version);
}
void Verb::remove_option(const std::string& name) const { app_->remove_option(app_->get_option(name)); }

void Verb::set_action(std::function<void()> action) const { app_->callback(std::move(action)); }
void Verb::set_action_on_words(std::function<void(std::vector<std::string>)> action) const {
  app_->prefix_command();
  app_->set_help_flag();
  app_->callback([app = app_, action = std::move(action)] { action(app->remaining()); });
}
void Verb::require_verb() const { app_->require_subcommand(1); }
void Verb::allow_verb() const { app_->require_subcommand(0, 1); }
Verb Verb::hide() const { return Verb(app_->group("")); }

Option Verb::find_option(const std::string& name) const { return Option(app_->get_option(name)); }
std::vector<Option> Verb::given_options() const {
  std::vector<Option> given;
  for (CLI::Option* option : app_->get_options({}))
    if (option->count() > 0) given.emplace_back(option);
  return given;
}
bool Verb::is_given(const std::string& option) const { return app_->count(option) > 0; }
bool Verb::has_verb(const std::string& name) const {
  return !app_->get_subcommands([&](CLI::App* verb) { return verb->check_name(name); }).empty();
}
bool Verb::verb_is_given() const { return !app_->get_subcommands().empty(); }
std::string Verb::version() const { return app_->version(); }

CommandLine::CommandLine(const std::string& description, const std::string& name)
    : app_(std::make_unique<CLI::App>(description, name)), program_(app_.get()) {}
CommandLine::~CommandLine() = default;

void CommandLine::parse(std::vector<std::string> words) const {
  std::reverse(words.begin(), words.end());  // CLI11 takes them last first
  try {
    app_->parse(std::move(words));
  } catch (const CLI::Success& asked) {  // --help or --version
    app_->exit(asked);
  } catch (const CLI::ParseError& error) {
    throw UsageError(error.what());
  }
}

}  // namespace emberlock::cli
