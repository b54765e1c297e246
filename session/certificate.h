// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "emberlock/v1/certificate.pb.h"
#include "session/seal.h"

// certificate.json, an optional file of a session: the SHA-256 of each of its files, sealed.
namespace emberlock::session {

inline constexpr std::uint32_t kCertificateVersion = 1;

std::filesystem::path certificate_path(const std::filesystem::path& folder);

/// A certificate's JSON, which ends in a blank seal. Error (bad_input): a text that isn't UTF-8.
Result<std::string> certificate_text(const v1::SessionCertificate& certificate, const SigningKey* key);
Result<std::string> certificate_text(const v1::VolumeCertificate& certificate, const SigningKey* key);
/// What is read of foreign hands. Errors (bad_input): no JSON, of another version, a hash that is none,
/// numbers that aren't finite. `where` names the file.
Result<v1::SessionCertificate> parse_session_certificate(std::string_view text, const std::string& where);
Result<v1::VolumeCertificate> parse_volume_certificate(std::string_view text, const std::string& where);

/// Writes certificate.json, and replaces an earlier one: hashes every file of the folder, read once. What
/// changes the session later (repair, compression) makes it void. `program` writes it, `key` may be null:
/// unsigned. Errors: bad_input (no session), refused (not finished; a link among its files; cancelled), io.
Result<v1::SessionCertificate> certify_session(const std::filesystem::path& folder,
                                               const std::string& program, const SigningKey* key,
                                               const Observer& observer = {});

struct CertifiedSession {
  v1::SessionCertificate certificate;
  Seal seal;
  std::vector<std::string> problems;  ///< "FILE: what": changed, missing, added
};
/// Compares a session with its certificate.json; nothing where it has none. Errors: of the certificate
/// itself, as check_seal() and parse_session_certificate() have them; cancelled.
Result<std::optional<CertifiedSession>> check_certificate(const std::filesystem::path& folder,
                                                          const Observer& observer = {});
/// "FILE: what" of those of `files` that aren't in the folder as they were hashed. Errors: refused
/// (cancelled).
Result<std::vector<std::string>> changed_files(
    const std::filesystem::path& folder, const google::protobuf::RepeatedPtrField<v1::HashedFile>& files,
    const Observer& observer = {});

}  // namespace emberlock::session
