// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "rig/demo.h"

namespace emberlock::report {

/// report.html and summary.png in `folder`.
Status write_demo_report(const rig::DemoResult& result, const std::filesystem::path& folder);

}  // namespace emberlock::report
