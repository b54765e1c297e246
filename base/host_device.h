#pragma once

/// Marks a function that runs on the CPU and, when nvcc compiles it, on the GPU. On the CPU it is always
/// inlined, so that it becomes code for the vector instructions of whoever calls it
/// (recon/render/march_table.h).
#ifdef __CUDACC__
#define HOST_DEVICE __host__ __device__
#else
#define HOST_DEVICE __attribute__((always_inline))
#endif
