// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/output_folder.h"
#include "evaluate/paper/run.h"

namespace emberlock::evaluate {

/// Who writes the folders of runs.
inline constexpr OutputVerb kEvaluatePaper{"evaluate paper"};

/// "nine-views, nine-of-ten, algebraic tomography, cpu", without what a folder's name can't have.
std::string folder_name(const Run& run);

/// A folder with run.json and the pictures as PNG files, complete or not there at all. `settings`: what the
/// run depends on, in words; kept with it.
Status write_run(const Run& run, const std::string& settings, const std::filesystem::path& folder);

/// The same run again, to the last bit but for temperatures of the slice, which are whole kelvins. Errors,
/// bad_input: a folder that holds no run, one that was made with other settings.
Result<Run> read_run(const std::filesystem::path& folder, const std::string& settings);

}  // namespace emberlock::evaluate
