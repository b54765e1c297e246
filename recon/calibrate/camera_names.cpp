// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/camera_names.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <set>

#include <fmt/format.h>

#include "session/name.h"

namespace emberlock::recon {
namespace {

using Parts = std::vector<std::string>;

/// The folders of a path and its name without extension, without the parts that lead elsewhere.
Parts parts_of(std::string path) {
  std::replace(path.begin(), path.end(), '\\', '/');  // written on Windows
  Parts parts;
  for (const std::filesystem::path& part : std::filesystem::path(path))
    if (part != "." && part != ".." && part != "/" && !part.empty()) parts.push_back(part.string());
  if (!parts.empty()) parts.back() = std::filesystem::path(parts.back()).stem().string();
  return parts;
}

/// The ids that `part` takes of all pictures, if they differ wherever the pictures do.
std::vector<std::string> ids_by(const std::vector<std::string>& pictures, const std::vector<Parts>& parts,
                                const std::function<std::string(const Parts&)>& part) {
  std::map<std::string, std::string> picture_of;
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    ids.push_back(part(parts[i]));
    const auto [known, first] = picture_of.try_emplace(ids.back(), pictures[i]);
    if (!first && known->second != pictures[i]) return {};
  }
  return ids;
}

std::string joined_parts(const Parts& parts, std::size_t from) {
  std::string text;
  for (std::size_t i = from; i < parts.size(); ++i) text += (text.empty() ? "" : "_") + parts[i];
  return text;
}

std::vector<std::string> distinct_ids(const std::vector<std::string>& pictures, NamedBy by) {
  std::vector<Parts> parts;
  std::size_t deepest = 1;
  for (const std::string& picture : pictures) {
    parts.push_back(parts_of(picture));
    deepest = std::max(deepest, parts.back().size());
  }
  std::vector<std::string> ids;
  const auto try_part = [&](std::size_t at) {
    if (!ids.empty()) return;
    ids = ids_by(pictures, parts,
                 [at](const Parts& p) { return p.empty() ? std::string() : p[std::min(at, p.size() - 1)]; });
  };
  if (by == NamedBy::picture) try_part(deepest);
  for (std::size_t at = 0; at < deepest; ++at) try_part(at);
  std::size_t common = 0;  // folders that all share
  const auto shared = [&](const Parts& p) {
    return p.size() > common + 1 && p[common] == parts.front()[common];
  };
  while (!parts.empty() && std::all_of(parts.begin(), parts.end(), shared)) ++common;
  if (ids.empty()) ids = ids_by(pictures, parts, [&](const Parts& p) { return joined_parts(p, common); });
  return ids.empty() ? pictures : ids;  // pictures differ by their extension only
}

/// The name with characters that an id can hold.
std::string allowed_id(const std::string& name) {
  constexpr std::size_t kLongest = 180;  // leaves space for a number within the 200 of an id
  if (name.empty()) return name;
  std::string id;
  for (const char c : name.substr(0, kLongest)) {
    const bool allowed = session::is_folder_name(std::string(id.empty() ? "" : "a") + c);
    if (allowed || !id.ends_with('_')) id += allowed ? c : '_';
  }
  while (id.size() > 1 && id.ends_with('_') && !name.ends_with('_')) id.pop_back();
  return id;
}

}  // namespace

std::vector<std::string> camera_ids(const std::vector<std::string>& pictures, NamedBy by,
                                    ImportNotes* notes) {
  const std::vector<std::string> names = distinct_ids(pictures, by);
  std::map<std::string, std::string> id_of;  // by name
  std::set<std::string> taken;
  for (const std::string& name : names)
    if (allowed_id(name) == name && id_of.try_emplace(name, name).second) taken.insert(name);
  std::vector<std::string> renamed;
  std::vector<std::string> ids;
  for (const std::string& name : names) {
    const auto [entry, first] = id_of.try_emplace(name);
    if (first) {
      std::string id = allowed_id(name);
      for (int n = 2; !taken.insert(id).second; ++n) id = fmt::format("{}-{}", allowed_id(name), n);
      entry->second = id;
      renamed.push_back(fmt::format("\"{}\" for {}", id, name));
    }
    ids.push_back(entry->second);
  }
  if (notes == nullptr || renamed.empty()) return ids;
  constexpr std::size_t kNamed = 3;
  std::string list;
  for (std::size_t i = 0; i < std::min(kNamed, renamed.size()); ++i) list += (i > 0 ? ", " : "") + renamed[i];
  if (renamed.size() > kNamed) list += fmt::format(" and {} more", renamed.size() - kNamed);
  notes->push_back("camera ids were made of names with characters that an id can't hold: " + list);
  return ids;
}

}  // namespace emberlock::recon
