// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "paper/protocol.h"
#include "recon/calibrate/camera_response.h"
#include "recon/render/volume.h"
#include "recon/temperature/visible_gas.h"
#include "recon/views/box.h"
#include "recon/views/view.h"

namespace emberlock::paper {

/// An instant of simulated gas around the origin whose truth is known in every cell.
struct KnownGas {
  Subject subject = Subject::flame;
  recon::GasState gas;
  recon::Box box;
  recon::CameraResponse response;  ///< absolute, so that the brightest pixel from the side has 230 levels
  std::optional<recon::Sun> sun;
  Optics optics = Optics::physical;
  recon::Volume light;  ///< what cameras of that response see of it, levels a metre
};

/// Burns or blows until the gas stands (recon/synthetic/flame_simulation.h), on coarse grids first: a torch
/// of 14 kW, a burner of 2 cm, in a cube of 40 cm; smoke of a source of 10 cm in one of 60
/// cm. `cells`: along each edge, a multiple of 32 from 32 to 512. Errors: those of FlameSimulation; refused
/// where the observer asks to end, or where nothing is seen.
Result<KnownGas> simulate_gas(Subject subject, int cells, const recon::ComputeOptions& compute,
                              const Observer& observer = {});

/// Three broad channels, so that a black body of 5500 K, daylight, is white; absolute.
recon::CameraResponse daylight_camera();

/// The same gas by the paper's model of light, an opacity of 0.05 a step, of which `steps` go through the
/// box; exposed anew.
Result<KnownGas> as_the_paper_renders(const KnownGas& gas, int steps, const recon::ComputeOptions& compute);

/// The truth as a file that other programs open (recon/export/volume_file.h): emission and density, and
/// temperature (K) and absorption (1/m) beside them, from which read_gas() has the same again.
Status write_gas(const KnownGas& gas, const std::filesystem::path& path);
Result<KnownGas> read_gas(Subject subject, const std::filesystem::path& path,
                          const recon::ComputeOptions& compute);

/// The views of a case: 8 bits, linear in light. What the case's noise does to pictures and poses is a pure
/// function of `seed`; held-out views are as they are.
recon::Scene film(const KnownGas& gas, const Case& of, std::uint64_t seed,
                  const recon::ComputeOptions& compute);

}  // namespace emberlock::paper
