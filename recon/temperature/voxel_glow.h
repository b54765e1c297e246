// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "recon/adjust/solver.h"
#include "recon/temperature/self_absorption.h"
#include "recon/temperature/thermometer.h"
#include "recon/temperature/view_errors.h"

namespace emberlock::recon {

/// Whether most of the input views that see a point are saturated where they see it. The scene must outlive
/// it.
class Saturation {
 public:
  explicit Saturation(const Scene& scene);
  [[nodiscard]] bool at(const Eigen::Vector3d& point) const;

 private:
  std::vector<const View*> views_;
  bool any_ = false;
};

/// What a voxel's light is taken for: beside lines its self-absorption is less sure.
enum class Beside { nothing, lines };

/// What the key points of a volume show, with their errors; what it is made of must outlive it.
class VoxelGlow {
 public:
  /// `brightest`: the volume's brightest channel.
  VoxelGlow(const Reconstruction& done, const VolumeErrors& errors, const EmitterTable& table,
            SelfAbsorption own, const CameraResponse& response, double brightest);
  [[nodiscard]] Glow at(std::size_t point, Beside beside) const;
  /// Whether the extinction tells of a glow: it was reconstructed, the response has a scale, nothing
  /// scatters.
  [[nodiscard]] bool by_absorption() const { return by_absorption_; }

 private:
  const Volume& volume_;
  const VolumeErrors& errors_;
  SelfAbsorption own_;
  bool paper_, by_absorption_;
  std::array<bool, 3> dead_ = {};  // channels
  double brightest_, opacity_;
};

}  // namespace emberlock::recon
