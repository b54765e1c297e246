// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <math.h>

#include "apply/kernels/merged_light.h"
#include "apply/kernels/triangles.h"
#include "base/random.h"

namespace emberlock::apply {

/// What sends light: a voxel of a flame's coarse grid, or a triangle.
struct EmitterRow {
  static constexpr std::uint32_t kTriangle = ~0U;  // as flame
  std::uint32_t flame, number;
};

/// A triangle that shines evenly to both sides.
struct GlowingTriangle {
  Vec3 corner, along, aside;  ///< edges from the corner
  Vec3 emitted;               ///< radiance, grey levels

  /// A place in it (within: 0..1 twice), and what it sends along a direction (unit length): its radiance
  /// times its area as seen from there, grey levels m2.
  HOST_DEVICE inline void at(const Vec3& within, Vec3& place) const {
    const bool beyond = within.x + within.y > 1;
    place = corner + (beyond ? 1 - within.x : within.x) * along + (beyond ? 1 - within.y : within.y) * aside;
  }
  [[nodiscard]] HOST_DEVICE inline Vec3 sent(const Vec3& direction) const {
    return (0.5F * fabsf(dot(cross(along, aside), direction))) * emitted;
  }
};

/// The random numbers of one of a pixel's samples, each in 0..1.
struct Draw {
  std::uint64_t seed, stream;
  int sample, samples;

  [[nodiscard]] HOST_DEVICE inline double number(int i) const {
    return random_uniform(seed, stream,
                          kEach * static_cast<std::uint64_t>(sample) + static_cast<std::uint64_t>(i));
  }
  /// Evenly spread over the pixel's samples.
  [[nodiscard]] HOST_DEVICE inline double spread(int i) const { return (sample + number(i)) / samples; }
  static constexpr std::uint64_t kEach = 64;  ///< more than a sample takes
};

/// Light from outside, as OutsideLight says it.
struct OutsideTable {
  enum class Source : std::uint8_t { none, distant, nearby };
  Source source = Source::none;
  Vec3 place;  ///< unit length of a distant one
  Vec3 strength, ambient;
};

/// Flames, what of them glows, and light from outside, as plain pointers.
struct LightTable {
  const FlameTable* flames = nullptr;
  int count = 0;  ///< of flames
  const EmitterRow* emitters = nullptr;
  const double* power_until = nullptr;  ///< of each emitter: its own and all before it
  std::uint32_t glowing = 0;            ///< emitters
  const std::uint32_t* guide =
      nullptr;  ///< the first emitter of each equal share of the power (Chen and Asau 1974)
  std::uint32_t shares = 0;
  const GlowingTriangle* panels = nullptr;
  std::uint32_t panel_count = 0;
  OutsideTable outside;
};

/// The light that falls on surfaces, and from outside on smoke. Of flames, and of triangles that glow, one
/// random sample of the irradiance
///   E(x) = Int S(y) T(x, y) V(x, y) max(0, n . w) / |y - x|^2 dy,  w = (y - x) / |y - x|
/// over all of them; T is the smoke's transmittance, V whether no surface stands between. Its mean is E, but
/// for what the coarse grids of the flames leave out.
/// Of a part at distance r the share r^2 / (r^2 + a^2) comes from one place. Some are proposed: a voxel with
/// a chance proportional to its power (its integral of S), a place evenly in it; one of them is taken with a
/// chance proportional to what it would send here if nothing stood between (resampled importance sampling,
/// Talbot, Cline and Egbert 2005). The rest, which would have no bounded variance so, comes along one ray
/// whose direction is chosen with a chance proportional to its cosine (Malley's method, Pharr, Jakob and
/// Humphreys, "Physically Based Rendering", section 13.6.3). Far from a flame its a is 0
/// (FlameTable::close_by()). Triangles that glow are proposed beside voxels, with a of 0. `Triangles` is what
/// rays are cast at (surfaces.h), kMost the most flames.
template <class Triangles, int kMost>
struct FallingLight : LightTable {
  Triangles triangles;

  /// And of triangles: at a surface with this normal (unit length), grey levels times steradian.
  [[nodiscard]] HOST_DEVICE inline Vec3 of_flames(const Vec3& place, const Vec3& normal,
                                                  const Draw& draw) const {
    if (glowing == 0) return {};
    bool close = false;
    for (int f = 0; f < count; ++f) close = close || flames[f].close_by(place) > 0;
    const Vec3 light = from_one_place(place, normal, draw);
    return close ? light + along_a_ray(place, normal, draw) : light;
  }

  /// The share of the outside light that comes past surfaces, and through all flames but one.
  [[nodiscard]] HOST_DEVICE inline float outside_reaches(const Vec3& place, int but = -1) const {
    if (outside.source == OutsideTable::Source::none) return 1;
    float distance = 0;
    const Vec3 direction = towards_outside(place, distance);
    if (triangles.blocked(place, direction, clear_of_surface(place), distance)) return 0;
    float depth = 0;
    for (int f = 0; f < count; ++f)
      if (f != but) depth += flames[f].depth(place, direction, distance);
    return expf(-depth);
  }
  /// The radiance of a white surface in the light from outside.
  [[nodiscard]] HOST_DEVICE inline Vec3 outside_on_white(const Vec3& place, const Vec3& normal) const {
    if (outside.source == OutsideTable::Source::none) return outside.ambient;
    float distance = 0;
    const float cosine = dot(normal, towards_outside(place, distance));
    if (!(cosine > 0)) return outside.ambient;
    const float spread = outside.source == OutsideTable::Source::nearby ? distance * distance : 1;
    return outside.ambient + (4 * cosine / spread * outside_reaches(place)) * outside.strength;
  }

