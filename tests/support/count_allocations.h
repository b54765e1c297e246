// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <new>
#include <stdexcept>

// Counts what is allocated in one size, such as a picture's: how often somebody copied one. In a program with
// tests/unit/recon_io/counting_new.cpp, whose operator new counts.
namespace emberlock {

namespace counted {
inline std::atomic<std::size_t> bytes{0};
inline std::atomic<int> count{0};
}  // namespace counted

/// So many blocks of exactly `bytes` does act() allocate, in all threads.
template <class Act>
int allocations_of(std::size_t bytes, const Act& act) {
  counted::count = 0;
  counted::bytes = bytes;
  ::operator delete(::operator new(bytes));
  if (counted::count.exchange(0) != 1) throw std::logic_error("this program's operator new doesn't count");
  act();
  counted::bytes = 0;
  return counted::count;
}

}  // namespace emberlock
