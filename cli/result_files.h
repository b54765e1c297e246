// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace emberlock::cli {

/// A volume of a result of `reconstruct`.
struct ResultVolume {
  std::filesystem::path file;
  std::optional<std::uint64_t> frame;  ///< of a sequence
};

/// The volumes of a result: of its folder, of a volume.vdb, or of all frames (OUT/frame-N) of a sequence's
/// folder, rising. Error (bad_input): there is none.
Result<std::vector<ResultVolume>> volumes_of(const std::filesystem::path& result);

/// Whether a result is a folder of frames, and has no volume of its own.
bool is_sequence(const std::filesystem::path& result);

/// The frames of a sequence's folder that have no volume, rising: of those that its sequence/frames.json
/// tells of; where there is none, those that the volumes there are leave out of even steps.
std::vector<std::uint64_t> missing_frames(const std::filesystem::path& result,
                                          std::span<const ResultVolume> volumes);
/// "3, 7..9", of rising numbers.
std::string numbers_in_words(std::span<const std::uint64_t> numbers);
/// Names missing frames on stderr; nothing where there are none.
void warn_of_missing(std::span<const std::uint64_t> missing);

/// What the report.json beside a volume or in a result's folder tells in words at `key`; empty where it tells
/// nothing.
std::string reported(const std::filesystem::path& result, const char* key);

}  // namespace emberlock::cli
