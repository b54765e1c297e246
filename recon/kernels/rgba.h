// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>
#include <type_traits>

#include "base/host_device.h"

namespace emberlock::recon {

// Four numbers that are processed together: R, G, B and a fourth lane, for extinction or transmittance. They
// are arrays for nvcc, vector registers for other compilers; the memory layout is the same, and c[i] is lane
// i.

#ifdef __CUDACC__

template <class Real>
struct alignas(4 * sizeof(Real)) Quad {
  Real c[4] = {0, 0, 0, 0};
};
/// Two quads side by side.
template <class Real>
struct Pair {
  Quad<Real> low, high;
};

template <class Real>
HOST_DEVICE inline Quad<Real> operator+(const Quad<Real>& a, const Quad<Real>& b) {
  return {{a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2], a.c[3] + b.c[3]}};
}
template <class Real>
HOST_DEVICE inline Quad<Real> operator-(const Quad<Real>& a, const Quad<Real>& b) {
  return {{a.c[0] - b.c[0], a.c[1] - b.c[1], a.c[2] - b.c[2], a.c[3] - b.c[3]}};
}
template <class Real>
HOST_DEVICE inline Quad<Real> operator*(std::type_identity_t<Real> s, const Quad<Real>& a) {
  return {{s * a.c[0], s * a.c[1], s * a.c[2], s * a.c[3]}};
}
/// Negative lanes become 0.
template <class Real>
HOST_DEVICE inline Quad<Real> non_negative(const Quad<Real>& a) {
  Quad<Real> b;
  for (int i = 0; i < 4; ++i) b.c[i] = a.c[i] > 0 ? a.c[i] : Real(0);
  return b;
}
/// The quads p[0] and p[1].
template <class Real>
HOST_DEVICE inline Pair<Real> load_pair(const Quad<Real>* p) {
  return {p[0], p[1]};
}
template <class Real>
HOST_DEVICE inline Quad<Real> low(const Pair<Real>& a) {
  return a.low;
}
template <class Real>
HOST_DEVICE inline Quad<Real> high(const Pair<Real>& a) {
  return a.high;
}
/// a + t * (b - a)
template <class Real>
HOST_DEVICE inline Pair<Real> mix(std::type_identity_t<Real> t, const Pair<Real>& a, const Pair<Real>& b) {
  return {a.low + t * (b.low - a.low), a.high + t * (b.high - a.high)};
}
/// a + (low b.low, high b.high)
template <class Real>
HOST_DEVICE inline Pair<Real> add_weighted(const Pair<Real>& a, std::type_identity_t<Real> low,
                                           std::type_identity_t<Real> high, const Pair<Real>& b) {
  return {a.low + low * b.low, a.high + high * b.high};
}

#else

namespace detail {
template <class Real>
struct Lanes;
template <>
struct Lanes<float> {
  using Four = float __attribute__((vector_size(16)));
  using Eight = float __attribute__((vector_size(32)));
};
template <>
struct Lanes<double> {
  using Four = double __attribute__((vector_size(32)));
  using Eight = double __attribute__((vector_size(64)));
};
}  // namespace detail

/// With the same alignment for all levels of vector instructions: by default GCC aligns the lanes of double
/// to 16 bytes without AVX and to 32 with it.
template <class Real>
struct alignas(4 * sizeof(Real)) Quad {
  typename detail::Lanes<Real>::Four c = {0, 0, 0, 0};
};
template <class Real>
struct Pair {
  typename detail::Lanes<Real>::Eight c;
};

template <class Real>
HOST_DEVICE inline Quad<Real> operator+(const Quad<Real>& a, const Quad<Real>& b) {
  return {a.c + b.c};
}
template <class Real>
HOST_DEVICE inline Quad<Real> operator-(const Quad<Real>& a, const Quad<Real>& b) {
  return {a.c - b.c};
}
template <class Real>
HOST_DEVICE inline Quad<Real> operator*(std::type_identity_t<Real> s, const Quad<Real>& a) {
  return {s * a.c};
}
template <class Real>
HOST_DEVICE inline Quad<Real> non_negative(const Quad<Real>& a) {
  const typename detail::Lanes<Real>::Four zero = {0, 0, 0, 0};
  return {a.c > zero ? a.c : zero};
}
/// With one wide load.
template <class Real>
HOST_DEVICE inline Pair<Real> load_pair(const Quad<Real>* p) {
  Pair<Real> a;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
  std::memcpy(&a.c, p, sizeof a.c);
  return a;
}
template <class Real>
HOST_DEVICE inline Quad<Real> low(const Pair<Real>& a) {
  return {__builtin_shufflevector(a.c, a.c, 0, 1, 2, 3)};
}
template <class Real>
HOST_DEVICE inline Quad<Real> high(const Pair<Real>& a) {
  return {__builtin_shufflevector(a.c, a.c, 4, 5, 6, 7)};
}
template <class Real>
HOST_DEVICE inline Pair<Real> mix(std::type_identity_t<Real> t, const Pair<Real>& a, const Pair<Real>& b) {
  return {a.c + t * (b.c - a.c)};
}
/// a + (low b.low, high b.high)
template <class Real>
HOST_DEVICE inline Pair<Real> add_weighted(const Pair<Real>& a, std::type_identity_t<Real> low,
                                           std::type_identity_t<Real> high, const Pair<Real>& b) {
  const typename detail::Lanes<Real>::Eight weights = {low, low, low, low, high, high, high, high};
  return {a.c + weights * b.c};
}

#endif

/// a + t * (b - a)
template <class Real>
HOST_DEVICE inline Quad<Real> mix(std::type_identity_t<Real> t, const Quad<Real>& a, const Quad<Real>& b) {
  return a + t * (b - a);
}

using Rgba = Quad<float>;
using Rgba64 = Quad<double>;

}  // namespace emberlock::recon
