// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"
#include "recon/views/box.h"

namespace emberlock::cli {

/// "cx,cy,cz,sx,sy,sz" in metres.
Result<recon::Box> parse_box(const std::string& text);

}  // namespace emberlock::cli
