// SPDX-License-Identifier: Apache-2.0
#include "base/output_folder.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <random>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "base/file.h"
#include "base/log.h"
#include "base/output_leftovers.h"
#include "base/output_survey.h"
#include "base/result_list.h"
#include "base/sha256.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

Result<fs::path> make_hidden(const fs::path& target) {
  std::random_device random;
  for (int i = 0; i < 100; ++i) {
    fs::path folder = target.parent_path() / fmt::format("{}{:08x}", hidden_prefix(target), random());
    if (::mkdir(folder.c_str(), 0777) == 0) return folder;
    if (errno != EEXIST) break;
  }
  return refused_by_system(target, "cannot create the folder", "Check that its parent is writable");
}

Status write_list(const fs::path& folder, const ResultList& list) {
  return write_file_atomically(folder / kResultList, result_list_text(list));
}

/// Whether the file system allows hard links from kept files into the new folder.
Status try_links(const Survey& found, const fs::path& target, const fs::path& staging) {
  const fs::path probe = staging / ".probe";
  for (const Kept& kept : found.kept) {
    if (kept.folder) continue;
    if (::linkat(AT_FDCWD, (target / kept.path).c_str(), AT_FDCWD, probe.c_str(), 0) != 0) {
      Error error = refused_by_system(target / kept.path, "isn't Emberlock's and can't be carried over",
                                      "Move it away, or name a new folder");
      error.kind = ErrorKind::bad_input;
      return error;
    }
    ::unlink(probe.c_str());
  }
  return {};
}

/// The new folder's files, and its subfolders with the deepest last.
struct Contents {
  std::vector<ListedFile> files;
  std::vector<fs::path> folders;
};

Result<Contents> contents_of(const fs::path& staging, const std::string& verb) {
  Contents contents;
  contents.folders.push_back(staging);
  std::error_code ec;
  fs::recursive_directory_iterator at(staging, ec);
  for (const fs::recursive_directory_iterator end; !ec && at != end; at.increment(ec)) {
    struct stat info {};
    if (::lstat(at->path().c_str(), &info) != 0) return refused_by_system(at->path(), "cannot look at it");
    if (S_ISDIR(info.st_mode)) contents.folders.push_back(at->path());
    const std::string name = at->path().lexically_relative(staging).string();
    if (!S_ISREG(info.st_mode) || name == kResultList) continue;
    contents.files.push_back(listed_as(name, verb, info));
    if (verb.empty()) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(const FileHash hash, hash_file(at->path()));
    contents.files.back().sha256 = hash.sha256;
  }
  if (ec) return Error{ErrorKind::io, "cannot read the folder: " + ec.message(), staging.string()};
  std::sort(contents.files.begin(), contents.files.end(),
            [](const ListedFile& x, const ListedFile& y) { return x.path < y.path; });
  return contents;
}

/// Starts the write-back of all files before it waits for the first, so that the disk can order the writes.
Status flush(const fs::path& staging, const Contents& contents) {
  std::vector<fs::path> paths;
  for (const ListedFile& file : contents.files) paths.push_back(staging / file.path);
  for (const fs::path& path : paths) {
    const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
    if (fd) ::sync_file_range(fd.get(), 0, 0, SYNC_FILE_RANGE_WRITE);
  }
  for (const fs::path& path : paths) {
    const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
    if (!fd || ::fsync(fd.get()) != 0) return refused_by_system(path, "cannot flush");
  }
  for (auto folder = contents.folders.rbegin(); folder != contents.folders.rend(); ++folder)
    EMBERLOCK_RETURN_IF_ERROR(sync_folder(*folder));
  return {};
}

Status flush_folders(const fs::path& staging) {
  EMBERLOCK_ASSIGN_OR_RETURN(Contents contents, contents_of(staging, ""));
  contents.files.clear();
  return flush(staging, contents);
}

/// Creates a folder with the mode of `model`.
Status make_like(const fs::path& model, const fs::path& folder) {
  struct stat info {};
  if (::mkdir(folder.c_str(), 0777) != 0)
    return errno == EEXIST ? Status() : Status(refused_by_system(folder, "cannot create"));
  if (::stat(model.c_str(), &info) == 0) ::chmod(folder.c_str(), info.st_mode & 07777);
  return {};
}

/// Links the kept files into the new folder: all of them, or none.
class Carrier {
 public:
  Carrier(const fs::path& target, const fs::path& staging) : target_(target), staging_(staging) {}

