// SPDX-License-Identifier: Apache-2.0
#include "session/media/frame_file.h"

#include <cstddef>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "tests/fuzz/target.h"

// Whatever a file holds, opening and reading it ends in frames or in an error.
FUZZ_TARGET(frame_file) {
  static const emberlock::UniqueFd file(::memfd_create("input", MFD_CLOEXEC));
  static const std::string path = "/proc/self/fd/" + std::to_string(file.get());
  if (::ftruncate(file.get(), 0) != 0) return 0;
  if (::pwrite(file.get(), data, size, 0) != static_cast<ssize_t>(size)) return 0;
  auto frames = emberlock::session::FrameFile::open(path);
  constexpr int kEnough = 4;
  for (int i = 0; frames.ok() && i < kEnough; ++i) {
    if (!(*frames)->next().ok()) break;
  }
  return 0;
}
