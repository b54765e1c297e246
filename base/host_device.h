#pragma once

/// Marks a function that runs on the CPU and, when nvcc compiles it, on the GPU.
#ifdef __CUDACC__
#define HOST_DEVICE __host__ __device__
#else
#define HOST_DEVICE
#endif
