// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace emberlock::report {

using Rgb = std::array<std::uint8_t, 3>;

/// 256 colours from dark to bright, also for who sees no colours: Matplotlib's inferno.
const std::array<Rgb, 256>& inferno();

}  // namespace emberlock::report
