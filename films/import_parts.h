// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/frame.h"
#include "base/output_folder.h"
#include "base/progress.h"
#include "base/result.h"
#include "base/unique_fd.h"
#include "emberlock/v1/session.pb.h"
#include "films/import_run.h"
#include "session/media/clip.h"
#include "session/shutter_times.h"
#include "session/writer.h"

namespace emberlock::films {

/// What is imported of one camera's film.
struct CameraPart {
  v1::CameraStream stream{};  ///< without segments and counts
  std::vector<session::ClipPart> files{};
  session::Colours colours = session::Colours::keep;
  session::WriterOptions writer{};
  std::vector<std::int64_t> places{};  ///< indices in the film, one per frame of the session
  std::vector<FrameStamp> stamps{};    ///< one per frame of the session
};

/// Builds a session in a folder beside the final one, "NAME.importing", one camera at a time. A camera is
/// kept once all its frames are written. An interrupted import continues with the missing cameras, as long as
/// originals and options are the same. An import that ends before a camera is complete leaves no folder.
class ImportFolder {
 public:
  ImportFolder(ImportFolder&&) noexcept = default;
  ImportFolder& operator=(ImportFolder&&) = delete;
  ~ImportFolder();
  /// `inputs` are the files that are read; they must not lie in the session. Errors: bad_input (the session
  /// exists, an input lies in the way, "NAME.importing" isn't an import's), refused (another import is
  /// running there), io.
  static Result<ImportFolder> open(const std::filesystem::path& session,
                                   const std::vector<std::filesystem::path>& inputs);

  /// Whether this camera is already complete.
  [[nodiscard]] bool has(const CameraPart& part) const;
  /// Decodes and writes the camera's frames, unless they exist. Different cameras may be written from
  /// different threads. Errors: bad_input where an original is damaged, with its name and frame, whose index
  /// in the film is stored in `damaged_at`; io.
  Status write(const CameraPart& part, const Observer& observer,
               std::optional<std::int64_t>& damaged_at) const;
  /// Assembles the session and renames it. `manifest` must contain everything that the writer doesn't fill
  /// in.
  Result<v1::Manifest> finish(v1::Manifest manifest, const std::vector<CameraPart>& parts,
                              const v1::ShutterTimes* times, const ImportReports& reports) const;

 private:
  ImportFolder(std::filesystem::path session, std::filesystem::path work, MadeFolders made, UniqueFd lock)
      : made_(std::move(made)),
        session_(std::move(session)),
        work_(std::move(work)),
        lock_(std::move(lock)) {}
  [[nodiscard]] std::filesystem::path part_folder(const CameraPart& part) const;
  [[nodiscard]] std::filesystem::path mark_of(const CameraPart& part) const;

  MadeFolders made_;
  std::filesystem::path session_;
  std::filesystem::path work_;
  UniqueFd lock_;
};

}  // namespace emberlock::films
