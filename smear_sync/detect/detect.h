// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/image.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

/// Thresholds of the detector. Multiples of the noise refer to the frame's own noise, measured away from the
/// lamp. In 8-bit frames no dot weaker than 2.5 grey levels is accepted, because mild compression turns noise
/// into such spots.
struct DetectOptions {
  double min_lamp_contrast = 0.2;  ///< of the full scale, above the background; (0, 1]
  double min_lamp_radius = 1.8;    ///< pixels; smaller bright spots are hot pixels; >= 1.5
  double max_lamp_radius =
      0.2;                 ///< share of the image's longer side; larger bright areas are part of the scene
  double min_dot_snr = 6;  ///< matched-filter SNR below which a spot is noise; >= 4
  double blind_fraction =
      0.5;  ///< share of the rows; if more are hidden, the absence of a dot proves nothing
};

/// Reads one frame of a strobe: the lamp, the dots in its column, and the resulting state.
///
/// While charge is shifted, a flash exposes the lamp once, so a dot is a faint copy of the lamp's disk, k
/// rows away in the same columns (the paper's section "CCD Smear"). The detector accepts nothing else: a spot
/// without the lamp's columns, size and evenness isn't a dot. If two explanations fit, the state is
/// `ambiguous` and there are no dots.
///
/// Rows and columns count from 0 at the centre of the top left pixel; amplitudes are grey levels of the
/// frame's own depth. All formats and strides are accepted. Bayer frames are read as sums of 2 x 2 cells,
/// colour frames as the sum of their channels. Pure; never fails: an empty or malformed view gives state
/// `no_lamp` with the reason.
SmearReading detect(const ImageView& frame, const DetectOptions& options = {});

}  // namespace emberlock::smear
