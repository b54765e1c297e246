// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "films/import_parts.h"
#include "films/import_run.h"

namespace emberlock::report {

/// The content of import.json in the session.
std::string import_json(const films::ImportOptions& options, const films::ImportResult& result);

/// The content of import.html in the session, a self-contained page: which film belongs to which camera and
/// why, where the strobe was found, the residuals of its clock's fit, the common instants, when each camera
/// took them, what was left out, and what to do about it.
std::string import_page(const films::ImportOptions& options, const films::ImportResult& result);

films::ImportReports reports_of(const films::ImportOptions& options, const films::ImportResult& result);

}  // namespace emberlock::report
