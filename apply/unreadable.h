// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "base/result.h"

namespace emberlock::apply {

/// Leaves a reader of foreign files at the first thing that it can't use; its public function returns it.
struct Unreadable {
  Error error;
};
[[noreturn]] inline void refuse(std::string what, std::string where, std::string remedy = {}) {
  throw Unreadable{{ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)}};
}
/// What an Unreadable says, of this file.
inline Error in_file(Error error, const std::string& file) {
  error.where = error.where.empty() ? file : file + ": " + error.where;
  return error;
}

}  // namespace emberlock::apply