  Status carry(const Survey& found, ResultList& list) {
    for (const Kept& kept : found.kept) {
      if (is_there(staging_ / kept.path))
        continue;  // conflict() allowed it: the new file replaces the kept one
      if (Status done = carry(kept); !done.ok()) {
        for (const fs::path& link : made_) ::unlink(link.c_str());
        return done;
      }
      if (kept.listed) list.files.push_back(*kept.listed);
    }
    return {};
  }

 private:
  Status carry(const Kept& kept) {
    fs::path within;
    const fs::path folders = kept.folder ? fs::path(kept.path) : fs::path(kept.path).parent_path();
    for (const fs::path& part : folders) {
      within /= part;
      EMBERLOCK_RETURN_IF_ERROR(make_like(target_ / within, staging_ / within));
    }
    if (kept.folder) return {};
    made_.push_back(staging_ / kept.path);
    if (::linkat(AT_FDCWD, (target_ / kept.path).c_str(), AT_FDCWD, made_.back().c_str(), 0) == 0) return {};
    const Error error = refused_by_system(target_ / kept.path, "isn't Emberlock's and can't be carried over",
                                          "Move it away, or name a new folder");
    made_.pop_back();
    return error;
  }

  const fs::path& target_;
  const fs::path& staging_;
  std::vector<fs::path> made_;
};

Error cannot_move(const fs::path& target) {
  return refused_by_system(target, "cannot move the result into place",
                           "Check that the folder's parent is writable");
}

/// Puts `staging` in the place of an earlier result. Returns the path to which the earlier result moved.
Result<fs::path> exchange(const fs::path& staging, const fs::path& target, Replace how) {
  if (how == Replace::at_once) {
    if (::renameat2(AT_FDCWD, staging.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) == 0)
      return staging;
    if (errno != EINVAL && errno != ENOSYS && errno != EOPNOTSUPP) return cannot_move(target);
  }
  const fs::path earlier = earlier_of(target);
  if (is_there(earlier)) {
    return Error{ErrorKind::bad_input, "is in the way", earlier.string(),
                 "Move it away, or name a new folder"};
  }
  if (::rename(target.c_str(), earlier.c_str()) != 0) return cannot_move(target);
  if (::rename(staging.c_str(), target.c_str()) == 0) return earlier;
  const Error error = cannot_move(target);
  ::rename(earlier.c_str(), target.c_str());
  return error;
}

/// Renames `folder` to the first free name among NAME, NAME-2, NAME-3, ...
Result<fs::path> give_free_name(const fs::path& folder, const fs::path& name) {
  for (int i = 1; i < 10'000; ++i) {
    fs::path free = name;
    if (i > 1) free += "-" + std::to_string(i);
    if (::renameat2(AT_FDCWD, folder.c_str(), AT_FDCWD, free.c_str(), RENAME_NOREPLACE) == 0) return free;
    if ((errno == EINVAL || errno == ENOSYS) && !is_there(free) &&
        ::rename(folder.c_str(), free.c_str()) == 0)
      return free;
    if (!is_there(free)) break;
  }
  return refused_by_system(folder, "cannot be renamed");
}

/// Whether `path` is `folder` or lies in it.
bool lies_in(const fs::path& path, const fs::path& folder) {
  std::error_code ec;
  for (fs::path at = path;; at = at.parent_path()) {
    if (fs::equivalent(at, folder, ec) && !ec) return true;
    if (at == at.parent_path()) return false;
  }
}

/// A mount point can't be replaced by another folder.
Status check_not_mounted(const fs::path& target) {
  struct statx info {};
  struct statx parent {};
  if (::statx(AT_FDCWD, target.c_str(), AT_SYMLINK_NOFOLLOW, STATX_BASIC_STATS, &info) != 0 ||
      ::statx(AT_FDCWD, target.parent_path().c_str(), 0, STATX_BASIC_STATS, &parent) != 0)
    return {};
  const bool told = (info.stx_attributes_mask & STATX_ATTR_MOUNT_ROOT) != 0;
  const bool other_device =
      info.stx_dev_major != parent.stx_dev_major || info.stx_dev_minor != parent.stx_dev_minor;
  if (!(told ? (info.stx_attributes & STATX_ATTR_MOUNT_ROOT) != 0 : other_device)) return {};
  return Error{ErrorKind::bad_input,
               "is where a disk or folder is mounted, so that no result can take its place", target.string(),
               "Name a folder within it: " + (target / "result").string()};
}

