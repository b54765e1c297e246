// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "paper/baselines/method.h"
#include "paper/known_gas.h"
#include "paper/protocol.h"

namespace emberlock::paper {

/// Of R, G and B. Pictures: RMSE over the box of the pixels that show gas, the mean square taken over the
/// views, grey levels (0..255). Volume: RMSE of the emission over all key points, over the truth's RMS there.
struct RunErrors {
  std::array<double, 3> input = {}, test = {}, all = {}, volume = {};
};

/// Of temperatures that are told, weighted by the light of the truth, over key points that emit at least 5 %
/// of the brightest; K.
struct TemperatureErrors {
  double median = 0, most = 0;  ///< absolute; 95 % lie below `most`
  double bias = 0;
  double told = 0;  ///< share of those key points
};

/// How far a run was after so many iterations.
struct RunPoint {
  int iteration = 0;
  Seconds time{0};  ///< without what looking at it took
  RunErrors errors;
};

/// A vertical cross section through the middle, rows from the top.
struct TemperatureSlice {
  ImageSize size;
  std::vector<float> found, truth;  ///< K; 0: not told, or no light
};

struct RunPicture {
  std::string name;  ///< "input-0", "test-10", "after-30": what the view of that number shows
  Image image;       ///< rgb8
};

/// One method on one case of a protocol: what became of it.
struct MethodRun {
  std::string protocol, of, method, device;
  std::string failed;  ///< why there is nothing; all that follows is then empty
  Seconds time{0};     ///< from pictures in memory to the volume
  int iterations = 0;
  std::string chose = {};  ///< MethodResult::chose
  RunErrors errors;
  std::optional<TemperatureErrors> temperature = {};
  std::vector<RunPoint> points = {};
  std::string passes_failed = {};  ///< why there are no more points
  std::optional<TemperatureSlice> slice = {};
  std::vector<RunPicture> pictures = {};
};

/// What belongs to all runs.
struct RunSettings {
  int voxels = 128;
  std::uint64_t seed = 1;
  recon::ComputeOptions compute;
  std::function<bool()> stop = {};
};

/// Runs a method on `scene`, which is `gas` as the case films it; the method sees the input views alone. A
/// method that fails on its own is a MethodRun that says why. Error `refused` where `stop` asks to end.
Result<MethodRun> run_method(const Protocol& protocol, const Case& of, const Method& method,
                             const KnownGas& gas, const recon::Scene& scene, const RunSettings& settings,
                             const Clock& clock);

/// The same views without those that are held out.
recon::Scene input_views(const recon::Scene& scene);

}  // namespace emberlock::paper
