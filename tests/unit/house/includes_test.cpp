// SPDX-License-Identifier: Apache-2.0
// The layers of the house: a room includes only what stands above it (README.md, "Folders").
#include <filesystem>
#include <fstream>
#include <functional>
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

const fs::path kRoot = EMBERLOCK_SOURCE_DIR;

const std::map<std::string, std::set<std::string>> kMayInclude{
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
    {"daemon", {"base", "proto", "smear_sync", "session", "drivers", "recon", "rig", "report"}},
    {"cli",
     {"base", "proto", "smear_sync", "session", "drivers", "recon", "rig", "films", "evaluate", "apply",
      "report"}},
};

// Inside these a folder includes itself, the ones before it, and what lies directly in the house's folder.
const std::map<std::string, std::vector<std::string>> kInnerOrder{
    {"recon",
     {"kernels", "compute", "views", "hull", "effects", "render", "adjust", "synthetic",  // recon_core
      "calibrate", "preprocess", "temperature", "export", "pipeline", "batch"}},
    {"smear_sync", {"detect", "clocks", "sensors", "align", "verify"}},
    {"session", {"media"}},
};

// The only headers of smear_sync that the virtual cameras may see.
const std::set<std::string> kVirtualMayInclude{"smear_sync/ccd_model.h", "smear_sync/ccd_timing.h"};

struct Include {
  fs::path file;  // relative to the root
  std::string header;
};

std::vector<Include> includes_below(const std::string& folder) {
  static const std::regex pattern("^\\s*#\\s*include\\s*\"([^\"]+)\"");
  std::vector<Include> found;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
    const std::string extension = entry.path().extension();
    if (extension != ".h" && extension != ".cpp" && extension != ".cu" && extension != ".cuh") continue;
    std::ifstream in(entry.path());
    std::smatch match;
    for (std::string line; std::getline(in, line);) {
      if (std::regex_search(line, match, pattern))
        found.push_back({fs::relative(entry.path(), kRoot), match[1]});
    }
  }
  return found;
}

std::string part(const fs::path& path, int index) {
  auto it = path.begin();
  for (int i = 0; i < index && it != path.end(); ++i) ++it;
  return it == path.end() ? "" : it->string();
}

std::string folder_of(const std::string& header) {
  const std::string first = part(header, 0);
  return first == "emberlock" ? "proto" : first;  // generated from proto/emberlock/v1
}

TEST(House, AFolderIncludesOnlyWhatStandsAboveIt) {
  for (const auto& [folder, allowed] : kMayInclude) {
    const auto includes = includes_below(folder);
    EXPECT_FALSE(includes.empty() && folder != "base") << folder << " was not read";
    for (const auto& [file, header] : includes) {
      const std::string target = folder_of(header);
      const bool of_virtual =
          part(file, 0) == "drivers" && part(file, 1) == "virtual" && kVirtualMayInclude.contains(header);
      EXPECT_TRUE(target == folder || allowed.contains(target) || of_virtual)
          << file << " includes \"" << header << "\", which " << folder << "/ may not";
    }
  }
}

TEST(House, ADriverNeverIncludesItsSibling) {
  for (const auto& [file, header] : includes_below("drivers")) {
    if (part(header, 0) != "drivers" || part(header, 2).empty()) continue;  // drivers/camera.h is everybody's
    EXPECT_EQ(part(file, 1), part(header, 1)) << file << " includes \"" << header << '"';
  }
}

TEST(House, InsideAFolderOnlyLowerOnesAreIncluded) {
  for (const auto& [house, order] : kInnerOrder) {
    const auto rank = [&order = order](const std::string& inner) {
      return inner.find('.') != std::string::npos
                 ? -1
                 : std::find(order.begin(), order.end(), inner) - order.begin();
    };
    for (const auto& [file, header] : includes_below(house)) {
      if (part(header, 0) != house) continue;
      const auto from = rank(part(file, 1));
      ASSERT_LT(from, static_cast<std::ptrdiff_t>(order.size()))
          << file << " lies in no folder of " << house << "'s list";
      EXPECT_LE(rank(part(header, 1)), from) << file << " includes \"" << header << '"';
    }
  }
}

TEST(House, TheListOfInnerFoldersIsTheirs) {
  for (const auto& [house, order] : kInnerOrder)
    for (const std::string& inner : order)
      EXPECT_TRUE(fs::is_directory(kRoot / house / inner)) << house << '/' << inner;
}

/// The room that a library of CMake's belongs to: "emberlock::drivers_v4l2", or "emberlock_drivers_v4l2".
std::string room_of(std::string library) {
  library = library.substr(library.starts_with("emberlock::") ? 11 : 10);
  if (library == "ccd_model") return "smear_sync";
  if (library == "grpc") return "proto";
  if (library == "version") return "base";
  const std::string first = library.substr(0, library.find('_'));  // drivers_v4l2, cli_client
  return library == "smear_sync" ? library : first;
}

