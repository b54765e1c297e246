// SPDX-License-Identifier: Apache-2.0
#include "base/output_survey.h"

#include <algorithm>
#include <cerrno>
#include <map>
#include <set>
#include <system_error>

#include <sys/stat.h>

namespace emberlock {
namespace fs = std::filesystem;
namespace {

constexpr const char* kRemedy = "Name a new folder, or move this one away";

Error in_the_way(const fs::path& path, std::string what, std::string remedy = kRemedy) {
  return {ErrorKind::bad_input, std::move(what), path.string(), std::move(remedy)};
}

Error cannot(const fs::path& path, const std::string& action, int code) {
  return {ErrorKind::io, action + ": " + std::generic_category().message(code), path.string(),
          "Check the folder's permissions, or name a new one"};
}

/// Compares the contents of a target with its list.
class Surveyor {
 public:
  Surveyor(fs::path target, const OutputVerb& verb, const struct stat& root)
      : target_(std::move(target)), verb_(verb), device_(root.st_dev) {}

  Result<Survey> run() {
    std::error_code ec;
    if (fs::is_empty(target_, ec) && !ec) return Survey{};
    if (ec) return cannot(target_, "cannot read the folder", ec.value());
    EMBERLOCK_RETURN_IF_ERROR(read_list());
    fs::recursive_directory_iterator at(target_, ec);
    for (const fs::recursive_directory_iterator end; !ec && at != end; at.increment(ec))
      EMBERLOCK_RETURN_IF_ERROR(look_at(at->path()));
    if (ec) return cannot(target_, "cannot read the folder", ec.value());
    for (const std::string& folder : folders_)
      if (!holds_.contains(folder)) found_.kept.push_back({folder, true, std::nullopt});
    found_.earlier = true;
    return std::move(found_);
  }

 private:
  Status read_list() {
    const auto list = read_result_list(target_);
    if (!list || !list->finished) {
      return in_the_way(target_, "holds files, and no list of an earlier result's (" +
                                     std::string(kResultList) + "), so that nothing in it may be replaced");
    }
    for (const ListedFile& file : list->files) {
      if (!is_own(file) && !may_lie_beside(file)) {
        return in_the_way(target_, "is a result of `emberlock " + file.verb + "`, which `emberlock " +
                                       std::string(verb_.name) + "` doesn't replace");
      }
      listed_.emplace(file.path, file);
      for (fs::path up = fs::path(file.path).parent_path(); !up.empty(); up = up.parent_path())
        holds_.insert(up.string());
    }
    ours_ = holds_;
    return {};
  }

  Status look_at(const fs::path& path) {
    std::string name = path.lexically_relative(target_).string();
    struct stat info {};
    if (::lstat(path.c_str(), &info) != 0) return cannot(path, "cannot look at it", errno);
    for (fs::path up = fs::path(name).parent_path(); !up.empty(); up = up.parent_path())
      holds_.insert(up.string());
    if (S_ISDIR(info.st_mode)) {
      if (info.st_dev != device_) return in_the_way(path, "is another file system, mounted there");
      if (listed_.contains(name)) return changed(path);
      folders_.push_back(std::move(name));
      return {};
    }
    if (name == kResultList) return {};
    const auto known = listed_.find(name);
    if (known == listed_.end()) {
      if (ours_.contains(name)) return changed(path);
      found_.kept.push_back({std::move(name), false, std::nullopt});
      return {};
    }
    const bool unchanged = is_unchanged(known->second, path, info);
    if (is_own(known->second)) {
      if (!unchanged) return known->second.sha256.empty() ? of_another_time(path) : changed(path);
      found_.replaced.push_back(std::move(name));
    } else {
      found_.kept.push_back(
          {std::move(name), false, unchanged ? std::optional(known->second) : std::nullopt});
    }
    return {};
  }

  static Error changed(const fs::path& path) {
    return in_the_way(path, "was changed since Emberlock made it, so it isn't replaced",
                      "Move it away, or name a new folder");
  }
  static Error of_another_time(const fs::path& path) {
    return in_the_way(path,
                      "has another size or time than in the list of Emberlock's files, so it isn't replaced",
                      "Move it away, or name a new folder");
  }
  [[nodiscard]] bool is_own(const ListedFile& file) const { return file.verb == verb_.name; }
  [[nodiscard]] bool may_lie_beside(const ListedFile& file) const {
    return std::find(verb_.beside.begin(), verb_.beside.end(), file.verb) != verb_.beside.end();
  }

  fs::path target_;
  const OutputVerb& verb_;
  dev_t device_;
  std::map<std::string, ListedFile> listed_;
  std::set<std::string> ours_;   // folders that hold listed files
  std::set<std::string> holds_;  // folders that hold anything
  std::vector<std::string> folders_;
  Survey found_;
};

}  // namespace

Result<fs::path> resolve_target(const fs::path& target) {
  std::error_code ec;
  fs::path resolved = target.empty() ? target : fs::weakly_canonical(fs::absolute(target, ec), ec);
  if (resolved.filename().empty()) resolved = resolved.parent_path();
  if (ec || resolved.filename().empty()) {
    return in_the_way(target, ec ? "can't name a folder: " + ec.message() : "can't name a folder",
                      "Name a new folder");
  }
  return resolved;
}

Result<Survey> survey(const fs::path& target, const OutputVerb& verb) {
  struct stat info {};
  if (::lstat(target.c_str(), &info) != 0) {
    if (errno == ENOENT) return Survey{};
    return cannot(target, "cannot look at it", errno);
  }
  if (!S_ISDIR(info.st_mode)) return in_the_way(target, "exists and is no folder", "Name a new folder");
  return Surveyor(target, verb, info).run();
}

std::optional<Error> conflict(const Survey& survey, const fs::path& staging, const fs::path& target) {
  for (const Kept& kept : survey.kept) {
    std::error_code ec;
    const auto there = fs::symlink_status(staging / kept.path, ec);
    const bool free = !fs::exists(there) || (kept.folder ? fs::is_directory(there) : kept.listed.has_value());
    bool reachable = true;
    for (fs::path up = fs::path(kept.path).parent_path(); !up.empty(); up = up.parent_path()) {
      const auto folder = fs::symlink_status(staging / up, ec);
      reachable = reachable && (!fs::exists(folder) || fs::is_directory(folder));
    }
    if (!free || !reachable)
      return in_the_way(target / kept.path, "isn't Emberlock's, and the result has one of its name",
                        "Move it away, or name a new folder");
  }
  return std::nullopt;
}

}  // namespace emberlock
