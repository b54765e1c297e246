// SPDX-License-Identifier: Apache-2.0
#pragma once

// Function multiversioning (GCC's target_clones): a marked function is compiled for baseline x86-64 and for
// x86-64-v3 (AVX2); the loader picks one at start. Both give the same results: no multiply-add is fused and
// no sum reordered. Off under ThreadSanitizer, which can't run that early.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define EMBERLOCK_TARGET_CLONES __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define EMBERLOCK_TARGET_CLONES
#endif
