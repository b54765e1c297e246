// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/signature.h"
#include "cli/certificate_options.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/hosts_words.h"
#include "cli/interrupt.h"
#include "cli/sessions_backup.h"
#include "cli/sessions_daemon.h"
#include "cli/sessions_join.h"
#include "session/certificate.h"
#include "session/export.h"
#include "session/job_json.h"
#include "session/job_messages.h"
#include "session/reader.h"
#include "session/store.h"
#include "session/verify.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

struct SessionsArguments {
  std::string folder;
  std::string out;
  std::string format = "png";
  std::string key, public_key;  ///< PEM files
  std::string program;
  bool json = false;
  DaemonAddress daemon;
};

/// A progress bar whose step Ctrl-C cancels.
Observer until_interrupted(const std::string& title) {
  return [bar = progress_bar(title)](double fraction, std::string_view what) {
    bar(fraction, what);
    return !Interrupt::asked();
  };
}

std::string size_of(std::uint64_t bytes) {
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) / 1e6);
}

/// Counts characters, not bytes.
std::string padded(std::string name) {
  constexpr std::size_t kColumn = 24;
  const auto characters = static_cast<std::size_t>(std::count_if(
      name.begin(), name.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
  if (characters < kColumn) name.append(kColumn - characters, ' ');
  return name;
}

void print_table(const v1::ListSessionsResponse& sessions) {
  if (sessions.sessions().empty()) std::printf("No sessions.\n");
  for (const auto& s : sessions.sessions()) {
    if (!s.error().empty()) {
      std::printf("%s unreadable: %s\n", padded(s.session()).c_str(), s.error().c_str());
      continue;
    }
    const std::string hosts = hosts_in_words(s);
    std::printf("%s %-9s %-10s %-24s %2u cameras %8llu frames %6llu lost %12s%s%s%s\n",
                padded(s.session()).c_str(), v1::Manifest::State_Name(s.state()).c_str(), s.purpose().c_str(),
                s.created_utc().c_str(), s.cameras(), static_cast<unsigned long long>(s.frames()),
                static_cast<unsigned long long>(s.lost()), size_of(s.bytes()).c_str(),
                s.calibrated() ? "  calibrated" : "", hosts.empty() ? "" : "  ", hosts.c_str());
  }
}

v1::ListSessionsResponse sessions_in(const SessionsArguments& a) {
  if (a.folder.empty()) return sessions_of_daemon(a.daemon);
  if (!fs::is_directory(a.folder)) {
    fail({ErrorKind::bad_input, "no such folder", a.folder, "Name the folder in which sessions lie"});
  }
  return or_fail(session::SessionStore::open(a.folder)).list();
}

void list(const SessionsArguments& a) {
  const v1::ListSessionsResponse sessions = sessions_in(a);
  if (!a.json) return print_table(sessions);
  std::printf("%s\n", json_line(sessions).c_str());
}

/// A name that the daemon doesn't know, or that nobody answers for, may be a folder here.
SessionsArguments meant(SessionsArguments a) {
  if (!is_daemons(a.folder) || !session::SessionReader::is_session(a.folder) ||
      daemon_has(a.daemon, a.folder))
    return a;
  a.folder = "./" + a.folder;
  std::fprintf(stderr, "emberlock: %s is taken: the daemon has no such session, or none answers\n",
               a.folder.c_str());
  return a;
}

session::SessionCheck check_of(const SessionsArguments& a) {
  if (is_daemons(a.folder))
    return session::from_proto(job_by_daemon(a.daemon, SessionJob::verify, a.folder).verify());
  const Interrupt interrupt;
  return or_fail(session::verify_session(a.folder, until_interrupted("verify")));
}

void verify(const SessionsArguments& a) {
  const session::SessionCheck check = check_of(a);
  if (a.json) {
    std::printf("%s\n", session::to_line(session::to_json(check)).c_str());
  } else {
    for (const session::CameraCheck& c : check.cameras) {
      std::printf("%-24s %s of %s frames good", c.camera_id.c_str(), std::to_string(c.good).c_str(),
                  std::to_string(c.recorded).c_str());
      if (c.bad > 0) std::printf(", %s can't be read back", std::to_string(c.bad).c_str());
      if (c.missing > 0) std::printf(", %s missing from the index", std::to_string(c.missing).c_str());
      if (c.unindexed > 0) std::printf(", %s that the index lacks", std::to_string(c.unindexed).c_str());
      std::printf("\n");
      for (const std::string& problem : c.problems) std::printf("  %s\n", problem.c_str());
    }
    for (const std::string& problem : check.problems) std::printf("%s\n", problem.c_str());
    if (check.certified_files > 0)
      std::printf("%s files as certified, %s\n", std::to_string(check.certified_files).c_str(),
                  check.certified_by.empty() ? "unsigned" : ("signed by " + check.certified_by).c_str());
    std::printf("%s\n", check.whole() ? "All there." : (check.to_do + ".").c_str());
  }
  if (!check.whole()) throw Exit(1);
  if (a.public_key.empty()) return;
  const std::string trusted = or_fail(read_public_key(a.public_key));
  if (check.certified_files == 0)
    fail({ErrorKind::bad_input, "has no certificate", a.folder, "Certify it: emberlock sessions certify"});
  or_fail(session::check_signer({"", check.certified_by, ""}, trusted, a.folder));
}

void certify_session(const SessionsArguments& a) {
  const auto key = or_fail(key_of(a.key));
  const Interrupt interrupt;
  const SteadyClock clock;
  const TimePoint begin = clock.now();
  const v1::SessionCertificate certificate =
      or_fail(session::certify_session(a.folder, a.program, key.get(), until_interrupted("certify")));
  std::uint64_t bytes = 0;
  for (const v1::HashedFile& file : certificate.files()) bytes += file.bytes();
  std::printf("%-16s %d, %s, hashed in %.2f s\n", "files", certificate.files_size(), size_of(bytes).c_str(),
              (clock.now() - begin).value());
  std::printf("%-16s %s\n", "signed by", key ? key->public_key().c_str() : "nobody");
  std::printf("%-16s %s\n", "written to", session::certificate_path(a.folder).c_str());
}

session::RepairReport repair_report_of(const SessionsArguments& a) {
  if (is_daemons(a.folder))
    return session::from_proto(job_by_daemon(a.daemon, SessionJob::repair, a.folder).repair());
  const Interrupt interrupt;
  return or_fail(session::repair_session(a.folder, until_interrupted("repair")));
}

void repair(const SessionsArguments& a) {
  const session::RepairReport report = repair_report_of(a);
  if (a.json) {
    std::printf("%s\n", session::to_line(session::to_json(report)).c_str());
    return;
  }
  for (const session::RepairedCamera& c : report.cameras) {
    std::printf("%-24s %s frames kept, %s lost", c.camera_id.c_str(), std::to_string(c.kept).c_str(),
                std::to_string(c.lost).c_str());
    if (c.found > 0) std::printf(", %s taken up from the segments", std::to_string(c.found).c_str());
    std::printf("\n");
    for (const std::string& file : c.rewritten) std::printf("  %s was written anew\n", file.c_str());
  }
  const bool nothing = std::all_of(report.cameras.begin(), report.cameras.end(),
                                   [](const session::RepairedCamera& c) { return c.kept == 0; });
  std::printf("%s\n", nothing          ? "There is not one frame in it."
                      : report.changed ? "Mended."
                                       : "Nothing to mend.");
}

/// An export, and the folder that it went to.
struct Exported {
  fs::path folder;
  session::ExportReport report;
};

Exported export_of(const SessionsArguments& a) {
  const bool png = a.format == "png";
  if (is_daemons(a.folder)) {
    if (!a.out.empty())
      fail({ErrorKind::bad_input, "the daemon chooses where", "--out",
            "Leave it away, or name a folder: ./" + a.folder});
    const v1::JobOutcome outcome =
        job_by_daemon(a.daemon, png ? SessionJob::export_png : SessionJob::export_video, a.folder);
    return {outcome.export_().folder(), session::from_proto(outcome.export_())};
  }
  if (a.out.empty()) throw UsageError("--out is required");
  const Interrupt interrupt;
  const session::ExportFormat format = png ? session::ExportFormat::png : session::ExportFormat::video;
  return {a.out, or_fail(session::export_session(a.folder, a.out, format, until_interrupted("export")))};
}

void export_frames(const SessionsArguments& a) {
  const auto [folder, report] = export_of(a);
  if (a.json) {
    std::printf("%s\n", session::to_line(session::to_json(report)).c_str());
    return;
  }
  for (const session::ExportedCamera& c : report.cameras) {
    std::printf("%s: %s frames", fs::absolute(folder / c.file).lexically_normal().c_str(),
                std::to_string(c.frames).c_str());
    if (!report.codec.empty())
      std::printf(" at %.3f a second, %s", c.frame_rate.value(), report.codec.c_str());
    if (c.gaps > 0) std::printf(", %s gaps", std::to_string(c.gaps).c_str());
    if (c.repeated > 0)
      std::printf(" filled with %s repeated frames, marked by a hatched bar",
                  std::to_string(c.repeated).c_str());
    if (c.unreadable > 0) std::printf(", %s unreadable ones left out", std::to_string(c.unreadable).c_str());
    std::printf("\n");
  }
}

/// Adds a verb of `sessions` that takes one session's folder.
Verb add_verb(const Verb& sessions, const char* name, const char* words,
              const std::shared_ptr<SessionsArguments>& a, void (*run)(const SessionsArguments&)) {
  const Verb verb = sessions.add_verb(name, words);
  verb.add_option("SESSION", a->folder,
                  "The session's folder, or the name of one of the daemon's; of a folder here if it has none")
      .require();
  add_daemon_options(verb, a->daemon);
  verb.add_flag("--json", a->json, "One JSON object");
  verb.set_action([a, run] { run(meant(*a)); });
  return verb;
}

}  // namespace

void add_sessions(const Verb& app) {
  auto a = std::make_shared<SessionsArguments>();
  const Verb sessions = app.add_verb("sessions",
                                     "Lists, verifies, repairs, exports, backs up and joins recordings: "
                                     "the daemon's by name, others by path.");
  sessions.require_verb();
  const Verb all = sessions.add_verb("list", "Lists the sessions in a folder, the newest first.");
  all.add_option("FOLDER", a->folder, "Folder of sessions [the daemon's]");
  add_daemon_options(all, a->daemon);
  all.add_flag("--json", a->json, "One JSON object");
  all.set_action([a] { list(*a); });
  const Verb verified = add_verb(
      sessions, "verify",
      "Reads every frame back and compares it with its checksum, and every file with certificate.json, where "
      "there is one. Exit code 1: frames or files are missing or differ.",
      a, verify);
  verified.add_option("--public-key", a->public_key,
                      "The key (PEM) that must have signed the session's certificate");
  add_verb(sessions, "repair",
           "Repairs a session whose recorder was killed. Of a damaged session it keeps what is good and says "
           "what is lost.",
           a, repair);
  const Verb certify = sessions.add_verb(
      "certify",
      "Writes certificate.json, the hash of each of a session's files, by which `sessions verify` finds any "
      "change.");
  certify.add_option("SESSION", a->folder, "The session's folder").require();
  add_key_option(certify, a->key);
  certify.set_action([a, app] {
    a->program = app.version();
    certify_session(*a);
  });
  const Verb out =
      add_verb(sessions, "export", "Writes frames as files that other programs read.", a, export_frames);
  out.add_option("--out", a->out, "Folder to make; for the daemon's sessions the daemon chooses it");
  out.add_option("--format", a->format, "png: images without loss; video: H.264, to look at")
      .check_choices({"png", "video"})
      .show_default();
  add_sessions_backup(sessions);
  add_sessions_join(sessions);
}

}  // namespace emberlock::cli
