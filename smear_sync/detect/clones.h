// SPDX-License-Identifier: Apache-2.0
#pragma once

// A function so marked is compiled for plain x86-64 and for processors with wide vectors, and the loader
// picks one. The results are the same: nothing fuses or reorders. ThreadSanitizer can't start before the
// loader's choice.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define EMBERLOCK_VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define EMBERLOCK_VECTOR_CLONES
#endif
