// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "recon/calibrate/camera_response.h"
#include "recon/compute/device.h"
#include "recon/effects/effects.h"
#include "recon/hull/hull.h"
#include "recon/render/volume.h"
#include "recon/temperature/emitter.h"
#include "recon/views/view.h"

namespace emberlock::paper {

/// How a method takes light to reach a camera.
enum class Projection { parallel, perspective };

/// What the paper's table of methods says of one.
struct MethodFacts {
  std::string_view name;         ///< "algebraic tomography"
  std::string_view publication;  ///< "Ihrke and Magnor 2004"
  bool in_plane = false;         ///< it takes the cameras to stand in one horizontal plane
  Projection projection = Projection::perspective;
  std::string_view model = "linear";  ///< of light: "linear", "refractive", "radiative transport"
  bool is_iterative = false;
};

struct MethodOptions {
  int voxels = 128;                               ///< along the longest side of the scene's box, 8..256
  std::optional<recon::CameraResponse> response;  ///< of all views; methods that read colours need it
  recon::Emitter emitter = recon::Emitter::grey;  ///< what glows
  bool temperatures = false;                      ///< whether MethodResult::kelvin is asked for
  std::uint64_t seed = 1;                         ///< of methods that draw random numbers
  recon::ComputeOptions compute;                  ///< a method runs where it can: all of them on the CPU
  /// Asked now and then: true ends the run with the best so far.
  std::function<bool()> stop = {};
};

/// What a method makes of a scene's input views, in a form that any camera can film: render_view() with these
/// shows it.
struct MethodResult {
  recon::Volume volume;
  recon::Hull medium;
  recon::Effects effects;
  int iterations = 0;
  std::string chose = {};          ///< what was found out from the pictures and not told, in words
  std::vector<float> kelvin = {};  ///< at the key points, 0 where not told; empty: none
};

/// A method of the literature on the scene as it was filmed: pictures in grey levels (0..255), linear in
/// light, on black; only views of role input are looked at. Deterministic for a seed and any number of
/// threads, unless `stop` ends it. Errors: bad_input for a scene or an option that it can't take,
/// not_converged where the result isn't finite or shows the input views worse than darkness does.
using RunMethod = Result<MethodResult> (*)(const recon::Scene& scene, const MethodOptions& options);

struct Method {
  MethodFacts facts;
  RunMethod run = nullptr;
};

}  // namespace emberlock::paper
