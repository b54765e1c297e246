// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/signature.h"
#include "base/utc.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "recon/export/certificate.h"
#include "session/certificate.h"
#include "session/json_message.h"
#include "session/text.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

struct VerifyVolumeArguments {
  std::string volume, session, public_key;
  bool json = false;
};

void line(const char* name, const std::string& words) {
  std::printf("%-16s %s\n", name, session::printable(words).c_str());
}

std::string utc(std::int64_t ns) {
  const std::string text = utc_text({ns});  // "2026-11-22T02:50:00.123Z"
  return text.substr(0, 10) + " " + text.substr(11, 8) + " UTC";
}

std::string milliseconds(double value, double sigma) {
  return fmt::format("{:.3f} ms +- {:.3f}", 1e3 * value, 1e3 * sigma);
}

std::string words_of(const v1::CameraCalibration& c) {
  if (c.sha256().empty()) return "not calibrated";
  std::string words = fmt::format("fx {:.2f} pixels", c.fx());
  if (c.centre_m_size() == 3)
    words += fmt::format(", at {:.4f} {:.4f} {:.4f} m", c.centre_m(0), c.centre_m(1), c.centre_m(2));
  if (c.centre_sigma_m_size() == 3)
    words += fmt::format(" +- {:.2f} mm",
                         1e3 * std::hypot(c.centre_sigma_m(0), c.centre_sigma_m(1), c.centre_sigma_m(2)));
  return words + ", calibration " + c.sha256().substr(0, 16);
}

void print_sync(const v1::SyncEvidence& sync) {
  if (sync.source().empty()) return line("in sync", "the session's files don't tell");
  if (!sync.has_worst_pair_s() || sync.worst_pair_size() != 2)
    return line("in sync", sync.source() + " tells of no two cameras");
  line("in sync", fmt::format("worst pair {}: {} and {}, by {}",
                              milliseconds(sync.worst_pair_s(), sync.worst_pair_sigma_s()),
                              sync.worst_pair(0), sync.worst_pair(1), sync.source()));
}

void print_session(const v1::FilmedSession& session) {
  const auto if_told = [](const char* before, const std::string& words) {
    return words.empty() ? "" : before + words;
  };
  line("session", session.session_id() + if_told(", begun ", session.created_utc()) +
                      if_told(", recorded by ", session.software()));
  line("filmed", fmt::format("frame {}, {}", session.frame(), utc(session.filmed_utc_ns())));
  print_sync(session.sync());
  for (const auto& camera : session.cameras()) {
    std::string late;
    for (const auto& told : session.sync().cameras())
      if (told.camera_id() == camera.camera_id() && told.has_late_s())
        late = fmt::format("{} late; ", milliseconds(told.late_s(), told.sigma_s()));
    line("camera", fmt::format("{} ({} x {}, {:.2f} Hz, {} frames, {} lost): {}{}", camera.camera_id(),
                               camera.width(), camera.height(), camera.frame_rate_hz(), camera.recorded(),
                               camera.lost(), late, words_of(camera.calibration())));
  }
}

void print_reconstruction(const v1::Reconstruction& made) {
  if (made.voxels_size() != 3) return;
  line("reconstruction",
       fmt::format("{} x {} x {} voxels of {:.2f} mm, solver {}, {} iterations, {}", made.voxels(0),
                   made.voxels(1), made.voxels(2), 1e3 * made.voxel_edge_m(), made.solver(),
                   made.iterations(), made.device()));
  std::vector<std::string> options;
  for (const auto& option : made.options())
    options.push_back(fmt::format("--{} {}", option.name(), option.value()));
  if (!options.empty()) line("options", fmt::format("{}", fmt::join(options, " ")));
}

void print_certificate(const v1::VolumeCertificate& certificate) {
  switch (certificate.origin()) {
    case v1::VolumeCertificate::SESSION:
      print_session(certificate.session());
      break;
    case v1::VolumeCertificate::PICTURES:
      line("made of",
           "pictures, without a session: nothing tells when they were taken, nor how well in sync");
      break;
    case v1::VolumeCertificate::SIMULATION:
      line("made of", "nothing filmed: it was computed");
      break;
    case v1::VolumeCertificate::VOLUME:
      line("made of", fmt::format("another volume, {}{}",
                                  certificate.made_from_size() > 0 ? certificate.made_from(0).sha256() : "",
                                  certificate.has_exported() ? "" : ", which carried no certificate"));
      break;
    default:
      line("made of", "what nobody told");
  }
  const int files = certificate.session().files_size() + certificate.made_from_size();
  line("files", certificate.hashes_left_out() ? "their hashes were left out, as asked"
                                              : fmt::format("{} hashed", files));
  print_reconstruction(certificate.reconstruction());
  if (!certificate.program().empty()) line("by", certificate.program());
  if (!certificate.has_exported()) return;
  std::printf("\nThat volume's certificate said:\n");
  print_certificate(certificate.exported());
}

