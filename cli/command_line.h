// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

// CLI11's header takes seconds in each source that includes it. These handles hide it from the verbs.
namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace emberlock::cli {

/// The end of the program with this exit code. fail() prints the reason and throws it.
class Exit : public std::runtime_error {
 public:
  explicit Exit(int exit_code, const std::string& reason = "exit")
      : std::runtime_error(reason), code(exit_code) {}
  int code;
};

/// A wrong command line, such as "--out is required". run() prints it and names the help's command.
class UsageError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A reference to an option, a flag or a positional of a verb. Its setters return it, so that they chain.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option require() const;
  Option show_default() const;                      ///< shows the variable's present value in the help
  Option set_default_text(std::string_view) const;  ///< is also the value where none follows
  Option set_type(std::string_view) const;          ///< names the value in the help: "FILE"
  Option set_group(const std::string&) const;       ///< sets its heading in the help
  Option set_description(std::string_view) const;
  Option read_environment(const std::string&) const;  ///< takes this variable where the option isn't given
  Option make_value_optional() const;
  Option split_at_commas() const;
  Option take_one_value() const;   ///< adds one value to a list each time that it is given
  Option take_all_values() const;  ///< keeps the values of every time that it is given
  Option exclude(Option) const;
  Option exclude(const char* name) const;
  Option need(Option) const;
  Option need(const char* name) const;

  // Checks refuse other values. The help shows the range or the choices, except of check_unshown_range().
  Option check_range(int low, int high) const;
  Option check_range(unsigned low, unsigned high) const;
  Option check_range(double low, double high) const;
  Option check_unshown_range(double low, double high) const;
  Option check_positive() const;
  Option check_not_negative() const;
  Option check_choices(const std::vector<std::string>&) const;
  /// Replaces the choice by its number, which users may give too.
  Option check_numbered_choices(const std::map<std::string, int>&) const;
  /// `problem_of` returns an empty text for a good value.
  Option check(std::function<std::string(const std::string&)> problem_of) const;

  [[nodiscard]] bool is_given() const;
  [[nodiscard]] bool takes_value() const;
  [[nodiscard]] std::string name() const;
  [[nodiscard]] const std::string& group() const;
  [[nodiscard]] const std::vector<std::string>& values() const;  ///< the user's own words

 private:
  CLI::Option* option_;
};

/// A reference to a verb, or to the program itself.
class Verb {
 public:
  explicit Verb(CLI::App* app) : app_(app) {}

  Verb add_verb(std::string_view name, std::string_view description) const;
  /// `names` is "--out", or "SESSION" for a positional. command_line.cpp lists the types.
  template <class T>
  Option add_option(std::string_view names, T& value, std::string_view description) const;
  Option add_option_function(std::string_view names, const std::function<void(const std::string&)>& take,
                             std::string_view description) const;
  Option add_flag(std::string_view names, bool& value, std::string_view description) const;
  Option add_flag_function(std::string_view names, std::function<void()> take,
                           std::string_view description) const;
  // These two are the same in all verbs that compute.
  Option add_threads(int& threads) const;
  Option add_device(std::string& device) const;
  /// Returns a group of options, exactly one of which must be given.
  Verb add_alternatives(std::string_view name, std::string_view description) const;
  void add_version_flag(const std::string& version) const;
  void remove_option(const std::string& name) const;

  void set_action(std::function<void()> action) const;
  /// Hands every word after the verb, options too, to `action` unread.
  void set_action_on_words(std::function<void(std::vector<std::string>)> action) const;
  void require_verb() const;
  void allow_verb() const;  ///< allows at most one verb below it
  Verb hide() const;        ///< leaves it out of help, manual and completion

  [[nodiscard]] Option find_option(const std::string& name) const;
  [[nodiscard]] std::vector<Option> given_options() const;
  [[nodiscard]] bool is_given(const std::string& option) const;
  [[nodiscard]] bool has_verb(const std::string& name) const;
  [[nodiscard]] bool verb_is_given() const;
  [[nodiscard]] std::string version() const;  ///< the text of add_version_flag()
  [[nodiscard]] CLI::App& app() const { return *app_; }

 private:
  CLI::App* app_;
};

/// A program's command line, which owns its verbs.
class CommandLine {
 public:
  explicit CommandLine(const std::string& description = "", const std::string& name = "emberlock");
  ~CommandLine();
  CommandLine(CommandLine&&) = delete;
  CommandLine& operator=(CommandLine&&) = delete;

  [[nodiscard]] const Verb& program() const { return program_; }
  /// Runs the words after the program's name. Throws Exit or UsageError.
  void parse(std::vector<std::string> words) const;

 private:
  std::unique_ptr<CLI::App> app_;
  Verb program_;
};

template <class T>
std::vector<std::string> names_of(const std::map<std::string, T>& map) {
  std::vector<std::string> names;
  names.reserve(map.size());
  for (const auto& [name, value] : map) names.push_back(name);
  return names;
}

}  // namespace emberlock::cli
