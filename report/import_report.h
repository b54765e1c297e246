// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "films/import_parts.h"
#include "films/import_run.h"

namespace emberlock::report {

/// What import.json in the session says.
std::string import_json(const films::ImportOptions& options, const films::ImportResult& result);

/// import.html in the session, which stands alone: which film is which camera and why, where the strobe was
/// found, what its clock's fit leaves, the instants that are common, when each camera took them, what was
/// left out, and what to do about it.
std::string import_page(const films::ImportOptions& options, const films::ImportResult& result);

films::ImportReports reports_of(const films::ImportOptions& options, const films::ImportResult& result);

}  // namespace emberlock::report
