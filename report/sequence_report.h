// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "recon/export/picture_quality.h"
#include "report/html.h"

namespace emberlock::report {

/// A frame of a sequence, as it is told over time. Errors: all channels, grey levels (0..255).
struct SequenceFrame {
  std::uint64_t frame = 0;
  std::string error = {};  ///< why there is no volume; all that follows is then empty
  std::string start = {};  ///< recon::name(FrameStart)
  bool decided = false;    ///< effects, smoothness and pointing, for the next ones too
  int iterations = 0;
  Seconds loading{0}, reconstruction{0}, writing{0};
  double input_rmse = 0;
  std::optional<double> heldout_rmse = {};
  /// Over whole pictures, the mean of the held-out views.
  std::optional<double> psnr = {}, ssim = {};
  double light = 0;  ///< the emission's integral over the volume, mean of the channels, grey levels m2
  std::optional<recon::Flicker> flicker = {};  ///< from the frame before
  std::optional<Seconds> time = {};            ///< after the recording's first frame
  std::string volume = {};                     ///< SHA-256 of its volume.vdb; empty: not known
};

/// All frames that were tried, in their order.
struct SequenceTold {
  int voxels = 0;  ///< of the first frame, and so of all
  bool held_out = false;
  int instants = 1;  ///< that are counted a frame period: frame n is number n * instants
  std::vector<SequenceFrame> frames = {};
  /// What the frames were made of and with, so that no other frames follow; empty where it isn't known.
  std::string session = {};
  std::map<std::string, std::string> options = {};  ///< that were given
};

/// frames.json: {"format": "emberlock sequence", "version": 1, "voxels", "held_out", "instants", "frames":
/// [{"frame", "error" (null where there is a volume), "start", "decided", "iterations", "seconds" {loading,
/// reconstruction, writing}, "input_rmse", "heldout_rmse", "psnr", "ssim", "light", "flicker" {pictures,
/// renders}, "time_s", "volume" (SHA-256)}], "session", "options": {name: value}}; null is what isn't known.
std::string sequence_json(const SequenceTold& told);
/// The reverse. `where` is named in errors (bad_input).
Result<SequenceTold> parse_sequence(std::string_view json, const std::string& where);
/// frames.csv, a line a frame.
std::string sequence_csv(const SequenceTold& told);
/// What is said of all: volumes, seconds a frame, errors, flicker. Lines without ends.
std::vector<std::string> sequence_words(const SequenceTold& told);
/// A page with plots over time; `more` adds to it before the table of all frames.
std::string sequence_html(const SequenceTold& told, const std::string& input,
                          const std::function<void(HtmlPage&)>& more = {});

}  // namespace emberlock::report
