// SPDX-License-Identifier: Apache-2.0
#include "cli/sequence_state.h"

#include <algorithm>
#include <optional>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include "base/result_list.h"
#include "base/sha256.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kVolume = "volume.vdb";

const std::set<std::string>& options_of_files() {
  static const std::set<std::string> kFiles{"--rig", "--response", "--key"};
  return kFiles;
}

std::optional<ListedFile> listed_volume(const fs::path& folder) {
  const auto list = read_result_list(folder);
  if (!list) return std::nullopt;
  const auto found = std::find_if(list->files.begin(), list->files.end(),
                                  [](const ListedFile& file) { return file.path == kVolume; });
  return found == list->files.end() ? std::nullopt : std::optional(*found);
}

}  // namespace

std::string value_of(const Option& option) {
  std::string value = fmt::format("{}", fmt::join(option.values(), ","));
  if (option.name() != "--out" && !options_of_files().contains(option.name())) return value;
  std::error_code ec;
  return fs::absolute(value, ec).lexically_normal().string();
}

std::map<std::string, std::string> given_options(const Verb& verb, const std::set<std::string>& without) {
  std::map<std::string, std::string> given;
  for (const Option& option : verb.given_options()) {
    if (without.contains(option.name())) continue;
    std::string& value = given[option.name()] = value_of(option);
    if (!options_of_files().contains(option.name())) continue;
    if (const auto hash = hash_file(value)) value += " of SHA-256 " + hash->sha256;
  }
  return given;
}

std::string identity_of(const session::SessionReader& session) {
  const v1::Manifest& manifest = session.manifest();
  return fmt::format("{} of {}, {} cameras, {} frames", manifest.session_id(), manifest.created_utc(),
                     session.camera_count(), session.camera_count() == 0 ? 0 : session.stamps(0).size());
}

std::string listed_hash_of_volume(const fs::path& folder) {
  const auto listed = listed_volume(folder);
  return listed ? listed->sha256 : "";
}

bool holds_volume(const fs::path& folder, const report::SequenceFrame& row) {
  const fs::path path = folder / kVolume;
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return false;
  const auto listed = listed_volume(folder);
  const bool unchanged = listed && is_unchanged(*listed, path, info);
  if (row.volume.empty()) return unchanged || !listed;
  if (unchanged && !listed->sha256.empty()) return listed->sha256 == row.volume;
  const auto hash = hash_file(path);
  return hash.ok() && hash->sha256 == row.volume;
}

}  // namespace emberlock::cli
