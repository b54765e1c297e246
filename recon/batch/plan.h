// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace emberlock::recon {

/// What a batch does, so that every rank, and every later run, does the same.
struct BatchPlan {
  std::string input;                           ///< the session's folder, as it was typed
  std::string session;                         ///< what tells it from another one
  std::vector<std::uint64_t> frames;           ///< rising
  int chunk = 1;                               ///< frames of each chunk, the last one aside
  int voxels = 0;                              ///< along the longest edge, of all
  std::map<std::string, std::string> options;  ///< that were given, and what results depend on
};

/// Frames a chunk where it isn't told: some sixty chunks, as ranks that end early wait for the last one, of 5
/// to 20 frames, as the first of each starts from darkness.
int usual_chunk(std::size_t frames);

struct Chunk {
  std::string name;  ///< "FIRST-LAST", in whose order names sort
  std::vector<std::uint64_t> frames;
};
std::vector<Chunk> chunks_of(const BatchPlan& plan);

std::string to_json(const BatchPlan& plan);
/// The reverse. `where` is named in errors (bad_input).
Result<BatchPlan> parse_plan(std::string_view json, const std::string& where);

/// The first option that was given otherwise: "--voxels was "16", and is "24""; empty where none was.
std::string other_option(const std::map<std::string, std::string>& before,
                         const std::map<std::string, std::string>& now);

/// Whether a run that is `asked` for goes on with what is planned. Its chunk counts where it isn't 0, its
/// voxels only as an option. Error (bad_input): the first difference.
Status same_run(const BatchPlan& planned, const BatchPlan& asked, const std::string& where);

}  // namespace emberlock::recon
