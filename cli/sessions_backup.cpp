// SPDX-License-Identifier: Apache-2.0
#include "cli/sessions_backup.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <ratio>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "session/backup.h"
#include "session/files.h"
#include "session/reader.h"
#include "session/store.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

struct BackupArguments {
  std::string folder;
  std::string backups;
  bool compare = false;
  std::optional<double> older_than_days;
  std::optional<double> free_gb;
  bool yes = false;
};

Observer watched(const std::string& title) {
  return [bar = progress_bar(title)](double fraction, std::string_view what) {
    bar(fraction, what);
    return !Interrupt::asked();
  };
}

/// By the clock of the machine that wrote it last: a camera's may be years off. Now, where that can't be
/// read.
fs::file_time_type last_written(const fs::path& session) {
  std::error_code ec;
  const fs::file_time_type time = fs::last_write_time(session::manifest_path(session), ec);
  return ec ? fs::file_time_type::clock::now() : time;
}

/// Sessions of a folder, those first that nothing has been written to for the longest time.
std::vector<fs::path> sessions_in_folder(const fs::path& folder) {
  if (!fs::is_directory(folder))
    fail({ErrorKind::bad_input, "no such folder", folder.string(),
          "Name a session, or the folder in which sessions lie"});
  std::vector<fs::path> found = session::sessions_in(folder);
  std::map<fs::path, fs::file_time_type> written;
  for (const fs::path& session : found) written[session] = last_written(session);
  std::stable_sort(found.begin(), found.end(),
                   [&](const fs::path& a, const fs::path& b) { return written[a] < written[b]; });
  return found;
}

const char* words_of(session::Backup::Outcome outcome) {
  switch (outcome) {
    case session::Backup::Outcome::copied:
      return "copied";
    case session::Backup::Outcome::renewed:
      return "renewed";
    case session::Backup::Outcome::kept:
      return "is there";
  }
  return "";
}

void tell_of(const std::string& name, const std::string& words) {
  std::printf("%-24s %s\n", name.c_str(), words.c_str());
}

void tell_of_error(const std::string& name, const Error& error) {
  std::fflush(stdout);
  std::fprintf(stderr, "%-24s %s\n", name.c_str(), error.message().c_str());
}

void backup(const BackupArguments& a) {
  const std::vector<fs::path> folders = session::SessionReader::is_session(a.folder)
                                            ? std::vector<fs::path>{a.folder}
                                            : sessions_in_folder(a.folder);
  const Interrupt interrupt;
  std::size_t failed = 0;
  for (const fs::path& folder : folders) {
    const std::string name = fs::absolute(folder).lexically_normal().filename().string();
    const auto compare = a.compare ? session::Compare::bytes : session::Compare::times;
    const auto done = session::back_up_session(folder, a.backups, compare, watched(name));
    if (!done) {
      ++failed;
      tell_of_error(name, done.error());
      if (Interrupt::asked()) break;
      continue;
    }
    tell_of(name, fmt::format("{:8} {} files, {:.1f} MB", words_of(done->outcome), done->files,
                              static_cast<double>(done->bytes) / 1e6));
  }
  if (folders.empty()) std::printf("No sessions.\n");
  if (failed > 0) throw Exit(1);
}

double days_since(fs::file_time_type time) {
  return std::chrono::duration<double, std::ratio<86400>>(fs::file_time_type::clock::now() - time).count();
}

/// Whether sessions have to go on, the next one of which is this.
bool is_wanted_gone(const BackupArguments& a, const fs::path& session, std::uint64_t freed) {
  if (a.older_than_days) return days_since(last_written(session)) > *a.older_than_days;
  std::error_code ec;
  const fs::space_info space = fs::space(a.folder, ec);
  if (ec) fail({ErrorKind::io, "cannot ask for free space: " + ec.message(), a.folder});
  return static_cast<double>(space.available + freed) < *a.free_gb * 1e9;
}

void prune(const BackupArguments& a) {
  const std::vector<fs::path> folders = sessions_in_folder(a.folder);
  const Interrupt interrupt;
  if (a.yes) session::finish_removals(a.folder);
  std::uint64_t freed = 0;  // that would have been
  std::size_t failed = 0;
  std::size_t gone = 0;
  for (const fs::path& folder : folders) {
    if (!is_wanted_gone(a, folder, freed)) break;
    const std::string name = folder.filename().string();
    const std::uint64_t bytes = session::bytes_below(folder);
    const double days = days_since(last_written(folder));
    const Status done =
        a.yes ? session::remove_backed_up(folder, a.backups, watched(name))
              : session::compare_copy(folder, fs::path(a.backups) / name, session::Compare::times);
    if (!done) {
      ++failed;
      tell_of_error(name, done.error());
      if (Interrupt::asked()) break;
      continue;
    }
    ++gone;
    if (!a.yes) freed += bytes;
    tell_of(name, fmt::format("{} {:.1f} MB, written {:.0f} days ago",
                              a.yes ? "removed" : "would go:", static_cast<double>(bytes) / 1e6, days));
  }
  if (gone == 0 && failed == 0) std::printf("Nothing to remove.\n");
  if (gone > 0 && !a.yes) std::printf("Nothing was removed: --yes does it.\n");
  if (failed > 0) throw Exit(1);
}

}  // namespace

void add_sessions_backup(const Verb& sessions) {
  auto a = std::make_shared<BackupArguments>();
  const Verb copy = sessions.add_verb(
      "backup",
      "Copies finished sessions to another folder, such as one on another disk: each appears there when it "
      "is whole, on the disk "
      "and read back. Those that are there already are left as they are; one that changed is copied anew.");
  copy.add_option("FOLDER", a->folder, "A session, or the folder in which sessions lie").require();
  copy.add_option("--to", a->backups, "Folder of the copies; made if it isn't there").require();
  copy.add_flag("--compare", a->compare,
                "Read the copies that are there and compare each byte [sizes and times]");
  copy.set_action([a] { backup(*a); });
  const Verb prune_verb =
      sessions.add_verb("prune",
                        "Removes the sessions that are the oldest on this machine and have a copy that "
                        "is the same, byte for byte. Says what it "
                        "would remove; --yes removes it.");
  prune_verb.add_option("FOLDER", a->folder, "The folder in which sessions lie").require();
  prune_verb.add_option("--backups", a->backups, "Folder of the copies, as `backup --to` made them")
      .require();
  const Verb why = prune_verb.add_alternatives("which", "Which go");
  why.add_option("--older-than", a->older_than_days,
                 "DAYS: those to which nothing has been written for so long")
      .check_not_negative();
  why.add_option("--free", a->free_gb, "GB: the oldest, until so much is free where they lie")
      .check_not_negative();
  prune_verb.add_flag("--yes", a->yes, "Remove them");
  prune_verb.set_action([a] { prune(*a); });
}

}  // namespace emberlock::cli
