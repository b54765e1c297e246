// SPDX-License-Identifier: Apache-2.0
// A room is a namespace, a class has its name to itself there, and a file and a function have a size.
#include <map>
#include <regex>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/unit/house/tree.h"

namespace emberlock::house {
namespace {

/// The namespace that a line opens, else nothing.
std::string opened_by(const std::string& line) {
  static const std::regex opens("^namespace (emberlock[a-z_:A-Z]*) \\{");
  std::smatch match;
  return line.starts_with("namespace ") && std::regex_search(line, match, opens) ? match[1].str() : "";
}

TEST(House, ARoomIsANamespace) {
  EXPECT_GT(sources().size(), 500U);
  for (const Source& source : sources()) {
    const std::string space = namespace_of(source.room);
    for (const std::string& line : source.lines) {
      const std::string opened = opened_by(line);
      if (opened.empty() || opened == "emberlock_controller")
        continue;  // firmware, which knows nothing of the rest
      EXPECT_TRUE(opened == space || opened.starts_with(space + "::"))
          << source.path << " opens " << opened << ", not " << space;
    }
  }
}

/// What one program links twice under one name is one of the two, whichever the linker likes.
TEST(House, NoTwoClassesShareANameInANamespace) {
  const std::regex declares("^(?:class|struct|enum class|enum|union) (\\w+)(?: final)?(?: : [^{]*)? \\{");
  std::map<std::string, std::string> where;
  for (const Source& source : sources()) {
    std::string space;
    bool anonymous = false;
    std::smatch match;
    for (const std::string& line : source.lines) {
      if (const std::string opened = opened_by(line); !opened.empty()) space = opened;
      if (line == "namespace {") anonymous = true;
      if (line == "}  // namespace") anonymous = false;
      const bool may_declare = !line.empty() && std::string_view("cseu").find(line[0]) != std::string::npos;
      if (space.empty() || anonymous || !may_declare || !std::regex_search(line, match, declares)) continue;
      const std::string name = space + "::" + match[1].str();
      const auto [at, first] = where.emplace(name, source.path.string());
      const bool alternatives = at->second == source.path.string();  // behind one #if
      EXPECT_TRUE(first || alternatives)
          << name << " is declared in " << at->second << " and in " << source.path;
    }
  }
  EXPECT_GT(where.size(), 500U);
}

TEST(House, EverySourceNamesItsLicence) {
  for (const Source& source : sources()) {
    ASSERT_FALSE(source.lines.empty()) << source.path;
    EXPECT_EQ(source.lines.front(), "// SPDX-License-Identifier: Apache-2.0") << source.path;
  }
}

TEST(House, NoSourceIsLongerThan450Lines) {
  for (const Source& source : sources()) EXPECT_LE(source.lines.size(), 450U) << source.path;
}

/// CONTRIBUTING.md shows code of examples that are built and run, as it stands there.
TEST(House, WhatContributingQuotesIsBuilt) {
  std::string built;
  for (const char* folder : {"tests/unit/examples", "tests/integration/library/program"})
    for (const auto& entry : fs::directory_iterator(kRoot / folder)) built += text_of(entry.path());
  std::istringstream page(text_of(kRoot / "CONTRIBUTING.md"));
  int quotations = 0;
  std::string quoted;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (!line.starts_with("```")) {
      if (inside) quoted += line + "\n";
      continue;
    }
    if (inside) {
      ++quotations;
      EXPECT_NE(built.find(quoted), std::string::npos) << quoted;
    }
    inside = !inside;
    quoted.clear();
  }
  EXPECT_GE(quotations, 6);
}

/// As clang-format lays them out: from the line that opens it to the brace under its first letter.
TEST(House, NoFunctionIsLongerThan70Lines) {
  const std::regex opens("^( {0,4})[A-Za-z\\[].*\\)(?: const| noexcept| override)*(?: -> [^{]*)? \\{$");
  const std::regex other("^ *(?:namespace|struct|class|if|for|while|switch|else|do|return)\\b");
  for (const Source& source : sources()) {
    std::smatch match;
    for (std::size_t i = 0; i < source.lines.size(); ++i) {
      const std::string& line = source.lines[i];
      if (!line.ends_with(" {") || !std::regex_search(line, match, opens) || std::regex_search(line, other))
        continue;
      const std::string closes = match[1].str() + "}";
      std::size_t end = i + 1;
      while (end < source.lines.size() && !source.lines[end].starts_with(closes)) ++end;
      EXPECT_LE(end - i + 1, 70U) << source.path << ':' << i + 1;
    }
  }
}

}  // namespace
}  // namespace emberlock::house
