// SPDX-License-Identifier: Apache-2.0
// The layers of the house: a room includes only what stands above it (README.md, "Folders").
#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/house/tree.h"

namespace emberlock::house {
namespace {

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

/// The header of a line `#include "..."`, else nothing.
std::string included_by(const std::string& line) {
  const std::size_t word = line.find_first_not_of(" \t#");
  const std::size_t quote = line.find('"');
  if (line.find('#') >= word || !line.substr(word).starts_with("include") || quote == std::string::npos)
    return "";
  return line.substr(quote + 1, line.find('"', quote + 1) - quote - 1);
}

std::vector<Include> includes_below(const std::string& room) {
  std::vector<Include> found;
  for (const Source& source : room == "tests" ? read_sources(room) : sources()) {
    if (source.room != room) continue;
    for (const std::string& line : source.lines)
      if (const std::string header = included_by(line); !header.empty())
        found.push_back({source.path, header});
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
    if (folder_of(header) != "drivers" || part(header, 2).empty())
      continue;  // drivers/camera.h is everybody's
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
      if (folder_of(header) != house) continue;
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
       {"base", "smear_sync", "session", "recon", "films", "evaluate", "apply", "report", "paper", "cli"})
    EXPECT_TRUE(rooms.contains(room)) << room << " is not in links.txt";
}

/// paper/ is built on request, so neither a room nor a test outside of it may need it.
TEST(House, NothingOutsideOfPaperNeedsIt) {
  for (const auto& [file, header] : includes_below("tests"))
    EXPECT_NE(folder_of(header), "paper") << file << " includes \"" << header << '"';
  std::ifstream file(fs::path(EMBERLOCK_BUILD_DIR) / "links.txt");
  int users = 0;
  for (std::string line; std::getline(file, line);) {
    if (line.find("emberlock::paper") == std::string::npos) continue;
    ++users;
    EXPECT_TRUE(line.starts_with("emberlock-paper ")) << line;
  }
  EXPECT_EQ(users, 1);
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

/// Sources, no headers, that hold one of these calls.
std::set<std::string> files_that_call(const std::vector<std::string>& calls) {
  std::set<std::string> found;
  for (const Source& source : sources()) {
    if (source.path.extension() != ".cpp" ||
        !std::set<std::string>{"cli", "films", "paper", "report", "recon"}.contains(source.room))
      continue;
    for (const std::string& line : source.lines)
      for (const std::string& call : calls)
        if (line.find(call) != std::string::npos) found.insert(source.path.string());
  }
  return found;
}

/// What a verb writes goes through base/output_folder.h, which alone replaces and removes. The import's
/// unfinished work is known by its content too; a batch's ledger is renames, in a folder that it made,
/// from which a damaged chunk's list is removed.
TEST(House, OnlyOutputFolderReplacesAndRemovesFolders) {
  EXPECT_EQ(
      files_that_call({"remove_all(", "rename(", "rmdir(", "unlink("}),
      (std::set<std::string>{"cli/batch_result.cpp", "films/import_parts.cpp", "recon/batch/ledger.cpp"}));
  // These fill a folder that OutputFolder made.
  EXPECT_EQ(files_that_call({"create_director"}),
            (std::set<std::string>{"report/box_pictures.cpp", "films/import_parts.cpp",
                                   "recon/calibrate/rig_formats.cpp", "recon/pipeline/reconstruct.cpp",
                                   "cli/stylize_command.cpp", "recon/batch/ledger.cpp"}));
}

TEST(House, EveryFolderExplainsItself) {
  for (const auto& [room, allowed] : kMayInclude) EXPECT_TRUE(fs::exists(kRoot / room / "README.md")) << room;
  for (const char* folder : {"proto", "tests"})
    EXPECT_TRUE(fs::exists(kRoot / folder / "README.md")) << folder;
}

}  // namespace
}  // namespace emberlock::house
