// SPDX-License-Identifier: Apache-2.0
#include "base/thread_load.h"

#include <array>
#include <cstdlib>
#include <string>

#include <fcntl.h>
#include <unistd.h>

#include "base/unique_fd.h"

namespace emberlock {

int thread_id() { return static_cast<int>(::gettid()); }

std::optional<ThreadLoad> thread_load(int id) {
  const std::string path = "/proc/self/task/" + std::to_string(id) + "/schedstat";
  const UniqueFd file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  std::array<char, 80> text{};
  if (file.get() < 0 || ::read(file.get(), text.data(), text.size() - 1) <= 0) return std::nullopt;
  char* rest = nullptr;  // "nanoseconds run, nanoseconds waited, slices"
  const double ran = std::strtod(text.data(), &rest);
  const double waited = std::strtod(rest, nullptr);
  return ThreadLoad{nanoseconds(ran), nanoseconds(waited)};
}

}  // namespace emberlock
