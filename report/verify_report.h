// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/output_folder.h"
#include "films/verify_run.h"

namespace emberlock::report {

/// Writes report.html, a self-contained page: the verdict, what to do, and the evidence.
Status write_verify_report(const films::VerifyRunResult& run, const OutputRequest& where);

}  // namespace emberlock::report
