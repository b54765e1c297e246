// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Marks a function that runs on the CPU and, when nvcc compiles it, on the GPU. On the CPU it is always
/// inlined, so that it becomes code for the vector instructions of whoever calls it
/// (recon/render/march_table.h).
#ifdef __CUDACC__
#define HOST_DEVICE __host__ __device__
#else
#define HOST_DEVICE __attribute__((always_inline))
#endif

/// In front of a short loop that shall become vector code: GCC would unroll it to single numbers first.
#if defined(__GNUC__) && !defined(__clang__) && !defined(__CUDACC__)
#define VECTOR_LOOP _Pragma("GCC unroll 1")
#else
#define VECTOR_LOOP
#endif
