// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "cli/commands.h"
#include "recon/pipeline/certify.h"

namespace emberlock::cli {

struct ReconstructArguments;

/// What a volume's certificate is asked to be.
struct CertificateArguments {
  std::string key;  ///< a PEM file; empty: unsigned
  bool no_file_hashes = false;
  std::string program;  ///< that says it wrote the volume
  /// Of the files read so far, for all volumes of a run.
  std::shared_ptr<recon::FileHashes> hashes = std::make_shared<recon::FileHashes>();
};

/// Adds --key.
Option add_key_option(const Verb& verb, std::string& key);
/// Adds --key and --no-file-hashes.
void add_certificate_options(const Verb& verb, CertificateArguments& a);

/// The key of a file; null where none is named.
Result<std::shared_ptr<const SigningKey>> key_of(const std::string& file);

/// The certificate of a volume that is yet to be reconstructed.
struct Certified {
  recon::Certification certification;
  std::string words;  ///< "unsigned; 13 files, 2.1 MB, hashed in 0.01 s"
};
Result<Certified> certify(const ReconstructArguments& arguments, const Progress& progress,
                          const std::function<bool()>& stop);

}  // namespace emberlock::cli
