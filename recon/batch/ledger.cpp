// SPDX-License-Identifier: Apache-2.0
#include "recon/batch/ledger.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

#include <fcntl.h>

#include "base/file.h"
#include "base/unique_fd.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlan = "plan.json";

Error io_error(const std::string& doing, const fs::path& path, int error) {
  return {ErrorKind::io, doing + ": " + std::strerror(error), path.string(),
          error == ENOSPC ? "Make room on the disk; the same command goes on where it ended" : ""};
}

enum class Moved { yes, absent, occupied };

/// One rename. `absent`: somebody else moved it away before.
Result<Moved> move(const fs::path& from, const fs::path& to) {
  if (std::rename(from.c_str(), to.c_str()) == 0) return Moved::yes;
  const int error = errno;
  if (error == ENOTEMPTY || error == EEXIST) return Moved::occupied;
  if (error == ENOENT) return Moved::absent;
  return io_error("can't become " + to.string(), from, error);
}

/// To a name that nobody else gives. A file server that answers a repeated request says `absent` of what it
/// has moved: then it is there.
Result<Moved> move_to_own(const fs::path& from, const fs::path& to) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Moved moved, move(from, to));
  std::error_code ec;
  return moved == Moved::absent && fs::exists(to, ec) ? Moved::yes : moved;
}

Status put_empty_file(const fs::path& path) {
  const UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666));
  if (fd.get() < 0) return io_error("can't be created", path, errno);
  return {};
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ec;
  for (fs::directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec))
    names.push_back(it->path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

/// CHUNK and WORKER of "CHUNK.WORKER".
std::pair<std::string, std::string> parts_of(const std::string& name) {
  const std::size_t dot = name.find('.');
  if (dot == std::string::npos) return {name, ""};
  return {name.substr(0, dot), name.substr(dot + 1)};
}

Status make_folders(const fs::path& folder) {
  std::error_code ec;
  for (const char* part : {"", "todo", "claims", "work", "partial", "done", "lost", "given_up", "workers"}) {
    fs::create_directory(folder / part, ec);
    if (ec) return io_error("can't be created", folder / part, ec.value());
  }
  return {};
}

Status fill(const fs::path& folder, const std::string& plan, const std::vector<std::string>& chunks) {
  EMBERLOCK_RETURN_IF_ERROR(make_folders(folder));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / kPlan, plan));
  for (const std::string& chunk : chunks) {
    EMBERLOCK_RETURN_IF_ERROR(put_empty_file(folder / "todo" / chunk));
  }
  return sync_folder(folder / "todo");
}

}  // namespace

Status Ledger::create(const fs::path& folder, const std::string& worker, const std::string& plan,
                      const std::vector<std::string>& chunks) {
  const fs::path made = folder.parent_path() / ("." + folder.filename().string() + "." + worker);
  Status filled = fill(made, plan, chunks);
  if (filled.ok()) {
    const Result<Moved> moved = move(made, folder);
    if (!moved) filled = moved.error();
    if (moved && *moved == Moved::yes) return sync_folder(folder.parent_path());
  }
  std::error_code ec;
  fs::remove_all(made, ec);
  return filled;
}

Result<std::optional<std::string>> Ledger::read_plan(const fs::path& folder) {
  std::error_code ec;
  if (!fs::exists(folder / kPlan, ec)) return std::optional<std::string>();
  EMBERLOCK_ASSIGN_OR_RETURN(std::string text, read_file(folder / kPlan));
  return std::optional(std::move(text));
}

