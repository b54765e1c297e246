// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace emberlock {

constexpr double square(double x) { return x * x; }

}  // namespace emberlock
