// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "cli/result_files.h"
#include "report/viewer_page.h"

namespace emberlock::cli {

struct ViewerOptions {
  report::Stored stored = report::Stored::half;
  std::string input =
      {};  ///< session or transforms.json whose cameras are shown; empty: what was reconstructed
  std::string rig = {};  ///< rig.json that stands before a session's own calibration
};

/// The viewer's script and style, where its build or package put them beside this program. Error (io): they
/// aren't there, as in a build without the console.
Result<report::ViewerProgram> viewer_program();

/// The page that shows a result's `volumes` (volumes_of()), with the cameras and the errors that its
/// report.json and its input tell. What stands in the way of the latter is said on stderr. Errors: those of
/// read_shared_volume() and ViewerPage.
Result<std::string> viewer_html(const std::filesystem::path& result, const std::vector<ResultVolume>& volumes,
                                const ViewerOptions& options, const report::ViewerProgram& program);

}  // namespace emberlock::cli