Result<std::optional<Ledger::Claim>> Ledger::take(const LifeOf& life_of, std::size_t place) {
  std::vector<std::string> todo = names_in(folder_ / "todo");
  if (!todo.empty())
    std::rotate(todo.begin(), todo.begin() + static_cast<std::ptrdiff_t>(place % todo.size()), todo.end());
  for (const std::string& chunk : todo) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Moved moved,
                               move_to_own(folder_ / "todo" / chunk, folder_ / "claims" / mine(chunk)));
    if (moved != Moved::yes) continue;
    if (!done(chunk)) return begin({chunk, folder_ / "work" / mine(chunk)}, folder_ / "partial" / chunk);
    EMBERLOCK_RETURN_IF_ERROR(drop(chunk));  // one who was taken for dead has finished it
  }
  for (const std::string& name : names_in(folder_ / "claims")) {
    const auto [chunk, owner] = parts_of(name);
    const Life life = owner == worker_ ? Life::alive : life_of(owner);
    if (life == Life::alive) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(std::optional<Claim> claim, take_from(chunk, owner, life));
    if (claim) return claim;
  }
  return std::optional<Claim>();
}

Result<std::optional<Ledger::Claim>> Ledger::take_from(const std::string& chunk, const std::string& owner,
                                                       Life life) {
  const std::string theirs = chunk + "." + owner;
  const fs::path claimed = folder_ / "claims" / theirs;
  if (done(chunk)) {  // it died, or somebody else was first, between its result and its claim
    std::error_code ec;
    fs::remove(claimed, ec);
    return std::optional<Claim>();
  }
  const std::vector<std::string> lost = losses();
  const auto died = 1 + std::count_if(lost.begin(), lost.end(),
                                      [&](const std::string& name) { return parts_of(name).first == chunk; });
  const bool gives_up = static_cast<std::size_t>(died) >= kMostLosses;
  EMBERLOCK_ASSIGN_OR_RETURN(
      const Moved moved,
      move_to_own(claimed, gives_up ? folder_ / "given_up" / chunk : folder_ / "claims" / mine(chunk)));
  if (moved != Moved::yes) return std::optional<Claim>();
  EMBERLOCK_RETURN_IF_ERROR(put_empty_file(folder_ / "lost" / theirs));
  if (gives_up) return std::optional<Claim>();
  std::error_code ec;
  fs::path left = folder_ / "partial" / chunk;  // of one who died giving it back
  if (!fs::exists(left, ec)) left = folder_ / "work" / theirs;
  if (life == Life::silent) left.clear();  // it may still write there
  return begin({chunk, folder_ / "work" / mine(chunk), owner}, left);
}

/// With what is left of an earlier attempt, if anything is.
Result<std::optional<Ledger::Claim>> Ledger::begin(Claim claim, const fs::path& left) {
  const auto begun = [&]() -> Status {
    EMBERLOCK_ASSIGN_OR_RETURN(const Moved moved,
                               left.empty() ? Moved::absent : move_to_own(left, claim.work));
    if (moved == Moved::yes) return {};
    std::error_code ec;
    fs::create_directory(claim.work, ec);
    if (ec) return io_error("can't be created", claim.work, ec.value());
    return {};
  }();
  if (begun.ok()) return std::optional(std::move(claim));
  (void)give_back(claim);  // as far as that can be; what came first is told
  return begun.error();
}

Status Ledger::drop(const std::string& chunk) const {
  std::error_code ec;
  fs::remove(folder_ / "claims" / mine(chunk), ec);
  if (ec) return io_error("can't be removed", folder_ / "claims" / mine(chunk), ec.value());
  return {};
}

Result<bool> Ledger::finish(const Claim& claim) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Moved moved, move(claim.work, result(claim.chunk)));
  if (moved == Moved::yes) {
    EMBERLOCK_RETURN_IF_ERROR(sync_folder(folder_ / "done"));
  } else {
    std::error_code ec;
    fs::remove_all(claim.work, ec);
  }
  EMBERLOCK_RETURN_IF_ERROR(drop(claim.chunk));
  return moved == Moved::yes;
}

void Ledger::empty(const Claim& claim) {
  std::error_code ec;
  for (const std::string& name : names_in(claim.work)) fs::remove_all(claim.work / name, ec);
}

