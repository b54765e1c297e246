// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "base/sha256.h"
#include "recon/export/certificate.h"
#include "recon/export/report.h"
#include "recon/pipeline/scene.h"

// What a volume's certificate says (docs/certificate.md), gathered from the files that a scene is made of and
// from the report of what was done with it. It depends on these alone, so that equal runs write equal files.
namespace emberlock::recon {

/// SHA-256 of files, each read once however many volumes are made of it. Thread-safe.
class FileHashes {
 public:
  /// Error: as hash_file().
  Result<FileHash> of(const std::filesystem::path& path, const Observer& observer);

 private:
  /// A file that changes is another one.
  using Identity = std::tuple<std::filesystem::path, std::uintmax_t, std::filesystem::file_time_type>;
  std::mutex mutex_;
  std::map<Identity, FileHash> known_;
};

/// Says where load_scene()'s scene comes from. Of a session: who filmed what when, how well the cameras were
/// in sync, how they are calibrated, and the hashes of its manifest, events, times, indices and those
/// segments that hold the frames shown. Of other inputs: the hashes of files_of(). `further`: files beside
/// these, such as a response. `hashes` null: none. Errors: those of reading; refused (the observer ends it).
Result<v1::VolumeCertificate> origin_of(const std::filesystem::path& input, const SceneOptions& options,
                                        const std::vector<std::filesystem::path>& further, FileHashes* hashes,
                                        const Observer& observer = {});

/// Of the volume `vdb`, which is exported: its hash and what its own certificate says. Error: it doesn't
/// hold.
Result<v1::VolumeCertificate> origin_of_export(const std::filesystem::path& vdb);

/// Adds what the reconstruction did.
void tell_reconstruction(const Report& report, v1::Reconstruction& reconstruction);

}  // namespace emberlock::recon