/// Copies the owner (where allowed) and the mode of `target`; the owner can always write.
void take_after(const fs::path& target, const fs::path& staging) {
  struct stat info {};
  if (::stat(target.c_str(), &info) != 0) return;
  if (::chown(staging.c_str(), info.st_uid, info.st_gid) != 0)
    static_cast<void>(::chown(staging.c_str(), static_cast<uid_t>(-1), info.st_gid) == 0);
  ::chmod(staging.c_str(), (info.st_mode & 07777) | S_IRWXU);  // after chown, which clears mode bits
}

}  // namespace

Status check_apart(const fs::path& target, const std::vector<fs::path>& inputs) {
  EMBERLOCK_ASSIGN_OR_RETURN(const fs::path resolved, resolve_target(target));
  for (const fs::path& input : inputs) {
    std::error_code ec;
    const fs::path real = fs::canonical(input, ec);
    if (ec) continue;  // the step that reads it reports the error
    const char* remedy = "Name a folder apart from what is read";
    if (lies_in(real, resolved))
      return Error{ErrorKind::bad_input, "lies in the folder that is to be written, " + target.string(),
                   input.string(), remedy};
    if (fs::is_directory(real, ec) && lies_in(resolved, real))
      return Error{ErrorKind::bad_input, "lies in a folder that is read, " + input.string(), target.string(),
                   remedy};
  }
  return {};
}

Status check_new_folder(const fs::path& folder) {
  std::error_code ec;
  if (!is_there(folder) || (fs::is_directory(folder, ec) && fs::is_empty(folder, ec) && !ec)) return {};
  return Error{ErrorKind::bad_input, "exists already and is not an empty folder", folder.string(),
               "Name a new folder"};
}

bool remove_ours(const fs::path& folder,
                 const std::function<bool(const std::string& path, const struct stat& info)>& ours) {
  std::error_code ec;
  std::vector<fs::path> folders{folder};
  bool all = fs::is_directory(fs::symlink_status(folder, ec));
  fs::recursive_directory_iterator at(folder, ec);
  std::vector<fs::path> files;
  for (const fs::recursive_directory_iterator end; all && !ec && at != end; at.increment(ec)) {
    struct stat info {};
    if (::lstat(at->path().c_str(), &info) != 0) return false;
    if (S_ISDIR(info.st_mode)) {
      folders.push_back(at->path());
    } else if (ours(at->path().lexically_relative(folder).string(), info)) {
      files.push_back(at->path());
    }
  }
  for (const fs::path& file : files) ::unlink(file.c_str());
  for (auto empty = folders.rbegin(); empty != folders.rend(); ++empty) all = ::rmdir(empty->c_str()) == 0;
  return all;
}

Result<MadeFolders> MadeFolders::create(const fs::path& folder) {
  MadeFolders made;
  std::vector<fs::path> absent;
  for (fs::path at = folder; !is_there(at); at = at.parent_path()) absent.push_back(at);
  for (auto next = absent.rbegin(); next != absent.rend(); ++next) {
    if (::mkdir(next->c_str(), 0777) == 0) {
      made.made_.push_back(*next);
    } else if (errno != EEXIST) {
      return refused_by_system(*next, "cannot create the folder", "Check that its parent is writable");
    }
  }
  return made;
}

MadeFolders& MadeFolders::operator=(MadeFolders&& o) noexcept {
  std::swap(made_, o.made_);
  return *this;
}

MadeFolders::~MadeFolders() {
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) ::rmdir(folder->c_str());
}

Status OutputFolder::check(const OutputRequest& request) {
  // Creating the hidden folder and removing it again makes exactly the checks of a real run.
  const auto probe = create(request);
  return probe ? Status() : Status(probe.error());
}

