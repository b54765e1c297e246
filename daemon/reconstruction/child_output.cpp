// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/child_output.h"

#include <cerrno>
#include <vector>

#include <fmt/ranges.h>
#include <unistd.h>

namespace emberlock::daemon {

void LastWords::add(std::string_view bytes) {
  constexpr std::size_t kMost = 2000;
  held_.append(bytes);
  if (held_.size() > kMost) held_.erase(0, held_.size() - kMost);
}

std::string LastWords::text() const {
  constexpr std::size_t kLines = 4;
  std::vector<std::string> lines(1);
  for (const char c : held_) {
    if (c == '\n' || c == '\r') {
      if (!lines.back().empty()) lines.emplace_back();
    } else {
      lines.back() += c >= ' ' && c <= '~' ? c : '?';
    }
  }
  if (lines.back().empty()) lines.pop_back();
  if (lines.size() > kLines) lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(kLines));
  return fmt::format("{}", fmt::join(lines, " / "));
}

ReadEnd read_all(int fd, const std::function<void(std::string_view)>& take) {
  char bytes[65536];
  for (int i = 0; i < 16; ++i) {
    const ssize_t n = ::read(fd, bytes, sizeof bytes);
    if (n > 0) {
      take({bytes, static_cast<std::size_t>(n)});
    } else if (n == 0 || (errno != EINTR && errno != EAGAIN)) {
      return ReadEnd::closed;
    } else if (errno == EAGAIN) {
      return ReadEnd::open;
    }
  }
  return ReadEnd::open;
}

}  // namespace emberlock::daemon
