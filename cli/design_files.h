// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/quantity.h"
#include "base/result.h"
#include "evaluate/error_law.h"

namespace emberlock::cli {

/// What `emberlock bench --json` found of a machine.
struct BenchFile {
  std::string name;  ///< the file's, without folder and extension
  Seconds frame{0};  ///< of bench's usual rig, effects found out, on the quicker of CPU and GPU
};

/// Errors (bad_input) name the file and what isn't as bench writes it.
Result<BenchFile> read_bench_file(const std::filesystem::path& file);
/// Of the file's text.
Result<BenchFile> parse_bench_file(std::string_view text, const std::filesystem::path& file);

/// The law in a report.json of `emberlock design`. Errors (bad_input) name the file and what is wrong.
Result<evaluate::ErrorLaw> read_error_law(const std::filesystem::path& file);
/// Of the file's text.
Result<evaluate::ErrorLaw> parse_error_law(std::string_view text, const std::filesystem::path& file);

}  // namespace emberlock::cli
