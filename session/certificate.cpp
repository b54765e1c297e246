// SPDX-License-Identifier: Apache-2.0
#include "session/certificate.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/nesting.h"
#include "base/sha256.h"
#include "session/events.h"
#include "session/files.h"
#include "session/json_message.h"
#include "session/text.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

using HashedFiles = google::protobuf::RepeatedPtrField<v1::HashedFile>;

constexpr const char* kCertificate = "certificate.json";
constexpr std::size_t kMaxCertificateBytes = std::size_t{64} << 20;
constexpr const char* kCertifyRemedy = "Take the file as Emberlock wrote it";

/// The version, before anything else is asked of the text: another one may have other fields.
Status check_version(std::string_view text, const std::string& where) {
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(text, where));
  const auto json = nlohmann::json::parse(text, nullptr, false);
  const auto version = json.is_object() ? json.find("format_version") : json.end();
  if (!json.is_object() || version == json.end() || !version->is_number_unsigned())
    return Error{ErrorKind::bad_input, "not a certificate: JSON with a format_version", where,
                 kCertifyRemedy};
  if (*version == kCertificateVersion) return {};
  return Error{ErrorKind::bad_input,
               "a certificate of version " + version->dump() + ", this program reads version " +
                   std::to_string(kCertificateVersion),
               where, "Use a newer Emberlock"};
}

Status check_files(const HashedFiles& files, const std::string& where) {
  for (const v1::HashedFile& file : files)
    if (file.file().empty() || !is_sha256(file.sha256()))
      return Error{ErrorKind::bad_input, "names a file without its hash: \"" + file.file() + "\"", where,
                   kCertifyRemedy};
  return {};
}

/// Every number of a message, and of those in it.
bool all_finite(const google::protobuf::Message& message) {
  using Field = google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  std::vector<const Field*> fields;
  reflection.ListFields(message, &fields);
  return std::all_of(fields.begin(), fields.end(), [&](const Field* field) {
    const int count = field->is_repeated() ? reflection.FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i) {
      if (field->cpp_type() == Field::CPPTYPE_DOUBLE &&
          !std::isfinite(field->is_repeated() ? reflection.GetRepeatedDouble(message, field, i)
                                              : reflection.GetDouble(message, field)))
        return false;
      if (field->cpp_type() == Field::CPPTYPE_MESSAGE &&
          !all_finite(field->is_repeated() ? reflection.GetRepeatedMessage(message, field, i)
                                           : reflection.GetMessage(message, field)))
        return false;
    }
    return true;
  });
}

template <class Certificate>
Result<std::string> text_with_blank_seal(Certificate certificate, const SigningKey* key) {
  certificate.set_format_version(kCertificateVersion);
  certificate.set_seal(blank_seal(key));
  return json_of(certificate, Defaults::left_out, "the certificate", kCertificate);
}

template <class Certificate>
Result<Certificate> parsed(std::string_view text, const std::string& where) {
  EMBERLOCK_RETURN_IF_ERROR(check_version(text, where));
  Certificate certificate;
  EMBERLOCK_RETURN_IF_ERROR(read_json(text, certificate, "a certificate", where, kCertifyRemedy));
  if (!all_finite(certificate))
    return Error{ErrorKind::bad_input, "a number of the certificate isn't finite", where, kCertifyRemedy};
  EMBERLOCK_RETURN_IF_ERROR(parse_seal(certificate.seal(), where));
  return certificate;
}

/// The paths of all of a session's files but the certificate, relative to its folder, in their order.
Result<std::vector<std::string>> files_below(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ec;
  for (fs::recursive_directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec)) {
    const std::string name = it->path().lexically_relative(folder).generic_string();
    if (it->is_symlink(ec))
      return Error{ErrorKind::refused, "is a link: what it leads to may change", it->path().string(),
                   "Put the file itself there"};
    if (it->is_directory(ec)) continue;
    if (!it->is_regular_file(ec))
      return Error{ErrorKind::refused, "is neither a file nor a folder", it->path().string(), "Move it away"};
    if (name != kCertificate) names.push_back(name);
  }
  if (ec) return Error{ErrorKind::io, "can't be listed: " + ec.message(), folder.string()};
  std::sort(names.begin(), names.end());
  return names;
}

/// Observers of files that are read one after the other, by their bytes.
class BytesSeen {
 public:
  BytesSeen(const Observer& whole, double all) : whole_(whole), all_(std::max(1.0, all)) {}
  Observer of_file(double bytes) {
    const double from = std::min(1.0, seen_ / all_);
    seen_ += bytes;
    return part_of(whole_, from, std::min(1.0, seen_ / all_));
  }

 private:
  const Observer& whole_;
  double all_, seen_ = 0;
};

double size_of(const fs::path& path) {
  std::error_code ec;
  const std::uintmax_t size = fs::file_size(path, ec);
  return ec ? 0 : static_cast<double>(size);
}

}  // namespace

