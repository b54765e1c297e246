// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/image.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

/// Gates of the detector. Those in multiples of the noise follow the frame's own noise, measured away from
/// the lamp. No dot weaker than 2.5 grey levels is taken from a frame of 8 bits: a gentle compressor makes
/// those of noise.
struct DetectOptions {
  double min_lamp_contrast = 0.2;  ///< of the full scale, above the background; (0, 1]
  double min_lamp_radius = 1.8;    ///< pixels; a smaller bright spot is hot pixels; >= 1.5
  double max_lamp_radius = 0.2;  ///< of the image's longer side; a larger bright area is a scene, not a lamp
  double min_dot_snr = 6;        ///< matched-filter SNR below which a dot is noise; >= 4
  double blind_fraction =
      0.5;  ///< of the rows; with more of them hidden, the absence of a dot proves nothing
};

/// Reads one frame of a strobe: where the lamp is, which dots stand in its column, and what that means.
///
/// A flash freezes the lamp while charge is shifted, so a dot is a faint copy of the lamp's disk, k rows away
/// in the same columns (the paper's section "CCD Smear"). The detector looks for exactly that and
/// for nothing else: what doesn't have the lamp's columns, size and evenness isn't a dot, and where two
/// explanations fit, the state is `ambiguous` and there are no dots.
///
/// Rows and columns count from 0 at the centre of the top left pixel, amplitudes are grey levels of the
/// frame's own depth. Every format and stride is read; Bayer frames are read as sums of 2 x 2 cells, colour
/// as the sum of its channels. Pure; never fails: an empty or malformed view reads `no_lamp` with the reason.
SmearReading detect(const ImageView& frame, const DetectOptions& options = {});

}  // namespace emberlock::smear
