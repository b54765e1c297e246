// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "recon/pipeline/reconstruct.h"
#include "report/volume_axes.h"

namespace emberlock::report {

/// A heading, sentences, slices of temperature and of its error, each with a colour bar in K. Empty where
/// there are none.
std::string temperature_html(const recon::Outcome& outcome, const ShownAxes& axes);

/// The same of the errors of emission and extinction.
std::string errors_html(const recon::Outcome& outcome, const ShownAxes& axes);

}  // namespace emberlock::report
