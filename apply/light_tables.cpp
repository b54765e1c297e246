// SPDX-License-Identifier: Apache-2.0
#include "apply/light_tables.h"

#include <Eigen/Core>

namespace emberlock::apply {
namespace {

Vec3 vec3_from(const std::array<double, 3>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

OutsideTable outside_of(const recon::Light& light) {
  OutsideTable table;
  table.strength = vec3_from(light.strength);
  table.ambient = vec3_from(light.ambient);
  table.place = vec3_from(light.place);
  if (light.source == recon::Light::Source::nearby) table.source = OutsideTable::Source::nearby;
  if (light.source != recon::Light::Source::distant) return table;
  table.source = OutsideTable::Source::distant;
  const Eigen::Vector3d towards =
      Eigen::Vector3d(light.place[0], light.place[1], light.place[2]).normalized();
  table.place = vec3_from({towards[0], towards[1], towards[2]});
  return table;
}

}  // namespace

LightTables::LightTables(const std::vector<const Flame*>& of, const recon::Light& light,
                         const std::vector<GlowingTriangle>& glowing)
    : panels(glowing), outside(outside_of(light)) {
  double sum = 0;
  for (std::size_t f = 0; f < of.size(); ++f) {
    flames.push_back(of[f]->table());
    for (const Flame::Emitter& e : of[f]->emitters()) {
      sum += e.power;
      emitters.push_back({static_cast<std::uint32_t>(f), e.voxel});
      power_until.push_back(sum);
    }
  }
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const double area = static_cast<double>(length(cross(panels[p].along, panels[p].aside))) / 2;
    sum += area * static_cast<double>(apply::sum(panels[p].emitted)) / 3;
    emitters.push_back({EmitterRow::kTriangle, static_cast<std::uint32_t>(p)});
    power_until.push_back(sum);
  }
  constexpr std::size_t kShares = 4096;
  std::uint32_t emitter = 0;
  for (std::size_t s = 0; s < kShares && !emitters.empty(); ++s) {
    while (emitter + 1 < emitters.size() && power_until[emitter] <= sum * static_cast<double>(s) / kShares)
      ++emitter;
    guide.push_back(emitter);
  }
}

}  // namespace emberlock::apply