fs::path certificate_path(const fs::path& folder) { return folder / kCertificate; }

Result<std::string> certificate_text(const v1::SessionCertificate& certificate, const SigningKey* key) {
  return text_with_blank_seal(certificate, key);
}
Result<std::string> certificate_text(const v1::VolumeCertificate& certificate, const SigningKey* key) {
  return text_with_blank_seal(certificate, key);
}

Result<v1::SessionCertificate> parse_session_certificate(std::string_view text, const std::string& where) {
  EMBERLOCK_ASSIGN_OR_RETURN(v1::SessionCertificate certificate, parsed<v1::SessionCertificate>(text, where));
  EMBERLOCK_RETURN_IF_ERROR(check_files(certificate.files(), where));
  return certificate;
}

Result<v1::VolumeCertificate> parse_volume_certificate(std::string_view text, const std::string& where) {
  EMBERLOCK_ASSIGN_OR_RETURN(v1::VolumeCertificate certificate, parsed<v1::VolumeCertificate>(text, where));
  EMBERLOCK_RETURN_IF_ERROR(check_files(certificate.made_from(), where));
  EMBERLOCK_RETURN_IF_ERROR(check_files(certificate.session().files(), where));
  return certificate;
}

Result<v1::SessionCertificate> certify_session(const fs::path& folder, const std::string& program,
                                               const SigningKey* key, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd held, hold_finished(folder, Alone::no));
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::Manifest manifest, read_manifest(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<std::string> names, files_below(folder));
  double bytes = 0;
  for (const std::string& name : names) bytes += size_of(folder / name);
  BytesSeen seen(observer, bytes);
  v1::SessionCertificate certificate;
  certificate.set_program(program);
  certificate.set_session_id(manifest.session_id());
  certificate.set_created_utc(manifest.created_utc());
  for (const std::string& name : names) {
    const Observer part = seen.of_file(size_of(folder / name));
    EMBERLOCK_ASSIGN_OR_RETURN(const FileHash hash, hash_file(folder / name, part));
    v1::HashedFile& file = *certificate.add_files();
    file.set_file(name);
    file.set_bytes(hash.bytes);
    file.set_sha256(hash.sha256);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, certificate_text(certificate, key));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t place, place_of_seal(text, folder.string()));
  EMBERLOCK_RETURN_IF_ERROR(
      write_file_atomically(certificate_path(folder), sealed(text, place, key, kSealsSession)));
  return certificate;
}

Result<std::vector<std::string>> changed_files(const fs::path& folder, const HashedFiles& files,
                                               const Observer& observer) {
  double bytes = 0;
  for (const v1::HashedFile& file : files) bytes += size_of(folder / file.file());
  BytesSeen seen(observer, bytes);
  std::vector<std::string> problems;
  for (const v1::HashedFile& file : files) {
    const fs::path path = folder / file.file();
    const std::string name = printable(file.file());
    std::error_code ec;
    // A name from foreign hands may lead out of the folder.
    const bool inside = fs::path(file.file()).is_relative() &&
                        !fs::path(file.file()).lexically_normal().generic_string().starts_with("..");
    if (!inside || !fs::is_regular_file(path, ec)) {
      problems.push_back(name + ": is missing, and was there when it was certified");
      continue;
    }
    const Observer part = seen.of_file(size_of(path));
    const Result<FileHash> hash = hash_file(path, part);
    if (!hash && hash.error().kind == ErrorKind::refused) return hash.error();
    if (!hash)
      problems.push_back(name + ": " + hash.error().what);
    else if (hash->bytes != file.bytes())
      problems.push_back(name + ": has " + std::to_string(hash->bytes) + " bytes, and had " +
                         std::to_string(file.bytes()) + " when it was certified");
    else if (hash->sha256 != file.sha256())
      problems.push_back(name + ": isn't what was certified");
  }
  return problems;
}

Result<std::optional<CertifiedSession>> check_certificate(const fs::path& folder, const Observer& observer) {
  const fs::path path = certificate_path(folder);
  std::error_code ec;
  if (!fs::exists(fs::symlink_status(path, ec))) return std::optional<CertifiedSession>();
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path, kMaxCertificateBytes));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t place, place_of_seal(text, path.string()));
  CertifiedSession session;
  EMBERLOCK_ASSIGN_OR_RETURN(session.seal, check_seal(path, place, kSealsSession));
  EMBERLOCK_ASSIGN_OR_RETURN(session.certificate, parse_session_certificate(text, path.string()));
  EMBERLOCK_ASSIGN_OR_RETURN(session.problems, changed_files(folder, session.certificate.files(), observer));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<std::string> names, files_below(folder));
  std::set<std::string> certified;
  for (const v1::HashedFile& file : session.certificate.files()) certified.insert(file.file());
  for (const std::string& name : names)
    if (certified.count(name) == 0)
      session.problems.push_back(printable(name) + ": was added after it was certified");
  return std::optional(std::move(session));
}

}  // namespace emberlock::session