/// links.txt is what CMake was told to link.
TEST(House, ARoomLinksOnlyWhatStandsAboveIt) {
  std::ifstream file(fs::path(EMBERLOCK_BUILD_DIR) / "links.txt");
  std::set<std::string> rooms;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string library;
    words >> library;
    if (!library.starts_with("emberlock_") || !kMayInclude.contains(room_of(library))) continue;  // programs
    const std::string room = room_of(library);
    rooms.insert(room);
    for (std::string link; words >> link;) {
      if (!link.starts_with("emberlock::")) continue;
      const bool of_virtual = library == "emberlock_drivers_virtual" && link == "emberlock::ccd_model";
      EXPECT_TRUE(room_of(link) == room || kMayInclude.at(room).contains(room_of(link)) || of_virtual)
          << library << " links " << link << ", which " << room << "/ may not";
    }
  }
  for (const char* room :
       {"base", "smear_sync", "session", "recon", "films", "evaluate", "apply", "report", "cli"})
    EXPECT_TRUE(rooms.contains(room)) << room << " is not in links.txt";
}

TEST(House, ReconCoreIncludesOfOtherRoomsOnlyBase) {
  const std::vector<std::string>& order = kInnerOrder.at("recon");
  for (const auto& [file, header] : includes_below("recon")) {
    const auto folder = std::find(order.begin(), order.end(), part(file, 1));
    if (folder >= std::find(order.begin(), order.end(), "calibrate")) continue;
    EXPECT_TRUE(header.starts_with("recon/") || header.starts_with("base/"))
        << file << " includes \"" << header << '"';
  }
}

TEST(House, ATargetOfReconLinksOnlyLowerOnes) {
  const std::vector<std::string> order{"core", "calibrate", "measure", "io"};
  const std::set<std::string> below_core{"emberlock::base", "Eigen3::Eigen", "TBB::tbb", "hwy",
                                         "CUDA::cudart_static"};
  const auto rank = [&](const std::string& link) {
    return std::find(order.begin(), order.end(), link.substr(link.rfind('_') + 1)) - order.begin();
  };
  std::ifstream file(fs::path(EMBERLOCK_BUILD_DIR) / "links.txt");
  std::size_t found = 0;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string target;
    words >> target;
    if (!target.starts_with("emberlock_recon_")) continue;
    ++found;
    ASSERT_LT(rank(target), static_cast<std::ptrdiff_t>(order.size())) << target;
    for (std::string link; words >> link;) {
      EXPECT_TRUE(!link.starts_with("emberlock::recon") || rank(link) < rank(target))
          << target << ' ' << link;
      EXPECT_TRUE(rank(target) > 0 || below_core.contains(link)) << target << ' ' << link;
    }
  }
  EXPECT_EQ(found, order.size());
}

/// Headers that include each other are one in two files.
TEST(House, NoHeaderIncludesItselfByWayOfOthers) {
  std::map<std::string, std::vector<std::string>> headers_of;
  for (const auto& [folder, allowed] : kMayInclude)
    for (const auto& [file, header] : includes_below(folder))
      if (file.extension() != ".cpp") headers_of[file.string()].push_back(header);
  enum class Mark { unseen, open, done };
  std::map<std::string, Mark> marks;
  const std::function<void(const std::string&)> visit = [&](const std::string& file) {
    Mark& mark = marks[file];
    EXPECT_NE(mark, Mark::open) << file << " includes itself by way of others";
    if (mark != Mark::unseen) return;
    mark = Mark::open;
    for (const std::string& header : headers_of[file]) visit(header);
    marks[file] = Mark::done;
  };
  for (const auto& [file, headers] : std::map(headers_of)) visit(file);
}

TEST(House, NothingIncludesTests) {
  for (const auto& [folder, allowed] : kMayInclude) {
    for (const auto& [file, header] : includes_below(folder)) {
      EXPECT_EQ(header.find("tests/"), std::string::npos) << file << " includes \"" << header << '"';
    }
  }
}

/// Files whose text holds what `pattern` says.
std::set<std::string> files_with(const std::vector<std::string>& folders, const std::regex& pattern) {
  std::set<std::string> found;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      if (entry.path().extension() != ".cpp") continue;
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      if (std::regex_search(text, pattern)) found.insert(fs::relative(entry.path(), kRoot).string());
    }
  }
  return found;
}

/// What a verb writes goes through base/output_folder.h, which alone replaces and removes. The import's
/// unfinished work is known by its content too; a batch's ledger is renames, in a folder that it made.
TEST(House, OnlyOutputFolderReplacesAndRemovesFolders) {
  EXPECT_EQ(files_with({"cli", "films", "report", "recon"},
                       std::regex("remove_all\\(|\\brename\\(|\\brmdir\\(|unlink\\(")),
            (std::set<std::string>{"films/import_parts.cpp", "recon/batch/ledger.cpp"}));
  // These fill a folder that OutputFolder made.
  EXPECT_EQ(files_with({"cli", "films", "report", "recon"}, std::regex("create_director")),
            (std::set<std::string>{"report/box_pictures.cpp", "films/import_parts.cpp",
                                   "recon/calibrate/rig_formats.cpp", "recon/pipeline/reconstruct.cpp",
                                   "cli/stylize_command.cpp", "recon/batch/ledger.cpp"}));
}

TEST(House, EveryFolderExplainsItself) {
  for (const char* folder : {"base", "proto", "smear_sync", "session", "drivers", "recon", "rig", "films",
                             "evaluate", "apply", "report", "daemon", "cli", "tests"}) {
    EXPECT_TRUE(fs::exists(kRoot / folder / "README.md")) << folder;
  }
}

}  // namespace
}  // namespace emberlock
