// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

#include <unistd.h>

namespace emberlock::test {

/// What stdin reads while it lives; at most a pipe's 64 KiB.
class TypedInput {
 public:
  explicit TypedInput(const std::string& bytes) : before_(::dup(STDIN_FILENO)) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
    if (::write(ends[1], bytes.data(), bytes.size()) < 0) throw std::runtime_error("no bytes");
    ::close(ends[1]);
    ::dup2(ends[0], STDIN_FILENO);
    ::close(ends[0]);
  }
  ~TypedInput() {
    ::dup2(before_, STDIN_FILENO);
    ::close(before_);
  }
  TypedInput(const TypedInput&) = delete;
  TypedInput& operator=(const TypedInput&) = delete;

 private:
  int before_;
};

}  // namespace emberlock::test
