#pragma once

#include <string>

#include "base/image.h"
#include "cli/import_parts.h"
#include "cli/import_run.h"

namespace emberlock::cli {

/// What import.json in the session says.
std::string import_json(const ImportOptions& options, const ImportResult& result);

/// import.html in the session, which stands alone: which film is which camera and why, where the strobe was
/// found, what its clock's fit leaves, the instants that are common, when each camera took them, what was
/// left out, and what to do about it.
std::string import_page(const ImportOptions& options, const ImportResult& result);

ImportReports reports_of(const ImportOptions& options, const ImportResult& result);

/// The picture as the page shows it: 8 bits, 280 pixels wide at most; mosaics grey.
Image small_picture(const Image& image);

}  // namespace emberlock::cli
