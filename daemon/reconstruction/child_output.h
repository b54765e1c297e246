// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace emberlock::daemon {

/// What a child wrote to stderr, as far as a sentence can hold it.
class LastWords {
 public:
  void add(std::string_view bytes);
  /// Its last lines, in printable ASCII.
  [[nodiscard]] std::string text() const;

 private:
  std::string held_;
};

enum class ReadEnd { open, closed };

/// Gives `take` what is there now of a pipe that doesn't block; at most 1 MiB, so that nobody is kept from
/// the rest.
ReadEnd read_all(int fd, const std::function<void(std::string_view)>& take);

}  // namespace emberlock::daemon
