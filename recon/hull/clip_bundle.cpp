// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/clip_bundle.h"

#include <bit>
#include <cstdint>

// Targets whose vectors can't be members of a struct.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "recon/hull/clip_bundle.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace emberlock::recon::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, RayBundle::kMost>;
using Ints = hn::RebindToSigned<Floats>;
using Float = hn::Vec<Floats>;
using Int = hn::Vec<Ints>;
using Bools = hn::Mask<Floats>;
constexpr Floats kFloats;
constexpr Ints kInts;

static_assert(std::endian::native == std::endian::little, "walk() takes bytes out of words");

HWY_INLINE Float all(float v) { return hn::Set(kFloats, v); }
HWY_INLINE Int all(int v) { return hn::Set(kInts, v); }

/// Some rays of a bundle.
struct Rays {
  const float* origin;
  Float direction[3];
};

/// walk_voxels() for several rays at once, one per lane. Calls cross(where, entering, t) at every border;
/// rays that end inside leave at `leave`.
template <class Cross>
HWY_INLINE void walk(const VoxelMask& mask, const Rays& rays, Float t, Float leave, const Cross& cross) {
  const Float never = all(1e30F);
  const int size[3] = {mask.mx, mask.my, mask.mz};
  const auto row = static_cast<int>(mask.row());
  const auto plane = static_cast<int>(mask.plane());
  const int stride[3] = {1, row, plane};
  const auto* words = reinterpret_cast<const std::int32_t*>(mask.inside);
  Int at = all(1 + row + plane);
  Int hop[3];
  Float next[3];
  Float delta[3];
  for (int a = 0; a < 3; ++a) {
    const Float d = rays.direction[a];
    const Float o = all(rays.origin[a]);
    const Bools forward = hn::Gt(d, all(0.F));
    const Bools along = hn::Eq(d, all(0.F));
    const Int cell = hn::ConvertTo(kInts, hn::Floor(hn::Add(o, hn::Mul(t, d))));
    const Int voxel = hn::Min(hn::Max(cell, all(0)), all(size[a] - 1));
    const Int face = hn::Add(voxel, hn::IfThenElseZero(hn::RebindMask(kInts, forward), all(1)));
    at = hn::Add(at, hn::Mul(voxel, all(stride[a])));
    hop[a] = hn::IfThenElse(hn::RebindMask(kInts, forward), all(stride[a]), all(-stride[a]));
    delta[a] = hn::IfThenElse(along, never, hn::Abs(hn::Div(all(1.F), d)));
    next[a] = hn::IfThenElse(along, never, hn::Div(hn::Sub(hn::ConvertTo(kFloats, face), o), d));
  }
  Int before = all(0);
  Bools walking = hn::Lt(t, leave);
  while (!hn::AllFalse(kFloats, walking)) {
    const Int word = hn::GatherIndex(kInts, words, hn::ShiftRight<2>(at));
    const Int here = hn::And(hn::Shr(word, hn::ShiftLeft<3>(hn::And(at, all(3)))), all(1));
    const Bools border = hn::And(walking, hn::RebindMask(kFloats, hn::Ne(here, before)));
    if (!hn::AllFalse(kFloats, border)) cross(border, hn::RebindMask(kFloats, hn::Gt(here, before)), t);
    before = hn::IfThenElse(hn::RebindMask(kInts, walking), here, before);
    const Bools x = hn::And(hn::Lt(next[0], next[1]), hn::Lt(next[0], next[2]));
    const Bools y = hn::AndNot(x, hn::Lt(next[1], next[2]));
    const Bools z = hn::Not(hn::Or(x, y));
    const Float face = hn::IfThenElse(x, next[0], hn::IfThenElse(y, next[1], next[2]));
    const Int step = hn::IfThenElse(hn::RebindMask(kInts, x), hop[0],
                                    hn::IfThenElse(hn::RebindMask(kInts, y), hop[1], hop[2]));
    next[0] = hn::Add(next[0], hn::IfThenElseZero(x, delta[0]));
    next[1] = hn::Add(next[1], hn::IfThenElseZero(y, delta[1]));
    next[2] = hn::Add(next[2], hn::IfThenElseZero(z, delta[2]));
    t = hn::IfThenElse(hn::Gt(t, face), t, face);
    walking = hn::Lt(t, leave);
    // A ray that has left doesn't move any more: its next voxel may be outside the mask.
    at = hn::Add(at, hn::IfThenElseZero(hn::RebindMask(kInts, walking), step));
  }
  cross(hn::RebindMask(kFloats, hn::Ne(before, all(0))), hn::FirstN(kFloats, 0), leave);
}

