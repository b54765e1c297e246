// SPDX-License-Identifier: Apache-2.0
// A room is a namespace, a class has its name to itself there, and a file and a function have a size.
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace emberlock {
namespace {
namespace fs = std::filesystem;

const fs::path kSources = EMBERLOCK_SOURCE_DIR;

/// The folder and the namespace of what it holds.
const std::map<std::string, std::string> kRooms{
    {"base", "emberlock"},
    {"smear_sync", "emberlock::smear"},
    {"session", "emberlock::session"},
    {"drivers", "emberlock::drivers"},
    {"recon", "emberlock::recon"},
    {"rig", "emberlock::rig"},
    {"films", "emberlock::films"},
    {"evaluate", "emberlock::evaluate"},
    {"apply", "emberlock::apply"},
    {"report", "emberlock::report"},
    {"paper", "emberlock::paper"},
    {"daemon", "emberlock::daemon"},
    {"cli", "emberlock::cli"},
};

struct Source {
  std::string path;  // from the root
  std::string room;
  std::vector<std::string> lines;
};

std::vector<Source> ship_sources() {
  std::vector<Source> sources;
  for (const auto& [room, space] : kRooms) {
    for (auto entry = fs::recursive_directory_iterator(kSources / room); entry != fs::end(entry); ++entry) {
      if (entry->path().filename() == "tests") entry.disable_recursion_pending();  // paper/tests
      const std::string extension = entry->path().extension();
      if (extension != ".h" && extension != ".cpp" && extension != ".cu") continue;
      Source source{fs::relative(entry->path(), kSources).string(), room, {}};
      std::ifstream in(entry->path());
      for (std::string line; std::getline(in, line);) source.lines.push_back(line);
      sources.push_back(std::move(source));
    }
  }
  EXPECT_GT(sources.size(), 500U);
  return sources;
}

TEST(House, ARoomIsANamespace) {
  const std::regex opens("^namespace (emberlock[a-z_:A-Z]*) \\{");
  for (const Source& source : ship_sources()) {
    const std::string& space = kRooms.at(source.room);
    std::smatch match;
    for (const std::string& line : source.lines) {
      if (!std::regex_search(line, match, opens)) continue;
      const std::string opened = match[1];
      if (opened == "emberlock_controller") continue;  // firmware, which knows nothing of the rest
      EXPECT_TRUE(opened == space || opened.starts_with(space + "::"))
          << source.path << " opens " << opened << ", not " << space;
    }
  }
}

/// What one program links twice under one name is one of the two, whichever the linker likes.
TEST(House, NoTwoClassesShareANameInANamespace) {
  const std::regex opens("^namespace (emberlock[a-z_:A-Z]*) \\{");
  const std::regex declares("^(?:class|struct|enum class|enum|union) (\\w+)(?: final)?(?: : [^{]*)? \\{");
  std::map<std::string, std::string> where;
  for (const Source& source : ship_sources()) {
    std::string space;
    bool anonymous = false;
    std::smatch match;
    for (const std::string& line : source.lines) {
      if (std::regex_search(line, match, opens)) space = match[1];
      if (line == "namespace {") anonymous = true;
      if (line == "}  // namespace") anonymous = false;
      if (space.empty() || anonymous || !std::regex_search(line, match, declares)) continue;
      const std::string name = space + "::" + match[1].str();
      const auto [at, first] = where.emplace(name, source.path);
      const bool alternatives = at->second == source.path;  // behind one #if
      EXPECT_TRUE(first || alternatives)
          << name << " is declared in " << at->second << " and in " << source.path;
    }
  }
  EXPECT_GT(where.size(), 500U);
}

TEST(House, EverySourceNamesItsLicence) {
  for (const Source& source : ship_sources()) {
    ASSERT_FALSE(source.lines.empty()) << source.path;
    EXPECT_EQ(source.lines.front(), "// SPDX-License-Identifier: Apache-2.0") << source.path;
  }
}

TEST(House, NoSourceIsLongerThan450Lines) {
  for (const Source& source : ship_sources()) EXPECT_LE(source.lines.size(), 450U) << source.path;
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// CONTRIBUTING.md shows code of examples that are built and run, as it stands there.
TEST(House, WhatContributingQuotesIsBuilt) {
  std::string built;
  for (const char* folder : {"tests/unit/examples", "tests/integration/library/program"})
    for (const auto& entry : fs::directory_iterator(kSources / folder)) built += text_of(entry.path());
  std::istringstream page(text_of(kSources / "CONTRIBUTING.md"));
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
  const std::regex other("^ *(?:namespace|struct|class|if|for|while|switch|else|do)\\b");
  for (const Source& source : ship_sources()) {
    std::smatch match;
    for (std::size_t i = 0; i < source.lines.size(); ++i) {
      const std::string& line = source.lines[i];
      if (!std::regex_search(line, match, opens) || std::regex_search(line, other)) continue;
      const std::string closes = match[1].str() + "}";
      std::size_t end = i + 1;
      while (end < source.lines.size() && !source.lines[end].starts_with(closes)) ++end;
      EXPECT_LE(end - i + 1, 70U) << source.path << ':' << i + 1;
    }
  }
}

}  // namespace
}  // namespace emberlock
