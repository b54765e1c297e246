#pragma once

#include <cstring>

#include "base/host_device.h"

namespace emberlock {

/// Four floats that move together: R, G, B and a spare lane. One SSE register on the CPU.
struct alignas(16) Rgba {
  float c[4] = {0, 0, 0, 0};
};

#ifndef __CUDA_ARCH__
namespace detail {
using Lanes = float __attribute__((vector_size(16)));
inline Lanes lanes(const Rgba& a) {
  Lanes v;
  std::memcpy(&v, a.c, sizeof v);
  return v;
}
inline Rgba rgba(Lanes v) {
  Rgba a;
  std::memcpy(a.c, &v, sizeof v);
  return a;
}
}  // namespace detail
#endif

HOST_DEVICE inline Rgba operator+(const Rgba& a, const Rgba& b) {
#ifdef __CUDA_ARCH__
  return {{a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2], a.c[3] + b.c[3]}};
#else
  return detail::rgba(detail::lanes(a) + detail::lanes(b));
#endif
}
HOST_DEVICE inline Rgba operator-(const Rgba& a, const Rgba& b) {
#ifdef __CUDA_ARCH__
  return {{a.c[0] - b.c[0], a.c[1] - b.c[1], a.c[2] - b.c[2], a.c[3] - b.c[3]}};
#else
  return detail::rgba(detail::lanes(a) - detail::lanes(b));
#endif
}
HOST_DEVICE inline Rgba operator*(float s, const Rgba& a) {
#ifdef __CUDA_ARCH__
  return {{s * a.c[0], s * a.c[1], s * a.c[2], s * a.c[3]}};
#else
  return detail::rgba(detail::Lanes{s, s, s, s} * detail::lanes(a));
#endif
}
/// Negative lanes become 0.
HOST_DEVICE inline Rgba non_negative(const Rgba& a) {
#ifdef __CUDA_ARCH__
  return {{fmaxf(a.c[0], 0.F), fmaxf(a.c[1], 0.F), fmaxf(a.c[2], 0.F), fmaxf(a.c[3], 0.F)}};
#else
  const detail::Lanes v = detail::lanes(a);
  const detail::Lanes zero = {0, 0, 0, 0};
  return detail::rgba(v > zero ? v : zero);
#endif
}

}  // namespace emberlock
