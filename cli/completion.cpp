// SPDX-License-Identifier: Apache-2.0
#include "cli/completion.h"

#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/app_tree.h"

namespace emberlock::cli {
namespace {

struct Word {
  enum class Kind { verb, flag, option };  ///< an option is followed by a value
  Kind kind = Kind::verb;
  std::string text;  ///< without dashes
  std::string what;
  [[nodiscard]] std::string typed() const { return (kind == Kind::verb ? "" : "--") + text; }
};

/// The possible continuations of the words `path`.
struct Place {
  std::string path;
  std::vector<Word> words;
};

std::vector<Place> places_of(const Verb& program) {
  std::vector<Place> places;
  const VerbWords tree = describe_tree(program);
  for (const VerbWords* verb : list_verbs(tree)) {
    Place& place = places.emplace_back(Place{verb->path, {}});
    for (const VerbWords& below : verb->verbs)
      place.words.push_back({Word::Kind::verb, below.name, first_clause(below.description)});
    for (const OptionWords& option : verb->options) {
      const Word::Kind kind = option.takes_value ? Word::Kind::option : Word::Kind::flag;
      for (const std::string& name : option.long_names)
        place.words.push_back({kind, name, first_clause(option.description)});
    }
  }
  return places;
}

std::string in_quotes(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string(R"('\'')") : std::string(1, c);
  return quoted + "'";
}

/// 'emberlock devices' | 'emberlock align' ...: words that have continuations.
std::string verbs_among(const std::vector<Place>& places, const char* between) {
  std::vector<std::string> verbs;
  for (const Place& place : places)
    if (&place != &places.front()) verbs.push_back(in_quotes(place.path));
  return fmt::format("{}", fmt::join(verbs, between));
}

/// 'emberlock align --delays' | ...: options followed by a value.
std::string valued_among(const std::vector<Place>& places) {
  std::vector<std::string> valued;
  for (const Place& place : places)
    for (const Word& word : place.words)
      if (word.kind == Word::Kind::option) valued.push_back(in_quotes(place.path + " " + word.typed()));
  return fmt::format("{}", fmt::join(valued, " | "));
}

}  // namespace

std::string bash_completion(const Verb& program) {
  const std::vector<Place> places = places_of(program);
  std::string offers;
  for (const Place& place : places) {
    std::vector<std::string> words;
    for (const Word& word : place.words) words.push_back(word.typed());
    offers += fmt::format("    '{}') offers='{}' ;;\n", place.path, fmt::join(words, " "));
  }
  return "# bash completion of emberlock; made by `emberlock completion bash`\n"
         "_emberlock() {\n"
         "  local word offers verb=emberlock current=${COMP_WORDS[COMP_CWORD]}\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    case \"$verb $word\" in\n      " +
         verbs_among(places, " | ") +
         ") verb=\"$verb $word\" ;;\n    esac\n  done\n"
         "  case \"$verb\" in\n" +
         offers +
         "  esac\n"
         "  # Behind these comes a value: bash offers files.\n"
         "  case \"$verb ${COMP_WORDS[COMP_CWORD-1]}\" in\n    " +
         valued_among(places) +
         ") offers= ;;\n  esac\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$offers\" -- \"$current\")\n"
         "}\n"
         "complete -o bashdefault -o default -F _emberlock emberlock\n";
}

std::string zsh_completion(const Verb& program) {
  const std::vector<Place> places = places_of(program);
  std::string offers;
  for (const Place& place : places) {
    offers += "    " + in_quotes(place.path) + ") offers=(\n";
    for (const Word& word : place.words)
      offers += "      " + in_quotes(word.typed() + ":" + word.what) + "\n";
    offers += "    ) ;;\n";
  }
  return "#compdef emberlock\n"
         "# made by `emberlock completion zsh`\n"
         "_emberlock() {\n"
         "  local word verb=emberlock\n"
         "  local -a offers\n"
         "  for word in ${words[2,CURRENT-1]}; do\n"
         "    case \"$verb $word\" in\n      " +
         verbs_among(places, " | ") +
         ") verb=\"$verb $word\" ;;\n    esac\n  done\n"
         "  # Behind these comes a value.\n"
         "  case \"$verb ${words[CURRENT-1]}\" in\n    " +
         valued_among(places) +
         ") _files; return ;;\n  esac\n"
         "  case \"$verb\" in\n" +
         offers +
         "  esac\n"
         "  _describe emberlock offers || _files\n"
         "}\n"
         "_emberlock \"$@\"\n";
}

std::string fish_completion(const Verb& program) {
  const std::vector<Place> places = places_of(program);
  std::string script =
      "# fish completion of emberlock; made by `emberlock completion fish`\n"
      "function __emberlock_at --description 'Whether these are the verbs that were typed'\n"
      "  set -l verb emberlock\n"
      "  for word in (commandline -opc)[2..-1]\n"
      "    switch \"$verb $word\"\n      case " +
      verbs_among(places, " ") +
      "\n        set verb \"$verb $word\"\n    end\n  end\n"
      "  test \"$verb\" = \"$argv[1]\"\nend\n";
  for (const Place& place : places) {
    const std::string here = fmt::format("complete -c emberlock -n \"__emberlock_at '{}'\"", place.path);
    for (const Word& word : place.words) {
      const std::string what = in_quotes(word.what);
      if (word.kind == Word::Kind::verb) script += fmt::format("{} -f -a {} -d {}\n", here, word.text, what);
      if (word.kind == Word::Kind::flag) script += fmt::format("{} -l {} -d {}\n", here, word.text, what);
      if (word.kind == Word::Kind::option)
        script += fmt::format("{} -r -F -l {} -d {}\n", here, word.text, what);
    }
  }
  return script;
}

}  // namespace emberlock::cli