Result<OutputFolder> OutputFolder::create(const OutputRequest& asked) {
  OutputRequest request = asked;
  EMBERLOCK_ASSIGN_OR_RETURN(request.target, resolve_target(asked.target));
  const fs::path& target = request.target;
  EMBERLOCK_RETURN_IF_ERROR(check_apart(target, request.inputs));
  OutputFolder folder(request);
  EMBERLOCK_ASSIGN_OR_RETURN(folder.parents_, MadeFolders::create(target.parent_path()));
  EMBERLOCK_RETURN_IF_ERROR(check_not_mounted(target));
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd parent, lock_folder(target.parent_path()));
  EMBERLOCK_RETURN_IF_ERROR(clean_up(target));
  EMBERLOCK_ASSIGN_OR_RETURN(const Survey found, survey(target, request.verb));
  for (const fs::path& input : request.updated) {
    std::error_code ec;
    const fs::path real = fs::weakly_canonical(input, ec);
    const std::string name = real.lexically_relative(target).string();
    const auto known = [&](const std::string& path) { return path == name; };
    const bool ours = std::any_of(found.replaced.begin(), found.replaced.end(), known) ||
                      std::any_of(found.kept.begin(), found.kept.end(),
                                  [&](const Kept& kept) { return kept.listed && known(kept.path); });
    if (!ours) EMBERLOCK_RETURN_IF_ERROR(check_apart(target, {input}));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(folder.staging_, make_hidden(target));
  take_after(target, folder.staging_);
  EMBERLOCK_RETURN_IF_ERROR(write_list(folder.staging_, {{}, false}));
  folder.lock_ = lock_list(folder.staging_);
  if (!folder.lock_) return refused_by_system(folder.staging_, "cannot lock the folder");
  EMBERLOCK_RETURN_IF_ERROR(try_links(found, target, folder.staging_));
  return folder;
}

OutputFolder::OutputFolder(OutputFolder&& o) noexcept
    : request_(std::move(o.request_)),
      staging_(std::exchange(o.staging_, {})),
      parents_(std::move(o.parents_)),
      lock_(std::move(o.lock_)) {}

OutputFolder::~OutputFolder() {
  std::error_code ec;
  if (!staging_.empty()) fs::remove_all(staging_, ec);
}

Status OutputFolder::commit() {
  const fs::path& target = request_.target;
  // The slow part comes before the lock, because others wait for the lock.
  EMBERLOCK_ASSIGN_OR_RETURN(const Contents contents, contents_of(staging_, std::string(request_.verb.name)));
  EMBERLOCK_RETURN_IF_ERROR(flush(staging_, contents));
  const auto parent = lock_folder(target.parent_path());
  ResultList list{contents.files, true};
  Survey found;
  Status moves = parent ? look_again(found) : Status(parent.error());
  if (moves.ok()) moves = Carrier(target, staging_).carry(found, list);
  lock_ = UniqueFd();  // on the old list, which is replaced now: over NFS an open handle would keep that file
                       // alive
  // The result is complete and on the disk. From here on no failure loses it.
  parents_.keep();
  if (const Status listed = write_list(staging_, list); !listed.ok()) moves = listed;
  if (moves.ok()) moves = flush_folders(staging_);
  fs::path old;
  if (moves.ok() && found.earlier) {
    auto place = exchange(staging_, target, request_.replace);
    if (place) {
      old = *std::move(place);
    } else {
      moves = place.error();
    }
  } else if (moves.ok() && ::rename(staging_.c_str(), target.c_str()) != 0) {
    moves = cannot_move(target);
  }
  if (!moves.ok()) return leave_beside(moves.error());
  staging_.clear();
  if (const Status flushed = sync_folder(target.parent_path()); !flushed.ok())
    log(LogCategory::base)
        .warn("{} is complete, but a power cut may undo it: {}", target.string(), flushed.error().message());
  if (!old.empty() && !discard(old, target)) {
    fs::path kept = target;
    kept += ".kept";
    const auto name = give_free_name(old, kept);
    log(LogCategory::base)
        .warn("{} came to hold other files while it was replaced: they are kept in {}", target.string(),
              (name ? *name : old).string());
  }
  return {};
}

Status OutputFolder::look_again(Survey& found) const {
  EMBERLOCK_ASSIGN_OR_RETURN(found, survey(request_.target, request_.verb));
  if (auto error = conflict(found, staging_, request_.target)) return *std::move(error);
  return {};
}

Error OutputFolder::leave_beside(Error why) {
  fs::path beside = request_.target;
  beside += ".new";
  const auto name = give_free_name(staging_, beside);
  // A hidden folder without its list is never cleared away.
  if (!name) ::unlink((staging_ / kResultList).c_str());
  why.what += "; the result is complete in " + (name ? *name : staging_).string();
  staging_.clear();
  return why;
}

}  // namespace emberlock
