// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <new>

#include "tests/support/count_allocations.h"

#if defined(EMBERLOCK_SANITIZED)
#include <sanitizer/allocator_interface.h>
#endif

namespace {

void look_at(std::size_t bytes) {
  if (bytes == emberlock::counted::bytes.load(std::memory_order_relaxed)) ++emberlock::counted::count;
}

}  // namespace

#if defined(EMBERLOCK_SANITIZED)

// A sanitizer has operators of its own, and tells who asks what they allocate.
namespace {

const int installed = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void* /*block*/, std::size_t bytes) { look_at(bytes); },
    [](const volatile void* /*block*/) {});

}  // namespace

#else

// Not inlined: who sees malloc() behind new takes delete for a mistake.
__attribute__((noinline)) void* operator new(std::size_t bytes) {
  look_at(bytes);
  if (void* block = std::malloc(bytes > 0 ? bytes : 1)) return block;
  throw std::bad_alloc();
}
__attribute__((noinline)) void operator delete(void* block) noexcept { std::free(block); }
__attribute__((noinline)) void operator delete(void* block, std::size_t) noexcept { std::free(block); }

#endif
