// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <vector>

// The rooms and their sources, read once.
namespace emberlock::house {

namespace fs = std::filesystem;

inline const fs::path kRoot = EMBERLOCK_SOURCE_DIR;

/// The rooms, and which others each may include.
inline const std::map<std::string, std::set<std::string>> kMayInclude{
    {"base", {}},
    {"smear_sync", {"base"}},
    {"session", {"base", "proto"}},
    {"drivers", {"base", "session"}},
    {"recon", {"base", "session"}},
    {"rig", {"base", "proto", "smear_sync", "session", "drivers", "recon"}},
    {"films", {"base", "proto", "smear_sync", "session", "recon"}},
    {"evaluate", {"base", "smear_sync", "session", "recon"}},
    {"apply", {"base", "session", "recon"}},
    {"report", {"base", "proto", "smear_sync", "session", "recon", "rig", "films", "evaluate"}},
    {"paper",
     {"base", "proto", "smear_sync", "session", "drivers", "recon", "rig", "films", "evaluate", "apply",
      "report"}},
    {"daemon", {"base", "proto", "smear_sync", "session", "drivers", "recon", "rig", "report"}},
    {"cli",
     {"base", "proto", "smear_sync", "session", "drivers", "recon", "rig", "films", "evaluate", "apply",
      "report"}},
};

inline std::string namespace_of(const std::string& room) {
  return room == "base" ? "emberlock" : "emberlock::" + (room == "smear_sync" ? "smear" : room);
}

inline std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Source {
  fs::path path;  ///< from the root
  std::string room;
  std::vector<std::string> lines;
};

inline std::vector<Source> read_sources(const std::string& room) {
  std::vector<Source> sources;
  for (auto entry = fs::recursive_directory_iterator(kRoot / room); entry != fs::end(entry); ++entry) {
    if (entry->path().filename() == "tests") entry.disable_recursion_pending();  // paper/tests
    const std::string extension = entry->path().extension();
    if (extension != ".h" && extension != ".cpp" && extension != ".cu" && extension != ".cuh") continue;
    Source source{fs::relative(entry->path(), kRoot), room, {}};
    std::ifstream in(entry->path());
    for (std::string line; std::getline(in, line);) source.lines.push_back(line);
    sources.push_back(std::move(source));
  }
  return sources;
}

inline const std::vector<Source>& sources() {
  static const std::vector<Source> all = [] {
    std::vector<Source> sources;
    for (const auto& [room, allowed] : kMayInclude)
      for (Source& source : read_sources(room)) sources.push_back(std::move(source));
    return sources;
  }();
  return all;
}

}  // namespace emberlock::house
