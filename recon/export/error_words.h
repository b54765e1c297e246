// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/temperature/error_summary.h"

namespace emberlock::recon {

/// A volume's errors in sentences: how large they are, by what they were found, and whether less noise or
/// more views would lower them.
std::vector<std::string> error_words(const ErrorSummary& errors);

}  // namespace emberlock::recon
