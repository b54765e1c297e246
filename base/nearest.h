// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace emberlock {

/// The known name that was probably meant: the one with the fewest letters added, removed or replaced
/// (Levenshtein 1966), at most `most` [two or a third of them]; the first of several. nullopt if none is
/// similar.
std::optional<std::string> nearest(std::string_view given, const std::vector<std::string>& known,
                                   std::optional<std::size_t> most = {});

}  // namespace emberlock
