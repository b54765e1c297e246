// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "cli/certificate_options.h"
#include "cli/commands.h"
#include "cli/reconstruct_daemon.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/scene.h"

namespace emberlock::cli {

/// The command line as typed, not yet interpreted.
struct ReconstructArguments {
  std::string input;
  std::string out;
  std::string rig;
  std::string background = "auto";
  std::string smear = "auto";
  std::string demosaic = "bilinear";
  std::string plan;
  std::string box;
  std::string solver = "default";
  std::string effects;
  std::string device = "auto";
  std::string precision = "float32";
  bool keep_poses = false;
  std::vector<int> held_out;
  int views = 0;
  double step = 1;
  std::string voxels;
  std::optional<std::size_t> frame, last_frame;
  int instants = 1;                    ///< a frame period, of a range; one: the frames
  std::optional<double> part = {};     ///< as SceneOptions::part
  std::string range = "--last-frame";  ///< the option that told the last one, as it was typed
  bool cold = false;
  int shrink = 1;
  std::uint32_t every = 1;
  int at_once = 1;
  std::optional<double> budget;
  std::optional<double> target_rmse;
  std::optional<double> threshold;
  int iterations = 0;
  int threads = 0;
  std::uint64_t seed = 1;
  std::string quantity = "colour";
  std::string response;
  std::string emitter;
  std::string lines;
  bool errors = false;
  std::optional<int> progress_fd;
  DaemonReconstruction by_daemon;
  std::shared_ptr<recon::SharedRecording> recording = {};  ///< of a sequence's frames
  /// What a sequence's frames.json states, so that a later run with others is refused: identity_of() the
  /// session, and the options that were given. Without a session nothing is compared.
  std::string session = {};
  std::map<std::string, std::string> options = {};
  CertificateArguments certificate;
};

/// Interprets the options; or the first error, as in parse_box.
Result<recon::ReconstructOptions> options_of(const ReconstructArguments& arguments);
/// What load_views() makes of the options.
Result<recon::SceneOptions> scene_options_of(const ReconstructArguments& arguments);
/// Those of one number of a range: frame, and with several instants a frame period the part of it, into
/// `out`.
ReconstructArguments arguments_of(const ReconstructArguments& range, std::uint64_t number,
                                  const std::filesystem::path& out);
/// The requested views of the requested frame, with their roles.
Result<recon::Scene> load_views(const ReconstructArguments& arguments, const Progress& progress);
/// The files that are read; they must not lie in the output folder.
std::vector<std::filesystem::path> inputs_of(const ReconstructArguments& arguments);

/// Adds the options for solving.
void add_solve_options(const Verb& verb, ReconstructArguments& a);
/// Adds the options for what is measured in the volume.
void add_quantity_options(const Verb& verb, ReconstructArguments& a);
/// Adds the options for the volume's place and its voxels.
void add_volume_options(const Verb& verb, ReconstructArguments& a);
/// Adds the options for choosing a session's frames.
void add_frame_options(const Verb& verb, ReconstructArguments& a);
/// Adds --frames A:B alone, and --every.
void add_range_options(const Verb& verb, ReconstructArguments& a);
/// Adds the options for converting pictures to radiance.
void add_picture_options(const Verb& verb, ReconstructArguments& a);

}  // namespace emberlock::cli