/// clip_to_box(); lanes that miss leave before they enter.
HWY_INLINE void clip(const VoxelMask& mask, const Rays& rays, Float& enter, Float& leave) {
  const int size[3] = {mask.mx, mask.my, mask.mz};
  for (int a = 0; a < 3; ++a) {
    const auto high = static_cast<float>(size[a]);
    const float o = rays.origin[a];
    const Float d = rays.direction[a];
    const Bools along = hn::Eq(d, all(0.F));
    const Float t0 = hn::Div(hn::Sub(all(0.F), all(o)), d);
    const Float t1 = hn::Div(hn::Sub(all(high), all(o)), d);
    const Bools rising = hn::Lt(t0, t1);
    const Float near = hn::IfThenElse(rising, t0, t1);
    const Float far = hn::IfThenElse(rising, t1, t0);
    const Float later = hn::IfThenElse(hn::Gt(enter, near), enter, near);
    const Float sooner = hn::IfThenElse(hn::Lt(leave, far), leave, far);
    const bool outside = o < 0 || o > high;
    enter = hn::IfThenElse(along, enter, later);
    leave = hn::IfThenElse(along, outside ? all(-1.F) : leave, sooner);
  }
}

/// clip_to_medium() for as many rays from `first` on as the vectors hold.
void clip_rays(const VoxelMask& mask, const VoxelMask& blocks, const RayBundle& bundle, int first,
               Crossings& crossings) {
  Rays rays{bundle.origin, {}};
  for (int a = 0; a < 3; ++a) rays.direction[a] = hn::LoadU(kFloats, bundle.direction[a].data() + first);
  Float enter = all(0.F);
  Float leave = all(1e30F);
  clip(mask, rays, enter, leave);
  const auto there = static_cast<std::size_t>(bundle.rays - first);
  leave = hn::IfThenElse(hn::FirstN(kFloats, there), leave, all(-1.F));

  constexpr float kShrink = 1.F / kBlock;
  const float in_blocks[3] = {kShrink * rays.origin[0], kShrink * rays.origin[1], kShrink * rays.origin[2]};
  Rays coarse = rays;
  coarse.origin = in_blocks;
  const Float none = all(-1.F);
  Float from = none;
  Float to = none;
  walk(blocks, coarse, hn::Mul(all(kShrink), enter), hn::Mul(all(kShrink), leave),
       [&](Bools where, Bools entering, Float t) HWY_ATTR {
         const Bools earliest = hn::And(hn::And(where, entering), hn::Lt(from, all(0.F)));
         from = hn::IfThenElse(earliest, t, from);
         to = hn::IfThenElse(hn::AndNot(entering, where), t, to);
       });
  constexpr float kMargin = 0.01F;  // as in clip_to_medium()
  from = hn::Sub(hn::Mul(all(static_cast<float>(kBlock)), from), all(kMargin));
  to = hn::Add(hn::Mul(all(static_cast<float>(kBlock)), to), all(kMargin));
  const Float start = hn::IfThenElse(hn::Gt(from, enter), from, enter);
  const Float end = hn::IfThenElse(hn::Lt(to, leave), to, leave);
  // A lane that met no block ends at -3.99, before it starts.
  walk(mask, rays, start, end, [&](Bools where, Bools /*entering*/, Float t) HWY_ATTR {
    alignas(64) float at[RayBundle::kMost];
    hn::Store(t, kFloats, at);
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(kFloats, where, bytes);
    for (unsigned bits = bytes[0] | static_cast<unsigned>(bytes[1]) << 8; bits != 0; bits &= bits - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
      crossings[static_cast<std::size_t>(first) + lane].push_back(at[lane]);
    }
  });
}

void clip_all(const VoxelMask& mask, const VoxelMask& blocks, const RayBundle& bundle, Crossings& crossings) {
  for (std::vector<float>& of_ray : crossings) of_ray.clear();
  const auto lanes = static_cast<int>(hn::Lanes(kFloats));
  for (int first = 0; first < bundle.rays; first += lanes) clip_rays(mask, blocks, bundle, first, crossings);
}

}  // namespace emberlock::recon::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace emberlock::recon {

HWY_EXPORT(clip_all);

void clip_bundle(const VoxelMask& mask, const VoxelMask& blocks, const RayBundle& bundle,
                 Crossings& crossings) {
  HWY_DYNAMIC_DISPATCH(clip_all)(mask, blocks, bundle, crossings);
}

}  // namespace emberlock::recon
#endif
