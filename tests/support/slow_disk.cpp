// SPDX-License-Identifier: Apache-2.0
// A disk that is slow at segments, put before a program by LD_PRELOAD: each write to one waits for
// EMBERLOCK_SLOW_DISK_MS first, and as long as the file EMBERLOCK_SLOW_DISK_STUCK exists.
#include <array>
#include <cstdlib>
#include <cstring>
#include <string>

#include <dlfcn.h>
#include <sys/types.h>
#include <unistd.h>

namespace {

bool is_segment(int fd) {
  std::array<char, 512> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  const ssize_t length = ::readlink(link.c_str(), path.data(), path.size() - 1);
  if (length < 4) return false;
  const char* const end = path.data() + length - 4;
  return std::strcmp(end, ".nut") == 0 || std::strcmp(end, ".mkv") == 0;
}

}  // namespace

extern "C" ssize_t write(int fd, const void* bytes, size_t count) {
  using Write = ssize_t (*)(int, const void*, size_t);
  static const auto next = reinterpret_cast<Write>(::dlsym(RTLD_NEXT, "write"));
  static const char* const wait_ms = std::getenv("EMBERLOCK_SLOW_DISK_MS");
  static const char* const stuck = std::getenv("EMBERLOCK_SLOW_DISK_STUCK");
  if (wait_ms != nullptr && is_segment(fd)) {
    ::usleep(static_cast<useconds_t>(std::atoi(wait_ms)) * 1000);
    while (stuck != nullptr && ::access(stuck, F_OK) == 0) ::usleep(1000);
  }
  return next(fd, bytes, count);
}
