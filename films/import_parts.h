// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/frame.h"
#include "base/progress.h"
#include "base/result.h"
#include "base/unique_fd.h"
#include "emberlock/v1/session.pb.h"
#include "films/import_run.h"
#include "session/media/clip.h"
#include "session/shutter_times.h"
#include "session/writer.h"

namespace emberlock::films {

/// What becomes of one camera's film.
struct CameraPart {
  v1::CameraStream stream{};  ///< without segments and counts
  std::vector<session::ClipPart> files{};
  session::Colours colours = session::Colours::keep;
  session::WriterOptions writer{};
  std::vector<std::int64_t> places{};  ///< of the film, one a frame of the session
  std::vector<FrameStamp> stamps{};    ///< as many
};

/// A session that grows in a folder beside its own, "NAME.importing": a camera at a time, each of which is
/// kept when all its frames are there. Whoever is killed goes on with the cameras that lack, as long as the
/// originals and what was asked for are the same.
class ImportFolder {
 public:
  /// `inputs` are read, and must stay out of the session. Errors: bad_input (the session exists, one of the
  /// inputs is in the way, "NAME.importing" is somebody else's), refused (another import is at work there),
  /// io.
  static Result<ImportFolder> open(const std::filesystem::path& session,
                                   const std::vector<std::filesystem::path>& inputs);

  /// Whether this camera is there already.
  [[nodiscard]] bool has(const CameraPart& part) const;
  /// Decodes and writes the camera's frames, unless it is there. Distinct cameras may be written from
  /// distinct threads. Errors: bad_input where an original is damaged, with its name and frame, whose place
  /// in the film goes to `damaged_at`; io.
  Status write(const CameraPart& part, const Observer& observer,
               std::optional<std::int64_t>& damaged_at) const;
  /// Puts the session together and gives it its name. `manifest` has everything but what the writer fills in.
  Result<v1::Manifest> finish(v1::Manifest manifest, const std::vector<CameraPart>& parts,
                              const v1::ShutterTimes* times, const ImportReports& reports) const;

 private:
  ImportFolder(std::filesystem::path session, std::filesystem::path work, UniqueFd lock)
      : session_(std::move(session)), work_(std::move(work)), lock_(std::move(lock)) {}
  [[nodiscard]] std::filesystem::path part_folder(const CameraPart& part) const;
  [[nodiscard]] std::filesystem::path mark_of(const CameraPart& part) const;

  std::filesystem::path session_;
  std::filesystem::path work_;
  UniqueFd lock_;
};

}  // namespace emberlock::films
