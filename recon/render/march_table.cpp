// SPDX-License-Identifier: Apache-2.0
#include "recon/render/march_table.h"

#include <cstdlib>
#include <string_view>
#include <type_traits>

namespace emberlock::recon {
namespace isa {

#define EMBERLOCK_TABLES(name)                 \
  const MarchTable<float>& name(const float*); \
  const MarchTable<double>& name(const double*);
EMBERLOCK_TABLES(baseline)
#if defined(__x86_64__)
EMBERLOCK_TABLES(v2)
EMBERLOCK_TABLES(v3)
EMBERLOCK_TABLES(v4)
#endif
#undef EMBERLOCK_TABLES

}  // namespace isa

Isa best_isa() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return Isa::v4;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
    return Isa::v3;
  if (__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt")) return Isa::v2;
#endif
  return Isa::baseline;
}

namespace {

constexpr const char* kNames[] = {"baseline", "v2", "v3", "v4"};

Isa chosen_isa() {
  static const Isa chosen = [] {
    const Isa best = best_isa();
    const char* cap = std::getenv("EMBERLOCK_ISA");
    for (int l = 0; cap != nullptr && l < static_cast<int>(best); ++l)
      if (std::string_view(cap) == kNames[l]) return static_cast<Isa>(l);
    return best;
  }();
  return chosen;
}

}  // namespace

template <class Real>
const MarchTable<Real>& march_table([[maybe_unused]] Isa level) {
  constexpr const Real* kPrecision = nullptr;
#if defined(__x86_64__)
  switch (level) {
    case Isa::v4:
      return isa::v4(kPrecision);
    case Isa::v3:
      return isa::v3(kPrecision);
    case Isa::v2:
      return isa::v2(kPrecision);
    case Isa::baseline:
      break;
  }
#endif
  return isa::baseline(kPrecision);
}
template const MarchTable<float>& march_table<float>(Isa);
template const MarchTable<double>& march_table<double>(Isa);

template <class Real>
const MarchTable<Real>& march_table() {
  return march_table<Real>(chosen_isa());
}
template const MarchTable<float>& march_table<float>();
template const MarchTable<double>& march_table<double>();

const char* march_table_name() { return kNames[static_cast<int>(chosen_isa())]; }

}  // namespace emberlock::recon