 private:
  static constexpr int kProposals = 8;
  static constexpr int kFirstOfProposals = 2;  // of a draw's numbers; those before are the ray's
  static_assert(kFirstOfProposals + 5 * kProposals <= Draw::kEach);

  /// A place that sends light, and how much would arrive if nothing stood between, over the chance of its
  /// proposal.
  struct Proposal {
    Vec3 place, irradiance;
  };

  HOST_DEVICE inline Vec3 towards_outside(const Vec3& place, float& distance) const {
    constexpr float kFarAway = 1e8F;  // metres: beyond all that stands in a scene
    distance = kFarAway;
    if (outside.source == OutsideTable::Source::distant) return outside.place;
    const Vec3 way = outside.place - place;
    distance = fmaxf(length(way), 1e-12F);
    return (1 / distance) * way;
  }

  /// `which`: 0..1 over the flames' power.
  HOST_DEVICE inline Proposal proposed(const Vec3& place, const Vec3& normal, double which,
                                       const Vec3& within) const {
    const double all = power_until[glowing - 1];
    auto share = static_cast<std::uint32_t>(which * shares);
    if (share >= shares) share = shares - 1;
    std::uint32_t chosen = guide[share];
    while (chosen + 1 < glowing && power_until[chosen] <= which * all) ++chosen;
    const EmitterRow& emitter = emitters[chosen];
    const double power = power_until[chosen] - (chosen > 0 ? power_until[chosen - 1] : 0);
    const bool burns = emitter.flame != EmitterRow::kTriangle;
    Proposal one;
    Vec3 sends;
    if (burns)
      flames[emitter.flame].sent(emitter.number, within, one.place, sends);
    else
      panels[emitter.number].at(within, one.place);
    const Vec3 towards = one.place - place;
    const float squared = dot(towards, towards);
    const float cosine = dot(normal, towards) / sqrtf(squared);
    if (!(cosine > 0)) return one;
    if (!burns) sends = panels[emitter.number].sent((1 / sqrtf(squared)) * towards);
    const float a = burns ? flames[emitter.flame].close_by(place) : 0;
    one.irradiance = (static_cast<float>(all / power) * cosine / (squared + a * a)) * sends;
    return one;
  }

  HOST_DEVICE inline Vec3 from_one_place(const Vec3& place, const Vec3& normal, const Draw& draw) const {
    float all = 0;
    Proposal taken;
    for (int i = 0; i < kProposals; ++i) {
      const int first = kFirstOfProposals + 5 * i;
      const Vec3 within{static_cast<float>(draw.number(first + 1)),
                        static_cast<float>(draw.number(first + 2)),
                        static_cast<float>(draw.number(first + 3))};
      const Proposal one = proposed(place, normal, (i + draw.spread(first)) / kProposals, within);
      const float light = sum(one.irradiance);
      all += light;
      if (light > 0 && static_cast<float>(draw.number(first + 4)) * all < light)
        taken = one;  // each with its share of the sum
    }
    if (!(all > 0)) return {};
    const Vec3 towards = taken.place - place;
    const float distance = length(towards);
    const Vec3 direction = (1 / distance) * towards;
    // Short of the place, where a triangle that glows is itself.
    if (triangles.blocked(place, direction, clear_of_surface(place),
                          distance - clear_of_surface(taken.place)))
      return {};
    float depth = 0;
    for (int f = 0; f < count; ++f) depth += flames[f].depth(place, direction, distance);
    return (all / (kProposals * sum(taken.irradiance)) * expf(-depth)) * taken.irradiance;
  }

  HOST_DEVICE inline Vec3 along_a_ray(const Vec3& place, const Vec3& normal, const Draw& draw) const {
    constexpr float kPi = 3.14159265F;
    const auto outwards = static_cast<float>(draw.spread(0));
    const float radius = sqrtf(outwards);
    const float angle = 2 * kPi * static_cast<float>(draw.number(1));
    const Vec3 aside = across(normal);
    const Vec3 direction =
        radius * (cosf(angle) * aside + sinf(angle) * cross(normal, aside)) + sqrtf(1 - outwards) * normal;
    MergedLight<CoarseSteps, kMost> along;
    for (int f = 0; f < count; ++f)
      along.add(CoarseSteps::of(flames[f], place, direction, flames[f].close_by(place)));
    const TriangleHit hit = triangles.first(place, direction, clear_of_surface(place));
    recon::Rgba light;
    along.up_to(&hit.distance, 1, &light);
    return kPi * Vec3{light.c[0], light.c[1], light.c[2]};
  }
};

}  // namespace emberlock::apply
