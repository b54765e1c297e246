// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/output_folder.h"
#include "paper/run.h"

namespace emberlock::paper {

/// Who writes the folders of runs.
inline constexpr OutputVerb kEvaluatePaper{"evaluate paper"};

/// "nine-views, nine-of-ten, algebraic tomography, cpu", without what a folder's name can't have.
std::string folder_name(const MethodRun& run);

/// A folder with run.json and the pictures as PNG files, complete or not there at all. `settings`: what the
/// run depends on, in words; kept with it.
Status write_run(const MethodRun& run, const std::string& settings, const std::filesystem::path& folder);

/// Without pictures, of which the names are there. `where` is named in errors.
std::string run_json(const MethodRun& run, const std::string& settings);
Result<MethodRun> parse_run(std::string_view json, const std::string& settings, const std::string& where);

/// The same run again, to the last bit but for temperatures of the slice, which are whole kelvins. Errors,
/// bad_input: a folder that holds no run, one that was made with other settings.
Result<MethodRun> read_run(const std::filesystem::path& folder, const std::string& settings);

}  // namespace emberlock::paper
