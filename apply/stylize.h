// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "apply/edit_file.h"
#include "apply/edit_picture.h"
#include "apply/edit_volume.h"
#include "base/result.h"
#include "recon/adjust/running_solve.h"
#include "recon/pipeline/reconstruct.h"

namespace emberlock::apply {

/// Whether these edits can be made of this scene: it is the one they were recorded of, its views are there,
/// and the objects' pictures can be read. `where` names the file.
Status check_edits(const EditFile& edits, const recon::Scene& scene, const std::string& where);

/// Flame stylization (the paper's section "Flame Stylization"): a reconstruction that goes on while its input
/// pictures, and its volume, are edited. Begins with a finished reconstruction, so that what an edit adds
/// comes out of the flame pass by pass. Everything is a function of the scene, the reconstruction and the
/// steps with their passes: the same bits live and replayed, for every number of threads, on the same device.
class Stylization {
 public:
  /// `from` reconstructs `scene`, as loaded. Errors: RunningSolve's.
  static Result<std::unique_ptr<Stylization>> begin(const recon::Scene& scene, const recon::Outcome& from,
                                                    const recon::SolveOptions& options, Colours colours,
                                                    const recon::CameraResponse& response);

  /// Takes effect before the next pass, and is recorded as of now. Errors (bad_input; nothing has changed
  /// then): no such input view, a picture that can't be read or is another one than was recorded, nothing to
  /// undo or to redo.
  Status apply(Operation operation);
  /// Brings the pictures and the volume to where the steps have them, and does one pass. Errors: carve()'s,
  /// Diverged's, a device's.
  Status pass();

  [[nodiscard]] int passes() const { return passes_; }
  /// Fitted rays' residual, as the last pass met it; RMS, grey levels.
  [[nodiscard]] double residual() const { return residual_; }
  [[nodiscard]] History history() const;
  /// Every step so far, with this scene's views, voxels and as many passes as were done.
  [[nodiscard]] EditFile record() const;
  /// With the pictures as edited.
  [[nodiscard]] const recon::Scene& scene() const { return edited_; }
  /// After the last pass, as the operations have it shown.
  [[nodiscard]] EditedVolume shown() const;
  /// The same seen by a view's camera, at most so many pixels wide, in grey levels.
  [[nodiscard]] recon::RadianceImage preview(const EditedVolume& shown, std::size_t view, int widest) const;
  /// The report tells how the edited pictures are fitted; volume, temperatures and renderings are as shown.
  /// Applies steps of which no pass was done yet.
  Result<recon::Outcome> outcome();

 private:
  Stylization(const recon::Scene& scene, const recon::Outcome& from, const recon::SolveOptions& options,
              Colours colours, const recon::CameraResponse& response);
  [[nodiscard]] Result<recon::PreparedScene> prepared(const recon::Scene& scene) const;
  Status load(ObjectEdit& object);
  /// Brings pictures and dark regions to where the steps have them.
  Status bring_up();

  recon::Scene captured_, edited_;
  recon::SolveOptions options_;
  Colours colours_;
  FlameColours flame_;
  recon::FoundPointing pointing_;
  recon::Outcome begun_;  // without its volume
  std::unique_ptr<recon::RunningSolve> solve_;
  std::vector<Step> steps_;
  std::map<std::string, ObjectPicture> objects_;  // by hash
  std::vector<std::uint8_t> dark_;
  int passes_ = 0;
  double residual_ = 0;
  bool pending_ = false;
};

}  // namespace emberlock::apply
