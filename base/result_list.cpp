// SPDX-License-Identifier: Apache-2.0
#include "base/result_list.h"

#include <algorithm>

#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "base/file.h"
#include "base/nesting.h"
#include "base/output_folder.h"
#include "base/sha256.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

constexpr const char* kFormat = "emberlock result";
constexpr int kVersion = 1;
constexpr std::size_t kMostBytes = std::size_t{256} << 20;  // a million files

bool leads_inside(const fs::path& path) {
  return !path.empty() && path.is_relative() &&
         std::none_of(path.begin(), path.end(),
                      [](const fs::path& part) { return part == ".." || part == "." || part.empty(); });
}

std::optional<ListedFile> file_of(const ordered_json& entry) {
  const auto path = entry.find("path");
  const auto verb = entry.find("verb");
  const auto bytes = entry.find("bytes");
  const auto modified = entry.find("modified_ns");
  const auto end = entry.end();
  if (path == end || verb == end || bytes == end || modified == end || !path->is_string() ||
      !verb->is_string() || !bytes->is_number_unsigned() || !modified->is_number_integer()) {
    return std::nullopt;
  }
  ListedFile file{path->get<std::string>(), verb->get<std::string>(), bytes->get<std::uint64_t>(),
                  modified->get<std::int64_t>()};
  if (!leads_inside(file.path)) return std::nullopt;
  if (const auto hash = entry.find("sha256"); hash != end && hash->is_string())
    file.sha256 = hash->get<std::string>();
  return file;
}

std::optional<ResultList> list_of(const ordered_json& json) {
  if (!json.is_object()) return std::nullopt;
  const auto format = json.find("format");
  const auto version = json.find("version");
  const auto files = json.find("files");
  if (format == json.end() || *format != kFormat || version == json.end() || *version != kVersion ||
      files == json.end() || !files->is_array()) {
    return std::nullopt;
  }
  ResultList list;
  list.finished = !json.contains("unfinished");
  for (const ordered_json& entry : *files) {
    auto file = entry.is_object() ? file_of(entry) : std::nullopt;
    if (!file) return std::nullopt;
    list.files.push_back(std::move(*file));
  }
  return list;
}

}  // namespace

Result<ResultList> read_result_list(const fs::path& folder) {
  const fs::path path = folder / kResultList;
  std::error_code ec;
  if (fs::is_regular_file(fs::symlink_status(path, ec))) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path, kMostBytes));
    EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(text, path.string()));
    if (auto list = list_of(ordered_json::parse(text, nullptr, false))) return std::move(*list);
  }
  return Error{ErrorKind::bad_input, "is no list of a result's files", path.string()};
}

std::string result_list_text(const ResultList& list) {
  ordered_json json{{"format", kFormat}, {"version", kVersion}};
  if (!list.finished) json["unfinished"] = true;
  json["files"] = ordered_json::array();
  for (const ListedFile& file : list.files) {
    json["files"].push_back(
        {{"path", file.path}, {"verb", file.verb}, {"bytes", file.bytes}, {"modified_ns", file.modified_ns}});
    if (!file.sha256.empty()) json["files"].back()["sha256"] = file.sha256;
  }
  // A name that isn't UTF-8 doesn't survive the round trip. Its file then counts as somebody else's and is
  // kept.
  return json.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

ListedFile listed_as(std::string path, std::string verb, const struct stat& info) {
  return {std::move(path), std::move(verb), static_cast<std::uint64_t>(info.st_size),
          std::int64_t{info.st_mtim.tv_sec} * 1'000'000'000 + info.st_mtim.tv_nsec};
}

bool is_unchanged(const ListedFile& listed, const fs::path& path, const struct stat& info) {
  if (!S_ISREG(info.st_mode)) return false;
  const ListedFile now = listed_as({}, {}, info);
  if (now.bytes != listed.bytes) return false;
  if (now.modified_ns == listed.modified_ns) return true;
  if (listed.sha256.empty()) return false;
  const auto hash = hash_file(path);
  return hash.ok() && hash->sha256 == listed.sha256;
}

}  // namespace emberlock
