// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "emberlock/v1/alignment.pb.h"
#include "rig/align/run.h"

namespace emberlock::rig {

v1::AlignmentSettings::Policy to_proto(smear::AlignPolicy policy);

/// Everything in the options that the decisions depend on: what a recording needs to be run again.
v1::AlignmentSettings to_proto(const AlignRunOptions& options);
/// Back. Error bad_input: a value that isn't one, or out of range; it is named.
Result<AlignRunOptions> align_options(const v1::AlignmentSettings& settings);

}  // namespace emberlock::rig
