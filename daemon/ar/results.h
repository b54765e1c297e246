// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "emberlock/v1/services.pb.h"

// What the daemon's reconstructions leave: RESULTS/SESSION/middle-frame and frame-N, each with a volume.vdb.
namespace emberlock::daemon {

/// All of them; the sessions whose results are newest first.
v1::ListResultsResponse list_results(const std::filesystem::path& results);

/// The folder of one, as v1::ArRequest names it: `result` empty for all frame-N of a session. Only what
/// list_results() lists is found, so that no name leads elsewhere. Error bad_input: there is none.
Result<std::filesystem::path> find_result(const std::filesystem::path& results, const std::string& session,
                                          const std::string& result);

}  // namespace emberlock::daemon
