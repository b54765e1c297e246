// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string_view>

#include "recon/calibrate/board.h"
#include "recon/calibrate/rig_formats.h"
#include "tests/fuzz/target.h"

// A rig's files: rig.json, and COLMAP's text or binary, which a form feed parts into cameras and images.
FUZZ_TARGET(rig_files) {
  using namespace emberlock;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::size_t cut = bytes.find('\f');
  const auto check_rig = [](const Result<v1::Rig>& rig) {
    if (!rig) {
      if (rig.error().where.empty()) std::abort();
      return;
    }
    for (const v1::RigCamera& camera : rig->cameras()) {
      const ImageSize side{static_cast<int>(camera.width()), static_cast<int>(camera.height())};
      const auto model = recon::camera_model_of(camera.calibration(), side, camera.camera_id(), "fuzz");
      if (model && !(std::abs(model->ray({0.5, 0.5}).direction.norm() - 1) < 1e-9)) std::abort();
    }
  };
  if (cut == std::string_view::npos) {
    check_rig(session::parse_rig(bytes, "fuzz/rig.json"));
    (void)recon::parse_board(bytes);
  } else {
    check_rig(recon::parse_colmap(bytes.substr(0, cut), bytes.substr(cut + 1), "fuzz"));
    check_rig(recon::parse_colmap_binary(bytes.substr(0, cut), bytes.substr(cut + 1), "fuzz"));
  }
  return 0;
}
