// SPDX-License-Identifier: Apache-2.0
#include "cli/line_reader.h"

#include <cerrno>
#include <cstddef>
#include <utility>

#include <poll.h>
#include <unistd.h>

namespace emberlock::cli {
namespace {

bool is_readable(int fd, int milliseconds) {
  pollfd watched{fd, POLLIN, 0};
  return ::poll(&watched, 1, milliseconds) > 0;
}

}  // namespace

std::vector<std::string> LineReader::take() {
  constexpr std::size_t kLongest = std::size_t{64} << 20;
  std::vector<std::string> lines;
  char bytes[65536];
  while (!ended_ && is_readable(fd_, 0)) {
    const ssize_t count = ::read(fd_, bytes, sizeof bytes);
    if (count < 0 && errno == EINTR) continue;
    ended_ = count <= 0 || begun_.size() > kLongest;
    for (ssize_t i = 0; i < count; ++i) {
      if (bytes[i] != '\n') {
        begun_ += bytes[i];
      } else if (!begun_.empty()) {
        lines.push_back(std::exchange(begun_, {}));
      }
    }
  }
  if (ended_ && !begun_.empty()) lines.push_back(std::exchange(begun_, {}));
  return lines;
}

void LineReader::wait(Seconds longest) const { is_readable(fd_, static_cast<int>(1000 * longest.value())); }

}  // namespace emberlock::cli
