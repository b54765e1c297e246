// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/progress.h"
#include "base/result.h"
#include "session/certificate.h"

// A volume's certificate: what it was made from and how (v1::VolumeCertificate), as the file's metadatum
// `emberlock_certificate`. It ends in a seal (session/seal.h) of all bytes of the file.
namespace emberlock::recon {

inline constexpr const char* kCertificateKey = "emberlock_certificate";

/// What is written into a volume.
struct Certification {
  v1::VolumeCertificate certificate = {};
  std::shared_ptr<const SigningKey> key = {};  ///< null: unsigned
};

/// Of a volume that was computed and never filmed.
Certification simulated();

/// Seals a volume whose certificate has a blank seal. Errors: io; bad_input: it has no certificate.
Status seal_volume(const std::filesystem::path& vdb, const SigningKey* key);

struct CertifiedVolume {
  v1::VolumeCertificate certificate;
  session::Seal seal;
  std::uint64_t bytes = 0;
};
/// Whether a volume is sealed. Error (refused): a byte isn't as it was sealed. Errors: as check_volume().
Result<bool> check_seal_of_volume(const std::filesystem::path& vdb);

/// A volume's certificate, if it holds: each byte of the file is as it was sealed. Error (refused): it
/// doesn't hold. Errors (bad_input): no OpenVDB file; a certificate that is cut off, there twice, or of
/// another version.
/// Nothing of a volume without one, as versions before 0.2.0 wrote it.
Result<std::optional<CertifiedVolume>> check_volume(const std::filesystem::path& vdb,
                                                    const Observer& observer = {});

}  // namespace emberlock::recon
