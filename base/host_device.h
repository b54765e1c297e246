// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Marks a function that runs on the CPU and, when compiled by nvcc, on the GPU. On the CPU it is always
/// inlined, so that it is compiled for the vector instructions of its caller (recon/render/march_table.h).
#ifdef __CUDACC__
#define HOST_DEVICE __host__ __device__
#else
#define HOST_DEVICE __attribute__((always_inline))
#endif

/// Marks a short loop that the compiler shall vectorize. Without it GCC fully unrolls the loop into scalar
/// code first.
#if defined(__GNUC__) && !defined(__clang__) && !defined(__CUDACC__)
#define VECTOR_LOOP _Pragma("GCC unroll 1")
#else
#define VECTOR_LOOP
#endif
