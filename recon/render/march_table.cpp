#include "recon/render/march_table.h"

#include <cstdlib>
#include <string_view>
#include <type_traits>

namespace emberlock {
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

namespace {

enum class Level { baseline, v2, v3, v4 };

Level best_level() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return Level::v4;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
    return Level::v3;
  if (__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt")) return Level::v2;
#endif
  return Level::baseline;
}

constexpr const char* kNames[] = {"baseline", "v2", "v3", "v4"};

Level level() {
  static const Level chosen = [] {
    const Level best = best_level();
    const char* cap = std::getenv("EMBERLOCK_ISA");
    for (int l = 0; cap != nullptr && l < static_cast<int>(best); ++l)
      if (std::string_view(cap) == kNames[l]) return static_cast<Level>(l);
    return best;
  }();
  return chosen;
}

}  // namespace

template <class Real>
const MarchTable<Real>& march_table() {
  constexpr const Real* kPrecision = nullptr;
#if defined(__x86_64__)
  switch (level()) {
    case Level::v4:
      return isa::v4(kPrecision);
    case Level::v3:
      return isa::v3(kPrecision);
    case Level::v2:
      return isa::v2(kPrecision);
    case Level::baseline:
      break;
  }
#endif
  return isa::baseline(kPrecision);
}
template const MarchTable<float>& march_table<float>();
template const MarchTable<double>& march_table<double>();

const char* march_table_name() { return kNames[static_cast<int>(level())]; }

}  // namespace emberlock