Status Ledger::give_back(const Claim& claim) {
  const Result<Moved> kept = move(claim.work, folder_ / "partial" / claim.chunk);
  if (kept && *kept == Moved::occupied) {
    std::error_code ec;
    fs::remove_all(claim.work, ec);
  }
  EMBERLOCK_ASSIGN_OR_RETURN([[maybe_unused]] const Moved moved,
                             move(folder_ / "claims" / mine(claim.chunk), folder_ / "todo" / claim.chunk));
  return kept ? Status() : Status(kept.error());
}

Status Ledger::reopen(const std::string& chunk) {
  std::error_code ec;
  for (const std::string& name : losses())
    if (parts_of(name).first == chunk) fs::remove(folder_ / "lost" / name, ec);
  if (given_up(chunk)) {
    EMBERLOCK_ASSIGN_OR_RETURN([[maybe_unused]] const Moved moved,
                               move(folder_ / "given_up" / chunk, folder_ / "todo" / chunk));
    return {};
  }
  // Claimed first: the chunk is in someone's hands while its result moves.
  EMBERLOCK_RETURN_IF_ERROR(put_empty_file(folder_ / "claims" / mine(chunk)));
  EMBERLOCK_ASSIGN_OR_RETURN(const Moved moved, move(result(chunk), folder_ / "work" / mine(chunk)));
  if (moved != Moved::yes) return drop(chunk);      // by another run's first rank
  fs::remove_all(folder_ / "partial" / chunk, ec);  // of an attempt that came second
  fs::remove(folder_ / "given_up" / chunk, ec);     // before one that was taken for dead had done it
  return give_back({chunk, folder_ / "work" / mine(chunk)});
}

Status Ledger::restore_folders() const { return make_folders(folder_); }

Result<std::vector<std::string>> Ledger::restore_missing() const {
  EMBERLOCK_RETURN_IF_ERROR(restore_folders());
  std::set<std::string> found;
  // Claims twice, as a chunk may move to todo and back meanwhile. One that is missed all the same is done
  // twice, which harms nothing.
  for (const char* where : {"claims", "todo", "claims", "done", "given_up"})
    for (const std::string& name : names_in(folder_ / where)) found.insert(parts_of(name).first);
  std::vector<std::string> missing;
  for (const std::string& chunk : chunks_) {
    if (found.contains(chunk)) continue;
    EMBERLOCK_RETURN_IF_ERROR(put_empty_file(folder_ / "todo" / chunk));
    missing.push_back(chunk);
  }
  return missing;
}

bool Ledger::done(const std::string& chunk) const {
  std::error_code ec;
  return fs::exists(result(chunk), ec);
}

bool Ledger::given_up(const std::string& chunk) const {
  std::error_code ec;
  return fs::exists(folder_ / "given_up" / chunk, ec) && !done(chunk);
}

bool Ledger::settled() const {
  std::vector<std::string> found = names_in(folder_ / "done");  // two requests, however many chunks there are
  for (std::string& name : names_in(folder_ / "given_up")) found.push_back(std::move(name));
  const std::set<std::string> settled(found.begin(), found.end());
  return std::all_of(chunks_.begin(), chunks_.end(),
                     [&](const std::string& chunk) { return settled.contains(chunk); });
}

std::vector<fs::path> Ledger::unfinished() const {
  std::vector<fs::path> folders;
  for (const char* where : {"work", "partial"})
    for (const std::string& name : names_in(folder_ / where)) folders.push_back(folder_ / where / name);
  return folders;
}

std::vector<std::string> Ledger::losses() const { return names_in(folder_ / "lost"); }

void Ledger::forget_losses() const {
  std::error_code ec;
  for (const std::string& name : losses()) fs::remove(folder_ / "lost" / name, ec);
}

void Ledger::tidy() const {
  std::error_code ec;
  for (const fs::path& folder : unfinished()) fs::remove_all(folder, ec);
}

}  // namespace emberlock::recon
