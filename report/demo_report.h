// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "rig/demo.h"

namespace emberlock::report {

/// Writes report.html and summary.png to `folder`.
Status write_demo_report(const rig::DemoResult& result, const std::filesystem::path& folder);

}  // namespace emberlock::report
