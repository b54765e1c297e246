// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"
#include "emberlock/v1/services.pb.h"

namespace emberlock::daemon {

/// The error bad_input of a request's field.
Error refuse_field(const char* field, std::string what, std::string remedy);

/// Whether each value is in its range, and those that are asked for go together.
Status check_request(const v1::ReconstructRequest& request);

/// What the child reads on its stdin: its --response.
std::string input_for(const v1::ReconstructRequest& request);

}  // namespace emberlock::daemon