Error session_error(const std::string& what, const std::string& folder) {
  return {ErrorKind::bad_input, what, folder,
          "Leave --session away, or name the session that it was made of"};
}

/// Of the innermost volume, which the others were exported from.
const v1::VolumeCertificate& first_of(const v1::VolumeCertificate& certificate) {
  return certificate.has_exported() ? first_of(certificate.exported()) : certificate;
}

/// How many of the session's files are as they were. Error: one that isn't, or nothing to compare with.
Result<int> check_session(const VerifyVolumeArguments& a, const v1::VolumeCertificate& certificate) {
  const v1::VolumeCertificate& first = first_of(certificate);
  if (first.origin() != v1::VolumeCertificate::SESSION)
    return session_error("the volume isn't of a session, says its certificate", a.session);
  if (first.hashes_left_out())
    return session_error("the volume's certificate has no hashes: they were left out, as asked", a.session);
  const Observer observer = [bar = progress_bar("session")](double fraction, std::string_view what) {
    bar(fraction, what);
    return !Interrupt::asked();
  };
  const auto& files = first.session().files();
  if (files.empty()) return session_error("the volume's certificate names none of its files", a.session);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<std::string> problems,
                             session::changed_files(a.session, files, observer));
  if (problems.empty()) return files.size();
  return Error{ErrorKind::refused,
               fmt::format("isn't what the volume was made of: {}", fmt::join(problems, "; ")), a.session,
               "Take the session as it was, from a copy"};
}

Status verify_volume(const VerifyVolumeArguments& a) {
  const Interrupt interrupt;
  std::optional<std::string> trusted;
  if (!a.public_key.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(trusted, read_public_key(a.public_key));
  }
  const Observer observer = [bar = progress_bar("volume")](double fraction, std::string_view what) {
    bar(fraction, what);
    return !Interrupt::asked();
  };
  EMBERLOCK_ASSIGN_OR_RETURN(const auto found, recon::check_volume(a.volume, observer));
  if (!found)
    return Error{ErrorKind::bad_input, "carries no certificate", a.volume,
                 "Make it anew: `emberlock reconstruct` writes one into each volume"};
  const recon::CertifiedVolume& volume = *found;
  if (trusted) EMBERLOCK_RETURN_IF_ERROR(session::check_signer(volume.seal, *trusted, a.volume));
  int files = 0;
  if (!a.session.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(files, check_session(a, volume.certificate));
  }
  if (a.json) {
    EMBERLOCK_ASSIGN_OR_RETURN(
        const std::string text,
        session::json_of(volume.certificate, session::Defaults::left_out, "the certificate", a.volume));
    nlohmann::ordered_json json{{"holds", true},
                                {"bytes", volume.bytes},
                                {"sha256", volume.seal.sha256},
                                {"signed_by", volume.seal.key},
                                {"session_files_compared", files}};
    json["certificate"] = nlohmann::ordered_json::parse(text);
    std::printf("%s\n", json.dump(2).c_str());
    return {};
  }
  line("volume", fmt::format("holds: each of its {} bytes is as it was sealed", volume.bytes));
  line("sha256", volume.seal.sha256);
  line("signed by", volume.seal.key.empty() ? "nobody"
                    : trusted               ? volume.seal.key + ", the key given"
                              : volume.seal.key + ", which nobody vouched for: see --public-key");
  if (!a.session.empty()) line("session's files", fmt::format("{} of {} are as they were", files, files));
  print_certificate(volume.certificate);
  return {};
}

}  // namespace

void add_verify_volume(const Verb& app) {
  auto arguments = std::make_shared<VerifyVolumeArguments>();
  const Verb verb = app.add_verb("verify-volume",
                                 "Says what a volume's certificate says, and whether it holds. Exit "
                                 "code 1: it doesn't; 2: there is none");
  verb.add_option("VOLUME", arguments->volume, "A volume.vdb, or a flame.vdb of `export`").require();
  verb.add_option("--session", arguments->session,
                  "The session's folder: also compares its files with those that the volume was made of");
  verb.add_option("--public-key", arguments->public_key,
                  "The public Ed25519 key (PEM) that must have signed it");
  verb.add_flag("--json", arguments->json, "One JSON object");
  verb.set_action([arguments] { or_fail(verify_volume(*arguments)); });
}

}  // namespace emberlock::cli
