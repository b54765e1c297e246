// SPDX-License-Identifier: Apache-2.0
#include "recon/export/certificate.h"

#include <fstream>
#include <system_error>
#include <utility>

#include "base/kind_of_file.h"
#include "recon/export/vdb_header.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

struct CertificateText {
  std::string text;
  std::uint64_t seal_offset = 0;
};

/// Nothing where the file has none.
Result<std::optional<CertificateText>> certificate_in(const fs::path& vdb) {
  EMBERLOCK_RETURN_IF_ERROR(check_regular_file(vdb));
  std::ifstream file(vdb, std::ios::binary);
  if (!file)
    return Error{ErrorKind::io, "can't be read", vdb.string(), "Check that the file is there and readable"};
  EMBERLOCK_ASSIGN_OR_RETURN(std::optional<VdbText> found,
                             find_vdb_text(file, kCertificateKey, vdb.string()));
  if (!found) return std::optional<CertificateText>();
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t place, session::place_of_seal(found->text, vdb.string()));
  return std::optional(CertificateText{std::move(found->text), found->offset + place});
}

}  // namespace

Certification simulated() {
  Certification computed;
  computed.certificate.set_origin(v1::VolumeCertificate::SIMULATION);
  return computed;
}

Status seal_volume(const fs::path& vdb, const SigningKey* key) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<CertificateText> found, certificate_in(vdb));
  if (!found) return Error{ErrorKind::bad_input, "has no certificate to seal", vdb.string()};
  return session::seal_file(vdb, found->seal_offset, key, session::kSealsVolume);
}

Result<bool> check_seal_of_volume(const fs::path& vdb) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<CertificateText> found, certificate_in(vdb));
  if (!found) return false;
  EMBERLOCK_RETURN_IF_ERROR(session::check_seal(vdb, found->seal_offset, session::kSealsVolume));
  return true;
}

Result<std::optional<CertifiedVolume>> check_volume(const fs::path& vdb, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<CertificateText> found, certificate_in(vdb));
  if (!found) return std::optional<CertifiedVolume>();
  CertifiedVolume volume;
  EMBERLOCK_ASSIGN_OR_RETURN(volume.seal,
                             session::check_seal(vdb, found->seal_offset, session::kSealsVolume, observer));
  EMBERLOCK_ASSIGN_OR_RETURN(volume.certificate,
                             session::parse_volume_certificate(found->text, vdb.string()));
  std::error_code ec;
  volume.bytes = fs::file_size(vdb, ec);
  return std::optional(std::move(volume));
}

}  // namespace emberlock::recon
